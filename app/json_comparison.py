"""Comparison of JSON values with a tolerance."""

from __future__ import annotations

import math
from typing import Any

_TOLERANCE = 1e-9


def equal_json(one: Any, other: Any) -> bool:
    """Whether two JSON values are equal, numbers to a tolerance: bulk evaluation may round differently from a single
    one."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(equal_json(one[name], other[name]) for name in one)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(equal_json, one, other))
    if isinstance(one, float) and isinstance(other, (int, float)):
        return math.isclose(one, other, rel_tol=_TOLERANCE, abs_tol=_TOLERANCE)
    return one == other
