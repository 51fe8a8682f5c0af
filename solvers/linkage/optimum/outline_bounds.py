"""Bounds of swept outlines over ranges of the free ratio, from both ends.

Between the ends of a range the extents of an outline's parts lie above their interpolation, linear in y
(``load_bounds``), up to deductions that decrease by the square of the range's width. With s = g - 1, per V:

    l1 = s y/w = sigma s (1 - g^2/w),  l2 = g^2 s/w,  l3 = s/n,  l0 = n_0 - sigma l3,  n_0 = sigma |N| l1 constant,
    away = 2 g^2 s n/w^2,  rise = 2 g s sqrt((g^2 - 1) m)/w^2

A function f of y lies below its chord by at most (sqrt(f1) - sqrt(f2))^2 if f ~ 1/x with x linear in y, and by
max|f''| (y1 - y2)^2/8 in general. The arc's extent is n_0 cos(beta) + l3 (1 - sigma cos(beta)). Where its swing is
smaller than in the middle of the range by d, so that the arc ends before the direction in question, the extent of its
end is less than that of the arc by at most l3 (1 - cos(d)). If sizes are those of a given crank instead of a given V,
the same holds for another weight between the ends, as the crank per V is l1.

With directions n_i and weights w_i >= 0, the sum of which is 1, a circle of radius R about c around an outline with
support function h (see ``outline``) satisfies

    R >= sum w_i (h(n_i) - c.n_i) >= sum w_i h(n_i) - R |sum w_i n_i|,

the latter because the crank's pivot, the origin, lies within it; and h is at least the support function of any of the
outline's parts. With the directions, weights and parts at which the circle of the member in the middle touches, the sum
is that circle's radius there.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.linkage.swept_area.enclosing_circle import smallest_circle
from solvers.linkage.swept_area.outline import part_extent, touched_part
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel


@kernel
def interpolation_deductions(
    rows: Array, high_rows: Array, lengths: Array, high_lengths: Array, swings: Array, gain: float
) -> Array:
    """Deductions per V as in ``minimum_boxes``, shape (n, 5), from the coefficients (``kinematics``), (n, 7), and the
    lengths per V, (n, 4), at both ends of each range, and from d [rad], ``swings``, (n,)."""
    out, square = np.empty((swings.size, 5)), gain * gain
    for i in range(swings.size):
        a, b = rows[i], high_rows[i]
        y, y_other, n, n_other = a[0] / a[2], b[0] / b[2], abs(a[3]) / a[2], abs(b[3]) / b[2]
        m, least_m = max(a[4] / a[2] ** 2, b[4] / b[2] ** 2), min(a[4] / a[2] ** 2, b[4] / b[2] ** 2)
        w, least_w = max(a[0] * n, b[0] * n_other), min(a[0] * n, b[0] * n_other)
        out[i, 0] = (math.sqrt(lengths[i, 2]) - math.sqrt(high_lengths[i, 2])) ** 2
        out[i, 1] = (math.sqrt(lengths[i, 3]) - math.sqrt(high_lengths[i, 3])) ** 2
        out[i, 2] = 2.0 * max(lengths[i, 3], high_lengths[i, 3]) * math.sin(0.5 * swings[i]) ** 2
        # At least |f''| of n/w^2 and sqrt(m)/w^2.
        away = (4.0 * w + 6.0 * max(n, n_other)) / least_w**4
        rise = 6.0 / least_w**2 + 4.0 * max(y, y_other) / (least_m * least_w) + square / least_m**2
        rise *= math.sqrt((square - 1.0) * m) / least_w**2
        out[i, 3:] = 0.25 * gain * (gain - 1.0) * (y - y_other) ** 2 * np.array([gain * away, rise])
    return out * (1.0 + 1e-9)


@kernel
def radius_lower_bounds(
    within: Array, low: Array, high: Array, deductions: Array, size: Array, high_size: Array
) -> Array:
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
        out[i] = max(min(at_low * size[i], at_high * high_size[i]), 0.0) / (1.0 + math.hypot(x, y))
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
