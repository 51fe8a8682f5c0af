"""The impact linkage at the edge: what can be asked, what is answered, and its pictures."""
