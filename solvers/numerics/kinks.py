"""Where a function that is sampled at the nodes of panels has kinks or jumps."""

from __future__ import annotations

import math

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel


@kernel
def cuts(x: Array, f: Array, excess: Array, kinked: float, nodes: int) -> Array:
    """Return where panels are cut, given values f at ``nodes`` positions x in each and the error over its tolerance,
    ``excess`` (panels,): in the middle where that exceeds 1, and on either side of a kink where it exceeds ``kinked``.

    The kink lies where the slope changes most. Both cuts are near the intersection of the lines through the nodes on
    either side, so near that an error quadratic in the width is tolerable, or at the nodes if they do not intersect.
    """
    places, count = np.empty(3 * excess.size), 0
    for panel in range(excess.size):
        first, last = panel * nodes, (panel + 1) * nodes - 1
        if excess[panel] > 1.0:
            places[count] = x[first] + 0.5 * (x[last] - x[first])
            count += 1
        if not excess[panel] > kinked:
            continue
        at, most, before = first, -1.0, 0.0
        for i in range(first, last):
            after = 0.0
            if i + 1 < last:
                after = abs((f[i + 2] - f[i + 1]) / (x[i + 2] - x[i + 1]) - (f[i + 1] - f[i]) / (x[i + 1] - x[i]))
            if before + after > most:
                at, most = i, before + after
            before = after
        left, right = x[at], x[at + 1]
        if first < at < last - 1:
            rise, fall = (f[at] - f[at - 1]) / (left - x[at - 1]), (f[at + 2] - f[at + 1]) / (x[at + 2] - right)
            meet = left + (f[at + 1] - f[at] - fall * (right - left)) / (rise - fall) if rise != fall else left
            if left < meet < right:
                reach = (right - left) * max(min(4.0 / math.sqrt(excess[panel]), 0.5), 0.1)
                left, right = max(left, meet - reach), min(right, meet + reach)
        places[count], places[count + 1] = left, right
        count += 2
    return places[:count]
