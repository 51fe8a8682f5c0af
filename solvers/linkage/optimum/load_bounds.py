"""Lower bounds of peak loads over ranges of the free ratio.

A peak over the cycle is at least the load at any one crank angle, so a lower bound of the load at one angle bounds the
peak. The bound is sharpest near the peak angle of a member within the range.

In lengths in rockers, y (see ``ratio_of_base_to_rocker``) is the only variable in the formulas of
``angular_velocity_ratio`` and ``torque_and_pin_force``. In magnitudes, with n in place of N, m in place of M, and
n e = g^2 - 1:

    t^2 = g^2 c^2 + m s^2,  d = c + t,  a = t + g^2 c,  h = t - sigma y c,  b = d^2 + n^2 s^2
    X = n Y/(t^2 b),  Y = a h^2/b - g^2 m/(2 t)
    torque/E = 2 s (g - 1)^2 a Y/(t^3 b^2),  force V/E = (g - 1) g^2 Y/(y t^3 b)

and likewise the forms for c < 0. V is the scale of ``family``: the force at a given impact speed.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.linkage.loads.torque_and_pin_force import TORQUE, highest, sampled
from solvers.linkage.optimum.ratio_of_base_to_rocker import ratios
from solvers.numerics.arrays import Array
from solvers.numerics.intervals import minus, over, plus, raised, rooted, scaled, squared, times
from solvers.numerics.jit import kernel

_MOST_LOCATED = 128
"""Number of ranges, in ascending order, from which on neighbours share an angle."""


@kernel
def least_loads(low: Array, rows: Array, high: Array, end: Array, gain: float, which: int) -> Array:
    """Lower bounds of torque/E (0) or force V/E (1) over ranges of the free ratio, shape (n,).

    ``low``, ``rows`` and ``high`` are the coefficients of the members at the low end, within and at the high end of
    each range, (n, 7) each; ``end`` is |u31(2 pi)| of those within.
    """
    out, angle = np.empty(rows.shape[0]), 0.0
    for i in range(out.size):
        if i % (1 + out.size // _MOST_LOCATED) == 0:
            cotangents, samples = sampled(rows[i], end[i])
            _, angle = highest(rows[i], end[i], cotangents, samples[which], which)
        out[i] = _least_load(low[i], rows[i], high[i], gain, which, -math.sin(0.5 * angle), -math.cos(0.5 * angle))
    return out


@kernel
def _least_load(low: Array, row: Array, high: Array, gain: float, which: int, s: float, c: float) -> float:
    """The bound over one range at a half angle's sine and cosine; 0 if there is none."""
    y, n, _, m, reach = ratios(low, row, high, gain)
    sigma, square, cc, ss = row[6], gain * gain, c * c, s * s
    opened = scaled(m, ss)
    under = raised(opened, square * cc)
    if not under[1] > 0.0:
        return 0.0
    t = rooted(under, reach)
    if c >= 0.0:
        d, a = raised(t, c), raised(t, square * c)
    else:
        d = over(raised(opened, (square - 1.0) * cc), raised(t, -c), reach)
        a = over(raised(opened, -square * (square - 1.0) * cc), raised(t, -square * c), reach)
    along = scaled(y, abs(c))
    h = over(m, plus(t, along, reach), reach) if sigma * c > 0.0 else plus(t, along, reach)
    b = plus(squared(d, reach), scaled(squared(n, reach), ss), reach)
    if not b[1] > 0.0:
        return 0.0
    risen, falling = over(times(a, squared(h, reach), reach), b, reach), scaled(over(m, t, reach), 0.5 * square)
    part = over(minus(risen, falling, reach), times(times(under, t, reach), b, reach), reach)
    if which == TORQUE:
        load, scale = over(times(part, a, reach), b, reach), 2.0 * s * (gain - 1.0) ** 2
    else:
        load, scale = over(part, y, reach), (gain - 1.0) * square
    return scale * max(load[1], -load[2], 0.0)
