"""The search for the best strip."""
