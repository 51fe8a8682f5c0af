"""Whether two answers are the same."""

from __future__ import annotations

import math
from typing import Any

_LAST_DIGITS = 1e-9


def same(one: Any, other: Any) -> bool:
    """Whether two JSON values are the same but for the last digits of their numbers: many checks in one loop may round
    otherwise than one."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(same(one[name], other[name]) for name in one)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, float) and isinstance(other, (int, float)):
        return math.isclose(one, other, rel_tol=_LAST_DIGITS, abs_tol=_LAST_DIGITS)
    return one == other
