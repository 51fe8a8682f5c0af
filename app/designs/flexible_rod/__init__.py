"""The flexible rod at the edge: what can be asked, what is answered, and its pictures."""
