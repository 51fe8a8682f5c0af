"""Lower bounds of peak loads over ranges of the free ratio.

A peak over the cycle is at least the load at any one crank angle, so a lower bound of the load at one angle bounds the
peak. The bound is sharpest near the peak angle of a member within the range.

Given g all ratios of lengths are functions of y = lambda0/lambda3 = g^2/lambda2, which decreases with the free ratio
in every type. With sigma as in ``angular_velocity_ratio``:

    n = |y + sigma| = |N|/lambda3,   w = g^2 + sigma y = n lambda0,   m = g^2 - y^2 = M/lambda3^2

In lengths in rockers y is the only variable in the formulas of ``angular_velocity_ratio`` and ``torque_and_pin_force``.
In magnitudes, with n in place of N, m in place of M, and n e = g^2 - 1:

    t^2 = g^2 c^2 + m s^2,  d = c + t,  a = t + g^2 c,  h = t - sigma y c,  b = d^2 + n^2 s^2
    X = n Y/(t^2 b),  Y = a h^2/b - g^2 m/(2 t)
    torque/E = 2 s (g - 1)^2 a Y/(t^3 b^2),  force V/E = (g - 1) g^2 Y/(y t^3 b)

and likewise the forms for c < 0. V is the scale of ``family``: the force at a given impact speed.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.linkage.loads.torque_and_pin_force import TORQUE, refined_peak, sampled_loads
from solvers.numerics.arrays import Array
from solvers.numerics.intervals import Enclosure, Extent, add, divide, multiply, scaled, shifted, square_root, squared
from solvers.numerics.jit import kernel

_MAX_LOCATED = 128
"""Maximum number of ranges with a crank angle of their own; of more ranges, neighbours share one."""


@kernel
def load_lower_bounds(
    low: Array, rows: Array, high: Array, u31_end: Array, gain: float, quantity: int, each: bool
) -> Array:
    """Lower bounds of torque/E (0) or force V/E (1) over ranges of the free ratio, shape (n,).

    ``low``, ``rows`` and ``high`` are the coefficients of the members at the low end, within and at the high end of
    each range, (n, 7) each; ``u31_end`` is |u31(2 pi)| of those within. With a crank angle for ``each``, bounds over
    single members are their peaks.
    """
    out, angle = np.empty(rows.shape[0]), 0.0
    for i in range(out.size):
        if each or i % (1 + out.size // _MAX_LOCATED) == 0:
            cotangents, samples = sampled_loads(rows[i], u31_end[i])
            _, angle = refined_peak(rows[i], u31_end[i], cotangents, samples[quantity], quantity)
        out[i] = _load_lower_bound(
            low[i], rows[i], high[i], gain, quantity, -math.sin(0.5 * angle), -math.cos(0.5 * angle)
        )
    return out


@kernel
def _load_lower_bound(low: Array, row: Array, high: Array, gain: float, quantity: int, s: float, c: float) -> float:
    """Lower bound over one range at a crank angle, given sine and cosine of its half; 0 if none can be proven."""
    y, n, m, extent = _ratios(low, row, high, gain)
    sigma, square, cc, ss = row[6], gain * gain, c * c, s * s
    margin_term = scaled(m, ss)
    root_square = shifted(margin_term, square * cc)
    if not root_square[1] > 0.0:
        return 0.0
    t = square_root(root_square, extent)
    if c >= 0.0:
        d, a = shifted(t, c), shifted(t, square * c)
    else:
        d = divide(shifted(margin_term, (square - 1.0) * cc), shifted(t, -c), extent)
        a = divide(shifted(margin_term, -square * (square - 1.0) * cc), shifted(t, -square * c), extent)
    along = scaled(y, abs(c))
    h = divide(m, add(t, along, extent), extent) if sigma * c > 0.0 else add(t, along, extent)
    b = add(squared(d, extent), scaled(squared(n, extent), ss), extent)
    if not b[1] > 0.0:
        return 0.0
    first = divide(multiply(a, squared(h, extent), extent), b, extent)
    numerator = add(first, scaled(divide(m, t, extent), -0.5 * square), extent)
    factor = divide(numerator, multiply(multiply(root_square, t, extent), b, extent), extent)
    if quantity == TORQUE:
        load, scale = divide(multiply(factor, a, extent), b, extent), 2.0 * s * (gain - 1.0) ** 2
    else:
        load, scale = divide(factor, y, extent), (gain - 1.0) * square
    return scale * max(load[1], -load[2], 0.0)


@kernel
def _ratios(low: Array, row: Array, high: Array, gain: float) -> tuple[Enclosure, Enclosure, Enclosure, Extent]:
    """y, n and m over a range of the free ratio, and its extent in y."""
    y_low, n_low, gap_low = _of_member(high, gain)
    y_mid, n_mid, gap_mid = _of_member(row, gain)
    y_high, n_high, gap_high = _of_member(low, gain)
    # The same distance three times, which differ by rounding.
    extent = (
        max(y_mid - y_low, max(abs(n_mid - n_low), gap_low - gap_mid)),
        max(y_high - y_mid, max(abs(n_high - n_mid), gap_mid - gap_high)),
    )
    y, rising = (y_mid, y_low, y_high, 1.0, 1.0), 1.0 if n_high >= n_low else -1.0
    n = (n_mid, min(n_low, n_high), max(n_low, n_high), rising, rising)
    gap = (gap_mid, gap_high, gap_low, -1.0, -1.0)
    return y, n, multiply(gap, shifted(y, gain), extent), extent


@kernel
def _of_member(row: Array, gain: float) -> tuple[float, float, float]:
    """y, n and g - y of a member, each without cancellation where it is small."""
    y = row[0] / row[2]
    return y, abs(row[3]) / row[2], row[4] / (row[2] * row[2] * (gain + y))
