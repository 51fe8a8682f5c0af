"""Export files of runs: one module per format; ``registry`` is the only list."""
