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
        if not isinstance(other, Interval):
            return Interval(self.low + other, self.high + other)
        return Interval(self.low + other.low, self.high + other.high)

    def __sub__(self, other: Interval | Array | float) -> Interval:
        right = as_interval(other)
        return Interval(self.low - right.high, self.high - right.low)

    def __mul__(self, other: Interval | Array | float) -> Interval:
        if not isinstance(other, Interval):
            ends = self.low * other, self.high * other
            return Interval(np.minimum(*ends), np.maximum(*ends))
        a, b = self.low * other.low, self.low * other.high
        c, d = self.high * other.low, self.high * other.high
        return Interval(np.minimum(np.minimum(a, b), np.minimum(c, d)), np.maximum(np.maximum(a, b), np.maximum(c, d)))

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


@dataclass(frozen=True, eq=False)
class Sloped:
    """A function of one variable over ranges of it: enclosures of its values and of its derivative.

    By the mean value theorem f(x) lies in f(m) + f'(range) (x - m), which is sharper than the values' own enclosure
    where the range is small: the width beyond the true range falls with the square of the range's.
    """

    value: Interval
    slope: Interval

    __array_ufunc__ = None

    def __neg__(self) -> Sloped:
        return Sloped(-self.value, -self.slope)

    def __add__(self, other: Sloped | Array | float) -> Sloped:
        if not isinstance(other, Sloped):
            return Sloped(self.value + other, self.slope)
        return Sloped(self.value + other.value, self.slope + other.slope)

    def __sub__(self, other: Sloped | Array | float) -> Sloped:
        return self + -other

    def __mul__(self, other: Sloped | Array | float) -> Sloped:
        if not isinstance(other, Sloped):
            return Sloped(self.value * other, self.slope * other)
        return Sloped(self.value * other.value, self.slope * other.value + self.value * other.slope)

    def __truediv__(self, other: Sloped | Array | float) -> Sloped:
        right = as_sloped(other)
        quotient = self.value / right.value
        return Sloped(quotient, (self.slope - quotient * right.slope) / right.value)

    def __radd__(self, other: Array | float) -> Sloped:
        return self + other

    def __rmul__(self, other: Array | float) -> Sloped:
        return self * other

    def __rsub__(self, other: Array | float) -> Sloped:
        return as_sloped(other) - self

    def __rtruediv__(self, other: Array | float) -> Sloped:
        return as_sloped(other) / self

    def square(self) -> Sloped:
        """f^2."""
        return Sloped(self.value.square(), 2.0 * self.value * self.slope)

    def root(self) -> Sloped:
        """sqrt(f)."""
        root = self.value.root()
        return Sloped(root, 0.5 * self.slope / root)

    def magnitude(self) -> Sloped:
        """|f|; its slope is that of f or of -f, either where the sign may change."""
        low, high = self.slope.low, self.slope.high
        positive, negative = self.value.low >= 0, self.value.high <= 0
        most = np.maximum(np.abs(low), np.abs(high))
        slope = Interval(
            np.where(positive, low, np.where(negative, -high, -most)),
            np.where(positive, high, np.where(negative, -low, most)),
        )
        return Sloped(self.value.magnitude(), slope)

    def least(self, middle: Array, half: Array) -> Array:
        """The greatest lower bound known over ranges of half width ``half``, given the values in their middles."""
        steepest = np.maximum(np.abs(self.slope.low), np.abs(self.slope.high))
        with np.errstate(invalid="ignore"):
            mean_value = np.nan_to_num(middle - steepest * half, nan=-np.inf, neginf=-np.inf)
        own = np.nan_to_num(self.value.low, nan=-np.inf, posinf=-np.inf, neginf=-np.inf)
        return np.maximum(mean_value, own)


def variable(low: Array, high: Array) -> Sloped:
    """The variable itself over ranges."""
    return Sloped(Interval(low, high), as_interval(np.ones_like(low)))


def as_sloped(value: Sloped | Array | float) -> Sloped:
    """A constant as a function."""
    if isinstance(value, Sloped):
        return value
    array = np.asarray(value, float)
    return Sloped(as_interval(array), as_interval(np.zeros_like(array)))
