"""Location of a smooth function's maximum, with the precision needed for hand calculations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_POINTS, _ROUNDS = 721, 4


def greatest_at(function: Callable[[Array], Array], low: float, high: float, points: int = _POINTS) -> float:
    """The argument of the maximum, by successively refined sampling around the best point."""
    best, reach = 0.5 * (low + high), 0.5 * (high - low)
    for _ in range(_ROUNDS):
        at = np.linspace(max(best - reach, low), min(best + reach, high), points)
        best = float(at[int(np.argmax(function(at)))])
        reach, points = 2.0 * (at[1] - at[0]), 41
    return best
