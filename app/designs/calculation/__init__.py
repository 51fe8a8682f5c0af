"""Calculations as one does them by hand: formulas, the numbers put in, and what comes out, step by step."""
