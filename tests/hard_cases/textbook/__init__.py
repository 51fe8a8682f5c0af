"""Formulas as textbooks have them, in floats: what the hard cases are set beside."""
