"""Arithmetic of intervals over arrays: every result holds all values that the operands could give.

Ends are not rounded outward: what is proven by them is proven up to rounding, a few parts in 1e16 an operation.
Source: R. E. Moore, Interval Analysis, 1966.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Interval:
    """[low, high], arrays of one shape with low <= high."""

    low: Array
    high: Array

    __array_ufunc__ = None
    """Array operators leave mixed operations to this class."""

    def __neg__(self) -> Interval:
        return Interval(-self.high, -self.low)

    def __add__(self, other: Interval | Array | float) -> Interval:
        right = as_interval(other)
        return Interval(self.low + right.low, self.high + right.high)

    def __sub__(self, other: Interval | Array | float) -> Interval:
        right = as_interval(other)
        return Interval(self.low - right.high, self.high - right.low)

    def __mul__(self, other: Interval | Array | float) -> Interval:
        right = as_interval(other)
        products = (self.low * right.low, self.low * right.high, self.high * right.low, self.high * right.high)
        return Interval(np.minimum.reduce(products), np.maximum.reduce(products))

    def __truediv__(self, other: Interval | Array | float) -> Interval:
        right = as_interval(other)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = Interval(1.0 / right.high, 1.0 / right.low)
        out = self * inverse
        through = (right.low <= 0) & (right.high >= 0)
        return Interval(np.where(through, -np.inf, out.low), np.where(through, np.inf, out.high))

    def __radd__(self, other: Array | float) -> Interval:
        return self + other

    def __rmul__(self, other: Array | float) -> Interval:
        return self * other

    def __rsub__(self, other: Array | float) -> Interval:
        return as_interval(other) - self

    def __rtruediv__(self, other: Array | float) -> Interval:
        return as_interval(other) / self

    def square(self) -> Interval:
        """x^2, without the width of x times x."""
        size = self.magnitude()
        return Interval(size.low**2, size.high**2)

    def root(self) -> Interval:
        """The square root; what lies below 0 counts as 0."""
        return Interval(np.sqrt(np.maximum(self.low, 0.0)), np.sqrt(np.maximum(self.high, 0.0)))

    def magnitude(self) -> Interval:
        """|x|."""
        through = (self.low <= 0) & (self.high >= 0)
        ends = np.abs(self.low), np.abs(self.high)
        return Interval(np.where(through, 0.0, np.minimum(*ends)), np.maximum(*ends))


def as_interval(value: Interval | Array | float) -> Interval:
    """A number or an array as intervals without width."""
    if isinstance(value, Interval):
        return value
    array = np.asarray(value, float)
    return Interval(array, array)
