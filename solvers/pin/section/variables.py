"""Conversions between two measures of a hollow section, without cancellation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def wall_of(solidity: Array) -> Array:
    """w of u = 1 - (1 - w)^2, without cancellation: u/(1 + sqrt(1 - u))."""
    return solidity / (1.0 + np.sqrt(np.maximum(1.0 - solidity, 0.0)))


def solidity_of(wall: Array) -> Array:
    """u = w (2 - w): the solid fraction of the section."""
    return wall * (2.0 - wall)
