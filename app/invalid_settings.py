"""The error of settings, in a module of its own: the command line imports no settings unless it needs them."""

from __future__ import annotations


class InvalidSettings(Exception):
    """Settings that the service cannot have, one line for each: variable, value, allowed values."""
