"""Promises held against thousands of random scenes: honest estimates of the error, and effects chosen rightly."""
