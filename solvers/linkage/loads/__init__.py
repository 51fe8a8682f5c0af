"""Loads of the joints and the crank."""
