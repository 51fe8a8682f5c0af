"""Measurements against the peers a user would pick instead."""
