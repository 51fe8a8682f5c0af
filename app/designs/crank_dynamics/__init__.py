"""The kind crank-dynamics: requests, results and plots."""
