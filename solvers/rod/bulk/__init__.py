"""Checks of many strips in one compiled loop."""
