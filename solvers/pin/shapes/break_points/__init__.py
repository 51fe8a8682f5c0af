"""Stepped bores and outer profiles: optimal break points with a global lower bound."""
