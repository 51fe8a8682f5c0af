"""What a search sees of the full model: rows at peaks, what corrections add, exact checks."""
