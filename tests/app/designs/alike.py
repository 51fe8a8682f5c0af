"""Comparison of JSON values up to rounding."""

from __future__ import annotations

import math

SAME = 1e-12


def differences(found, exact, place=""):
    """Where two JSON values differ by more than rounding."""
    if isinstance(exact, dict) and isinstance(found, dict):
        names = exact.keys() | found.keys()
        return [d for n in names for d in differences(found.get(n, "none"), exact.get(n, "none"), f"{place}/{n}")]
    if isinstance(exact, list) and isinstance(found, list) and len(exact) == len(found):
        return [d for i, (f, e) in enumerate(zip(found, exact, strict=True)) for d in differences(f, e, f"{place}/{i}")]
    if isinstance(exact, tuple) and isinstance(found, tuple):
        return differences(list(found), list(exact), place)
    numbers = all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in (found, exact))
    if numbers and math.isclose(found, exact, rel_tol=SAME, abs_tol=1e-300):
        return []
    return [] if found == exact else [(place, found, exact)]
