"""Minimum-mass walls at given stations, with a proven lower bound."""
