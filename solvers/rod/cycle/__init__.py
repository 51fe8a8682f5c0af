"""One revolution of the machine and its extrema."""
