"""Pins of stepped bores under the rod's force, without stations."""
