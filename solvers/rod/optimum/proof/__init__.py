"""Lower bound by branch and bound over boxes of strips."""
