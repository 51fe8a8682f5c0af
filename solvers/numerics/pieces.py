"""Subdivision of intervals."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def subdivide(breaks: Array, longest: float) -> Array:
    """The breaks, with points inserted so that no interval is longer than ``longest``."""
    parts = np.maximum(np.ceil(np.diff(breaks) / longest).astype(int), 1)
    index = np.repeat(np.arange(parts.size), parts)
    step = np.arange(index.size) - np.repeat(np.cumsum(parts) - parts, parts)
    low, width = breaks[:-1][index], np.diff(breaks)[index]
    return np.append(low + width * (step / parts[index]), breaks[-1])
