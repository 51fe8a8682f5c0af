"""The two directions of taper of a cone: bore greatest at the pin's end, or in the middle.

A shape is its direction, 1 if the bore narrows toward the middle and -1 if it widens, r, the ratio of its narrowest
to its widest bore, and c, the fraction of the half that the cone occupies. At the fraction t of the half the bore
relative to its maximum is f = 1 - (1 - r) p(t, c), with p the taper fraction: min(t/c, 1) if it narrows, 1 - min(t/c,
1) if it widens. Both f and the relative volume h increase with r. For a cone that narrows toward the middle they
increase with c, for one that widens they decrease with c.
"""

from __future__ import annotations

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel

NARROWING, WIDENING = 1, -1
"""Directions: the sign of df/dc."""


@kernel
def taper_fraction(direction: int, c: float, t: float) -> float:
    """Return p at position t."""
    along = min(t / c, 1.0)
    return along if direction > 0 else 1.0 - along


@kernel
def relative_bore(direction: int, r: float, c: float, t: float) -> float:
    """Return f at position t."""
    return 1.0 - (1.0 - r) * taper_fraction(direction, c, t)


@kernel
def relative_bores(direction: int, r: float, c: float, t: Array) -> Array:
    """Return f at positions t, (n,)."""
    out = np.empty(t.size)
    for i in range(t.size):
        out[i] = relative_bore(direction, r, c, t[i])
    return out


@kernel
def unit_volume(direction: int, r: float, c: float) -> float:
    """Return h: volume of a bore of maximum diameter 1 relative to the cylinder of diameter 1.

    Narrowing c (1 + r + r^2)/3 + (1 - c) r^2, widening c (1 + r + r^2)/3 + 1 - c.
    """
    if direction > 0:
        return c * (1.0 + r + r * r) / 3.0 + (1.0 - c) * r * r
    return 1.0 - c * (1.0 - r) * (2.0 + r) / 3.0


@kernel
def unit_volume_slopes(direction: int, r0: float, r1: float, c0: float, c1: float) -> tuple[float, float, float, float]:
    """Return the ranges of d(ln h)/dr and d(ln h)/dc over a box of shapes."""
    c_narrow, c_wide = (c0, c1) if direction > 0 else (c1, c0)
    low, high = unit_volume(direction, r0, c_narrow), unit_volume(direction, r1, c_wide)
    if direction < 0:
        greatest, least = (1.0 - r0) * (2.0 + r0) / 3.0, (1.0 - r1) * (2.0 + r1) / 3.0
        return c0 * (1.0 + 2.0 * r0) / 3.0 / high, c1 * (1.0 + 2.0 * r1) / 3.0 / low, -greatest / low, -least / high
    least_r = min(
        c0 * (1.0 + 2.0 * r0) / 3.0 + 2.0 * (1.0 - c0) * r0, c1 * (1.0 + 2.0 * r0) / 3.0 + 2.0 * (1.0 - c1) * r0
    )
    most_r = max(
        c0 * (1.0 + 2.0 * r1) / 3.0 + 2.0 * (1.0 - c0) * r1, c1 * (1.0 + 2.0 * r1) / 3.0 + 2.0 * (1.0 - c1) * r1
    )
    # (1 - r)(1 + 2 r)/3 is greatest at r = 1/4.
    top = min(max(0.25, r0), r1)
    least_c = min((1.0 - r0) * (1.0 + 2.0 * r0), (1.0 - r1) * (1.0 + 2.0 * r1)) / 3.0
    return least_r / high, most_r / low, least_c / high, (1.0 - top) * (1.0 + 2.0 * top) / 3.0 / low
