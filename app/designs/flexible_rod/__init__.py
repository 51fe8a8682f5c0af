"""The kind flexible-rod: requests, results and plots."""
