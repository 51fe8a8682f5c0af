"""Steady running with a motor."""
