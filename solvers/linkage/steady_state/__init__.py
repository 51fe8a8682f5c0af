"""The machine running with a motor."""
