"""Between the stations of a panel a value may be greater than at any of them: where that is to be expected."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.pin.stations.lobatto_panels import NODES, Stations

Array = NDArray[np.float64]

_DOUBTED = 2.0
"""What a parabola foretells is an estimate itself."""


def risen(stations: Stations, values: Array) -> Array:
    """What the greatest value of all may be off, relative, for every panel that may hold a greater one, (n/NODES,).

    ``values`` of shape (k, n) are k kinds of values at every station, each with a greatest one of its own, none
    negative. It is twice the share by which parabolas through three neighbouring stations rise above it.
    """
    found = np.zeros(values.shape[1] // NODES)
    x = stations.x.reshape(-1, NODES)
    for own in values:
        top = float(own.max())
        if 0.0 < top < np.inf:
            found = np.maximum(found, _DOUBTED * (_summits(x, own.reshape(-1, NODES)).max(axis=1) / top - 1.0))
    return found


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
