"""Angles of one revolution."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

TURN = 2.0 * math.pi


def grid(samples: int, offset: float = 0.0) -> NDArray[np.float64]:
    """Equally spaced angles [rad] of one revolution, shape (samples,), shifted by ``offset`` steps."""
    return (np.arange(samples) + offset) * (TURN / samples)


def distance(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distances [rad] between angles modulo one revolution, elementwise."""
    return np.abs(np.mod(one - other + 0.5 * TURN, TURN) - 0.5 * TURN)


def distances(angles: NDArray[np.float64], others: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distances [rad] between angles modulo one revolution, (angles, others)."""
    return distance(angles[:, None], others)
