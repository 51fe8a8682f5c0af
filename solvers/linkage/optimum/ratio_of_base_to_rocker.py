"""The variable in which bounds over ranges of the free ratio are formed: y = lambda0/lambda3 = g^2/lambda2.

It decreases with the free ratio in every type, and given g all ratios of lengths are functions of y. With sigma as in
``angular_velocity_ratio``:

    n = |y + sigma| = |N|/lambda3,   w = g^2 + sigma y = n lambda0,   m = g^2 - y^2 = M/lambda3^2
"""

from __future__ import annotations

from solvers.numerics.arrays import Array
from solvers.numerics.intervals import Enclosure, Extent, multiply, shifted
from solvers.numerics.jit import kernel


@kernel
def ratios(
    low: Array, row: Array, high: Array, gain: float
) -> tuple[Enclosure, Enclosure, Enclosure, Enclosure, Extent]:
    """y, n, w and m over a range of the free ratio, and its extent in y, from the coefficients of the members at its
    low end, within and at its high end."""
    y_low, n_low, w_low, gap_low = _of_member(high, gain)
    y_mid, n_mid, w_mid, gap_mid = _of_member(row, gain)
    y_high, n_high, w_high, gap_high = _of_member(low, gain)
    # The same distance three times, which differ by rounding.
    extent = (
        max(y_mid - y_low, max(abs(n_mid - n_low), gap_low - gap_mid)),
        max(y_high - y_mid, max(abs(n_high - n_mid), gap_mid - gap_high)),
    )
    y = (y_mid, y_low, y_high, 1.0, 1.0)
    rising = 1.0 if n_high >= n_low else -1.0
    n = (n_mid, min(n_low, n_high), max(n_low, n_high), rising, rising)
    w = (w_mid, min(w_low, w_high), max(w_low, w_high), row[6], row[6])
    gap = (gap_mid, gap_high, gap_low, -1.0, -1.0)
    return y, n, w, multiply(gap, shifted(y, gain), extent), extent


@kernel
def _of_member(row: Array, gain: float) -> tuple[float, float, float, float]:
    """y, n, w and g - y of a member, each without cancellation where it is small."""
    y, n = row[0] / row[2], abs(row[3]) / row[2]
    return y, n, row[0] * n, row[4] / (row[2] * row[2] * (gain + y))
