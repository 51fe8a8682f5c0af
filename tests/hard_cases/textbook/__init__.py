"""Textbook formulas in floats, for comparison in the hard cases."""
