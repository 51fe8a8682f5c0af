"""Loads: pressure over the crank angle and the resulting axial force."""
