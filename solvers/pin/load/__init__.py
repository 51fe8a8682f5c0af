"""Loads on the bar: load cases and their internal forces."""
