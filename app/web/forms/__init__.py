"""Forms from the request models: what can be filled in, and what it means as a request."""
