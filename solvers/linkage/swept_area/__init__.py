"""What the moving mechanism sweeps."""
