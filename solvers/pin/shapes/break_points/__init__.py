"""Stepped bores and stepped outsides: the break points that make them lightest, and a bound over all others."""
