"""Reports of runs: format-independent content, rendered as HTML and PDF."""
