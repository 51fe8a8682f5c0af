"""Local searches on the full model and their starting points."""
