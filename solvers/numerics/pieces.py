"""Intervals on a line: subdivided, and found."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel

Array = NDArray[np.float64]


@kernel
def piece_at(starts: Array, place: float, near: int) -> int:
    """Return the last piece that starts at or before ``place``, the first if none does; ``starts`` ascend.

    The search begins at ``near``: for places in order it is usually that piece or the next.
    """
    k = near
    while k > 0 and starts[k] > place:
        k -= 1
    while k + 1 < starts.size and starts[k + 1] <= place:
        k += 1
    return k


def subdivide(breaks: Array, longest: float) -> Array:
    """The breaks, with points inserted so that no interval is longer than ``longest``."""
    parts = np.maximum(np.ceil(np.diff(breaks) / longest).astype(int), 1)
    index = np.repeat(np.arange(parts.size), parts)
    step = np.arange(index.size) - np.repeat(np.cumsum(parts) - parts, parts)
    low, width = breaks[:-1][index], np.diff(breaks)[index]
    return np.append(low + width * (step / parts[index]), breaks[-1])
