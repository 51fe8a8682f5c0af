"""The lower bound: branch and bound over boxes of strips."""
