"""One turn of the machine and the extremes in it."""
