"""Reference for monotone cubic interpolation: Hermite form, in the numbers of any mpmath context."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from typing import Any

import mpmath as mp

from solvers.references.searching import Number


def hermite_slopes(x: Sequence[Number], y: Sequence[Number], closed: bool, numbers: Any = mp) -> list[Number]:
    """Slopes of the monotone cubic of F. N. Fritsch and J. Butland (1984); at the ends Moler's three-point formula."""
    n, sign = len(x), numbers.sign
    width = [x[i + 1] - x[i] for i in range(n - 1)]
    rise = [(y[i + 1] - y[i]) / width[i] for i in range(n - 1)]

    def inner(h0, h1, d0, d1):
        if d0 * d1 <= 0:
            return numbers.mpf(0)
        w0, w1 = 2 * h1 + h0, h1 + 2 * h0
        return (w0 + w1) / (w0 / d0 + w1 / d1)

    def end(h0, h1, d0, d1):
        slope = ((2 * h0 + h1) * d0 - h0 * d1) / (h0 + h1)
        if sign(slope) != sign(d0):
            return numbers.mpf(0)
        return 3 * d0 if sign(d0) != sign(d1) and abs(slope) > 3 * abs(d0) else slope

    middle = [inner(width[i - 1], width[i], rise[i - 1], rise[i]) for i in range(1, n - 1)]
    if closed:
        edge = inner(width[-1], width[0], rise[-1], rise[0])
        return [edge, *middle, edge]
    if n == 2:
        return [rise[0], rise[0]]
    return [end(width[0], width[1], rise[0], rise[1]), *middle, end(width[-1], width[-2], rise[-1], rise[-2])]


class Cubic:
    """A piecewise cubic with derivative and antiderivative; constant outside its range."""

    def __init__(self, x, y, closed=False, numbers=mp) -> None:
        self.x, self.y, self.m, self.zero = x, y, hermite_slopes(x, y, closed, numbers), numbers.mpf(0)
        self.area = [self.zero]
        for i in range(len(x) - 1):
            self.area.append(self.area[-1] + self._part(i, numbers.mpf(1)))

    def _part(self, i, t):
        h, y0, y1, m0, m1 = self._piece(i)
        return h * (y0 * (t - t**3 + t**4 / 2) + m0 * (t**2 / 2 - 2 * t**3 / 3 + t**4 / 4)
                    + y1 * (t**3 - t**4 / 2) + m1 * (t**4 / 4 - t**3 / 3))  # fmt: skip

    def _piece(self, i):
        h = self.x[i + 1] - self.x[i]
        return h, self.y[i], self.y[i + 1], h * self.m[i], h * self.m[i + 1]

    def at(self, x):
        """Value, slope, and the integral from the first point."""
        if x <= self.x[0]:
            return self.y[0], self.zero, self.y[0] * (x - self.x[0])
        if x >= self.x[-1]:
            return self.y[-1], self.zero, self.area[-1] + self.y[-1] * (x - self.x[-1])
        i = bisect_right(self.x, x) - 1
        h, y0, y1, m0, m1 = self._piece(i)
        t = (x - self.x[i]) / h
        value = (1 + 2 * t) * (1 - t) ** 2 * y0 + t * (1 - t) ** 2 * m0 + t**2 * (3 - 2 * t) * y1 + t**2 * (t - 1) * m1
        slope = 6 * t * (t - 1) * (y0 - y1) + (1 - t) * (1 - 3 * t) * m0 + t * (3 * t - 2) * m1
        return value, slope / h, self.area[i] + self._part(i, t)
