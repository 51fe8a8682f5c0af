"""Between the stations of a panel the strength may be used more than at any of them: where that is to be expected."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.pin.stations import NODES, Stations

Array = NDArray[np.float64]

_DOUBTED = 2.0
"""What a parabola foretells is an estimate itself."""


def risen(stations: Stations, uses: Array) -> Array:
    """By what share of the greatest use of all parabolas through three neighbouring stations rise above it, for every
    panel, (n/NODES,).

    ``uses`` of shape (k, n) is how much is used at every station of k kinds of strength, each with a greatest use of
    its own.
    """
    found = np.zeros(uses.shape[1] // NODES)
    x = stations.x.reshape(-1, NODES)
    for use in uses:
        top = float(use.max())
        if 0.0 < top < np.inf:
            found = np.maximum(found, _summits(x, use.reshape(-1, NODES)).max(axis=1) / top - 1.0)
    return found


def doubt(rise: Array) -> float:
    """What the greatest use may be off, relative."""
    return _DOUBTED * float(rise.max())


def _summits(x: Array, y: Array) -> Array:
    """The summits of parabolas through three neighbours each, (panels, NODES - 2); the middle one where there is no
    summit between them."""
    x0, x1, x2 = x[:, :-2], x[:, 1:-1], x[:, 2:]
    y0, y1, y2 = y[:, :-2], y[:, 1:-1], y[:, 2:]
    with np.errstate(divide="ignore", invalid="ignore"):
        rise, fall = (y1 - y0) / (x1 - x0), (y2 - y1) / (x2 - x1)
        bend = (fall - rise) / (x2 - x0)
        place = 0.5 * (x0 + x1 - rise / bend)
        height = y0 + (place - x0) * (rise + bend * (place - x1))
        return np.where((bend < 0.0) & (place > x0) & (place < x2), height, y1)
