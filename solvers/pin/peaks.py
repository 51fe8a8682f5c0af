"""Between the stations of a panel the strength may be used more than at any of them: where that is to be expected."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.pin.stations import NODES, Stations

Array = NDArray[np.float64]

_NEAR = 0.02
"""Panels whose stations come this near the greatest use are looked into."""


def peaked(stations: Stations, use: Array, share: float) -> NDArray[np.bool_]:
    """Panels, (n/NODES,), in which parabolas through three neighbouring stations rise above the greatest use of all by
    more than this share of it; ``use`` of shape (n,) is how much of the strength is used at every station."""
    top = float(use.max())
    if not 0.0 < top < np.inf:
        return np.zeros(use.size // NODES, dtype=bool)
    x, y = stations.x.reshape(-1, NODES), use.reshape(-1, NODES)
    near = np.flatnonzero(y.max(axis=1) >= top * (1.0 - _NEAR))
    at = np.clip(y[near].argmax(axis=1), 1, NODES - 2)[:, None] + np.array([-1, 0, 1])
    (x0, x1, x2), (y0, y1, y2) = (np.take_along_axis(a[near], at, axis=1).T for a in (x, y))
    left, right = (y1 - y0) / (x1 - x0), (y2 - y1) / (x2 - x1)
    bend = (right - left) / (x2 - x0)
    with np.errstate(divide="ignore", invalid="ignore"):
        summit = np.clip(0.5 * (x0 + x1) - 0.5 * left / bend, x0, x2)
    height = np.where(bend < 0.0, y0 + (summit - x0) * (left + bend * (summit - x1)), y1)
    found = np.zeros(y.shape[0], dtype=bool)
    found[near[height > top * (1.0 + share)]] = True
    return found
