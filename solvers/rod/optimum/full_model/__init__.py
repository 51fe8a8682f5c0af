"""From the core's optimum to that of the full model."""
