"""Statistical tests on thousands of random scenes: error estimates, selection of effects, and certificates."""
