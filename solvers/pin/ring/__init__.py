"""Ring model of the section, and bearing pressures."""
