"""Competing designs: local searches that only use the check."""
