"""What a CAD tool or a person takes away from a run: one file for each format, ``registry`` is their only list."""
