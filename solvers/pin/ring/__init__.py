"""The section as a ring, and bearing pressures."""
