"""Lower bounds of the enclosing radius over ranges of the free ratio.

With directions n_i and weights w_i >= 0, the sum of which is 1, a circle of radius R about c around an outline with
support function h (see ``outline``) satisfies

    R >= sum w_i (h(n_i) - c.n_i) >= sum w_i h(n_i) - R |sum w_i n_i|,

the latter because the crank's pivot, the origin, lies within it; and h is at least the support function of any of the
outline's parts. With the directions, weights and parts at which the circle of the member in the middle touches, the sum
is that circle's radius there. Between the ends of the range it lies above its linear interpolation less deductions
(``quantities``), which decrease by the square of the range's width.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.linkage.swept_area.enclosing_circle import smallest_circle
from solvers.linkage.swept_area.outline import part_extent, touched_part
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel


@kernel
def radius_lower_bounds(within: Array, low: Array, high: Array, deductions: Array) -> Array:
    """Lower bounds of the enclosing radius over ranges of outlines, shape (n,); arguments as in ``minimum_boxes``."""
    out = np.empty(low.shape[0])
    for i in range(out.size):
        x, y, at_low, at_high = 0.0, 0.0, 0.0, 0.0
        for cos, sin, weight in _contact_directions(within[i]):
            part = touched_part(within[i], math.atan2(sin, cos), cos, sin)
            constant, along, across = part_extent(low[i], deductions[i], part, cos, sin)
            at_low += weight * (constant + along * cos + across * sin)
            constant, along, across = part_extent(high[i], deductions[i], part, cos, sin)
            at_high += weight * (constant + along * cos + across * sin)
            x, y = x + weight * cos, y + weight * sin
        out[i] = max(min(at_low, at_high), 0.0) / (1.0 + math.hypot(x, y))
    return out


@kernel
def _contact_directions(outline: Array) -> Array:
    """Contacts of the smallest circle: cosine and sine of their directions from its centre, and weights; (k, 3)."""
    _, x, y, parts = smallest_circle(outline)
    count = parts.shape[0]
    out = np.empty((count, 3))
    for k in range(count):
        distance = math.hypot(parts[k, 0] - x, parts[k, 1] - y)
        if distance == 0.0:
            # The crank's circle is itself the smallest.
            return np.array([[1.0, 0.0, 0.5], [-1.0, 0.0, 0.5]])
        out[k, 0], out[k, 1], out[k, 2] = (parts[k, 0] - x) / distance, (parts[k, 1] - y) / distance, 0.5
    if count == 3:
        for k in range(3):
            first, second = out[(k + 1) % 3], out[(k + 2) % 3]
            out[k, 2] = abs(first[0] * second[1] - first[1] * second[0])
        out[:, 2] /= max(out[0, 2] + out[1, 2] + out[2, 2], 1e-300)
    return out
