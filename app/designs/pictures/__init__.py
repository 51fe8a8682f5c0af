"""Charts, and the pictures that every kind has."""
