"""The bar as a ring, and what presses on it."""
