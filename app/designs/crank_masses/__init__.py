"""The kind crank-masses: mass reduction of a connecting rod."""
