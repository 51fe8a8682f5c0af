"""Interval arithmetic with derivatives for kernels: enclosures of a function's values and slopes over a range.

An ``Enclosure`` consists of the value at a point of the range, an interval of values, and an interval of slopes. By the
mean value theorem f(x) also lies in f(m) + f'(range) (x - m), which is sharper than interval arithmetic on small
ranges; every operation intersects both. The overestimation thus decreases quadratically with the range. Interval ends
are not rounded outward: proofs hold up to rounding, a few parts in 1e16 per operation. Source: R. E. Moore, Interval
Analysis, 1966.
"""

from __future__ import annotations

import math

from solvers.numerics.jit import kernel

Enclosure = tuple[float, float, float, float, float]
"""Value at the point, minimum and maximum value, minimum and maximum slope."""

Extent = tuple[float, float]
"""Extent of the range to the left and right of the point."""


@kernel
def scaled(a: Enclosure, factor: float) -> Enclosure:
    """a times a constant."""
    if factor < 0.0:
        return a[0] * factor, a[2] * factor, a[1] * factor, a[4] * factor, a[3] * factor
    return a[0] * factor, a[1] * factor, a[2] * factor, a[3] * factor, a[4] * factor


@kernel
def shifted(a: Enclosure, more: float) -> Enclosure:
    """a + a constant."""
    return a[0] + more, a[1] + more, a[2] + more, a[3], a[4]


@kernel
def add(a: Enclosure, b: Enclosure, extent: Extent) -> Enclosure:
    """a + b."""
    return _intersected(a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], extent)


@kernel
def multiply(a: Enclosure, b: Enclosure, extent: Extent) -> Enclosure:
    """a b."""
    low, high = _product(a[1], a[2], b[1], b[2])
    left_low, left_high = _product(a[3], a[4], b[1], b[2])
    right_low, right_high = _product(a[1], a[2], b[3], b[4])
    return _intersected(a[0] * b[0], low, high, left_low + right_low, left_high + right_high, extent)


@kernel
def divide(a: Enclosure, b: Enclosure, extent: Extent) -> Enclosure:
    """a/b for b > 0."""
    inverse_low, inverse_high = 1.0 / b[2], 1.0 / b[1]
    low, high = _product(a[1], a[2], inverse_low, inverse_high)
    part_low, part_high = _product(low, high, b[3], b[4])
    slope, slope_high = _product(a[3] - part_high, a[4] - part_low, inverse_low, inverse_high)
    return _intersected(a[0] / b[0], low, high, slope, slope_high, extent)


@kernel
def squared(a: Enclosure, extent: Extent) -> Enclosure:
    """a^2, sharper than a times a."""
    least, most = min(abs(a[1]), abs(a[2])), max(abs(a[1]), abs(a[2]))
    if a[1] <= 0.0 <= a[2]:
        least = 0.0
    slope, slope_high = _product(2.0 * a[1], 2.0 * a[2], a[3], a[4])
    return _intersected(a[0] * a[0], least * least, most * most, slope, slope_high, extent)


@kernel
def square_root(a: Enclosure, extent: Extent) -> Enclosure:
    """sqrt(a) for a > 0."""
    low, high = math.sqrt(a[1]), math.sqrt(a[2])
    slope, slope_high = _product(a[3], a[4], 0.5 / high, 0.5 / low)
    return _intersected(math.sqrt(a[0]), low, high, slope, slope_high, extent)


@kernel
def _product(a: float, a_high: float, b: float, b_high: float) -> tuple[float, float]:
    one, two, three, four = a * b, a * b_high, a_high * b, a_high * b_high
    return min(min(one, two), min(three, four)), max(max(one, two), max(three, four))


@kernel
def _intersected(place: float, low: float, high: float, slope: float, slope_high: float, extent: Extent) -> Enclosure:
    """Enclosure from interval arithmetic, its values intersected with those of the mean value form."""
    down = max(max(slope_high, 0.0) * extent[0], max(-slope, 0.0) * extent[1])
    up = max(max(-slope, 0.0) * extent[0], max(slope_high, 0.0) * extent[1])
    return place, max(low, place - down), min(high, place + up), slope, slope_high
