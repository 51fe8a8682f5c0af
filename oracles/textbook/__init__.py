"""The formulas as papers and textbooks give them."""
