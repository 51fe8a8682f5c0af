"""Estimates of maxima and running maxima between the stations of a panel."""

from __future__ import annotations

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.pin.stations.lobatto_panels import NODES

_SAFETY_FACTOR = 2.0
"""Safety factor of the parabolic estimate."""


@kernel
def _parabola(x: Array, y: Array, sign: float, i: int) -> tuple[float, float]:
    """Position and height of the maximum of the parabola through ``sign`` y around i; NaN and -inf without one."""
    rise, fall = sign * (y[i] - y[i - 1]) / (x[i] - x[i - 1]), sign * (y[i + 1] - y[i]) / (x[i + 1] - x[i])
    bend = (fall - rise) / (x[i + 1] - x[i - 1])
    if not bend < 0.0:
        return np.nan, -np.inf
    top = 0.5 * (x[i - 1] + x[i] - rise / bend)
    return top, sign * y[i - 1] + (top - x[i - 1]) * (rise + bend * (top - x[i]))


@kernel
def maximum_excess(x: Array, values: Array) -> Array:
    """Return the estimated relative excess over the maximum at stations ``x`` within each panel, (n/NODES,).

    ``values`` of shape (k, n) are k non-negative quantities at every station, each with its own maximum. The
    estimate is twice the relative excess of parabolas through three neighbouring stations.
    """
    found = np.zeros(x.size // NODES)
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
            first, last = panel * NODES, (panel + 1) * NODES - 1
            for i in range(first + 1, last):
                place, height = _parabola(x, y, 1.0, i)
                # No maximum between stations where values rise on beyond the next one, or fall before.
                rises_on = y[i] < y[i + 1] and i + 2 <= last and y[i + 1] < y[i + 2]
                fell_before = y[i] < y[i - 1] and i - 2 >= first and y[i - 1] < y[i - 2]
                if x[i - 1] < place < x[i + 1] and not (rises_on or fell_before):
                    highest = max(highest, height)
                highest = max(highest, y[i])
            found[panel] = max(found[panel], _SAFETY_FACTOR * (highest / top - 1.0))
    return found


@kernel
def _excess_beside(x: Array, f: Array, sign: float, first: int, j: int) -> float:
    """Excess beside a panel's j-th node by three parabolas, one of which at least does not straddle a kink."""
    low, high, own, most = x[first + max(j - 1, 0)], x[first + min(j + 1, NODES - 1)], sign * f[first + j], 0.0
    for shift in range(-1, 2):
        i = first + min(max(j + shift, 1), NODES - 2)
        top, height = _parabola(x, f, sign, i)
        if low < top < high:
            most = max(most, height - own)
    return most


@kernel
def running_maximum_error(x: Array, weight: Array, values: Array, span: float, forward: bool) -> Array:
    """Return per panel the integrated error of a running maximum over stations x, relative to the whole length.

    At a station that attains the running maximum, parabolas through it and its neighbours estimate the excess of the
    true maximum, weighted with the length over which it remains the running maximum, and the depth of a minimum before
    the next station, weighted with the distance to it; both are doubled as a safety factor. Without ``forward`` the
    maximum is taken from right to left.
    """
    n = x.size
    held_length, attains, missed = np.zeros(n), np.zeros(n), np.zeros(n // NODES)
    running, source = -np.inf, 0
    for k in range(n):
        i = k if forward else n - 1 - k
        if values[i] >= running:
            running, source, attains[i] = values[i], i, 1.0
        held_length[source] += weight[i]
    for first in range(NODES, n, NODES):
        # Adjacent panels have a position in common, and the maximum may lie on either side.
        held_length[first] = held_length[first - 1] = held_length[first] + held_length[first - 1]
    for panel in range(missed.size):
        first = panel * NODES
        for j in range(NODES):
            i, before, behind = first + j, first + max(j - 1, 0), first + min(j + 1, NODES - 1)
            if held_length[i] > 0.0:
                missed[panel] += 2.0 * held_length[i] * _excess_beside(x, values, 1.0, first, j)
            if attains[i] > 0.0:
                reach = (x[behind] - x[before]) / (behind - before) / span
                missed[panel] += 2.0 * reach * _excess_beside(x, values, -1.0, first, j)
    return missed
