"""Between the stations of a panel a value may be greater than at any of them: where that is to be expected."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.stations.lobatto_panels import NODES, Stations

Array = NDArray[np.float64]

_DOUBTED = 2.0
"""What a parabola foretells is an estimate itself."""


def risen(stations: Stations, values: Array) -> Array:
    """What the greatest value of all may be off, relative, for every panel that may hold a greater one, (n/NODES,).

    ``values`` of shape (k, n) are k kinds of values at every station, each with a greatest one of its own, none
    negative. It is twice the share by which the summits of parabolas through three neighbouring stations rise above it.
    """
    found = np.zeros(values.shape[1] // NODES)
    _rise(stations.x, values, NODES, found)
    return found


@kernel
def _rise(x: Array, values: Array, nodes: int, found: Array) -> None:
    for kind in range(values.shape[0]):
        y, top = values[kind], 0.0
        for i in range(y.size):
            if not y[i] < np.inf:
                top = np.inf
            top = max(top, y[i])
        if not 0.0 < top < np.inf:
            continue
        for panel in range(found.size):
            highest = 0.0
            for i in range(panel * nodes + 1, (panel + 1) * nodes - 1):
                rise, fall = (y[i] - y[i - 1]) / (x[i] - x[i - 1]), (y[i + 1] - y[i]) / (x[i + 1] - x[i])
                bend = (fall - rise) / (x[i + 1] - x[i - 1])
                place = 0.5 * (x[i - 1] + x[i] - rise / bend)
                height = y[i]
                if bend < 0.0 and x[i - 1] < place < x[i + 1]:
                    height = y[i - 1] + (place - x[i - 1]) * (rise + bend * (place - x[i]))
                highest = max(highest, height)
            found[panel] = max(found[panel], _DOUBTED * (highest / top - 1.0))
