"""Batch checks of pins: array tables and lists of cases."""
