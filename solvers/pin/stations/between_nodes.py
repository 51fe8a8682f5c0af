"""Estimates of maxima between the stations of a panel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.stations.lobatto_panels import NODES, Stations

Array = NDArray[np.float64]

_SAFETY_FACTOR = 2.0
"""Safety factor of the parabolic estimate."""


def risen(stations: Stations, values: Array, most: float = np.inf) -> Array:
    """Return by how much, relative, the global maximum may be exceeded within each panel, (n/NODES,).

    ``values`` of shape (k, n) are k non-negative quantities at every station, each with its own maximum. The
    estimate is twice the relative excess of parabolas through three neighbouring stations. With ``most``, an upper
    bound of the values, kinks between stations are considered as well: the intersection of lines through neighbours
    on either side.
    """
    found = np.zeros(values.shape[1] // NODES)
    _rise(stations.x, values, NODES, most, found)
    return found


@kernel
def _kink(x: Array, y: Array, i: int, first: int, last: int) -> float:
    """Return the height at which extrapolations from both sides intersect between stations i and i + 1; y[i] if
    none."""
    up, down = 0.0, 0.0
    if i > first:
        up = (y[i] - y[i - 1]) / (x[i] - x[i - 1])
    if i + 2 <= last:
        down = (y[i + 2] - y[i + 1]) / (x[i + 2] - x[i + 1])
    if i == first:
        return max(y[i], y[i + 1] - down * (x[i + 1] - x[i]))
    if i + 1 == last:
        return max(y[i], y[i] + up * (x[i + 1] - x[i]))
    if up > down:
        along = (y[i + 1] - y[i] - down * (x[i + 1] - x[i])) / (up - down)
        if 0.0 < along < x[i + 1] - x[i]:
            return y[i] + up * along
    return y[i]


@kernel
def _rise(x: Array, values: Array, nodes: int, most: float, found: Array) -> None:
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
                before, behind = (y[i] - y[i - 1]) / (x[i] - x[i - 1]), (y[i + 1] - y[i]) / (x[i + 1] - x[i])
                bend = (behind - before) / (x[i + 1] - x[i - 1])
                place = 0.5 * (x[i - 1] + x[i] - before / bend)
                height = y[i]
                # An end without load and wall, beside which values stay finite, does not indicate a maximum.
                ends = most < np.inf and (y[i - 1] == 0.0 or y[i + 1] == 0.0)
                if bend < 0.0 and x[i - 1] < place < x[i + 1] and not ends:
                    height = y[i - 1] + (place - x[i - 1]) * (before + bend * (place - x[i]))
                highest = max(highest, height)
            rise = _SAFETY_FACTOR * (highest / top - 1.0)
            if most < np.inf:
                first, last = panel * nodes, (panel + 1) * nodes - 1
                for i in range(first, last):
                    rise = max(rise, _kink(x, y, i, first, last) / top - 1.0)
                rise = min(rise, max(most / top - 1.0, 0.0))
            found[panel] = max(found[panel], rise)
