"""The kind impact-linkage: requests, results and plots."""
