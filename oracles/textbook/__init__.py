"""Formulas as given in papers and textbooks."""
