"""Rivals of designs that want to win: local searches on the check itself."""
