"""Local searches on the full model, and where they start."""
