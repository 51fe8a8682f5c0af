"""Cubics through values and slopes (Hermite's form), each as long as it stays within a tolerance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel

F = TypeVar("F", float, Array)


@dataclass(frozen=True)
class Cubic:
    """The cubic polynomial with these values and slopes at the ends of [start, end]."""

    start: float
    end: float
    first: float
    last: float
    slope_first: float
    slope_last: float

    def at(self, x: F) -> F:
        """Return the value at a position, or an array of positions, between the ends."""
        width = self.end - self.start
        t = (x - self.start) / width
        s = 1.0 - t
        from_values = self.first * s * s * (1.0 + 2.0 * t) + self.last * t * t * (1.0 + 2.0 * s)
        return from_values + width * t * s * (self.slope_first * s - self.slope_last * t)

    def bends(self) -> Array:
        """Return the second derivatives at both ends, between which they are linear, (2, ...)."""
        width, rise, fall = self.end - self.start, self.slope_first, self.slope_last
        chord = (self.last - self.first) / width
        return np.stack([6.0 * chord - 4.0 * rise - 2.0 * fall, 2.0 * rise + 4.0 * fall - 6.0 * chord]) / width


def divided(start: Array, end: Array, count: Array) -> tuple[Array, NDArray[np.int64]]:
    """Return the ends of ``count`` equal parts of each interval, in order, and the indices of their intervals."""
    of = np.repeat(np.arange(count.size), count.astype(int) + 1)
    k = np.arange(of.size) - (np.cumsum(count + 1) - count - 1)[of]
    return start[of] + (end - start)[of] * (k / count[of]), of


@kernel
def _fits(x: Array, d: Array, slopes: Array, tolerance: Array, steepest: float, i: int, j: int) -> bool:
    """Return whether the cubic from node i to j is within the tolerance at the nodes between, and not too steep."""
    width, rise, fall = x[j] - x[i], slopes[i], slopes[j]
    for k in range(i + 1, j):
        t = (x[k] - x[i]) / width
        s = 1.0 - t
        value = d[i] * s * s * (1.0 + 2.0 * t) + d[j] * t * t * (1.0 + 2.0 * s) + width * t * s * (rise * s - fall * t)
        if not abs(value - d[k]) <= tolerance[k]:
            return False
    # The slope is quadratic: its extreme is at an end or, inside, at the vertex.
    chord, bend = (d[j] - d[i]) / width, rise + fall - 2.0 * (d[j] - d[i]) / width
    most = max(abs(rise), abs(fall))
    if bend != 0.0:
        t = (2.0 * rise + fall - 3.0 * chord) / (3.0 * bend)
        if 0.0 < t < 1.0:
            most = max(
                most, abs(rise * (1.0 - t) * (1.0 - 3.0 * t) + fall * t * (3.0 * t - 2.0) + 6.0 * chord * t * (1.0 - t))
            )
    return most <= steepest


@kernel
def longest_cubics(
    x: Array, d: Array, slopes: Array, smooth: Array, tolerance: Array, steepest: float, nodes: int
) -> Array:
    """Return the longest cubics, rows of the fields of ``Cubic``, through values d with these slopes at positions x, in
    panels of ``nodes`` each.

    They are within the ``tolerance`` (n,) at the nodes they span, and not steeper than ``steepest``. They begin and end
    at nodes of ``smooth`` (panels,) panels or span whole ones; otherwise they are straight from node to node.
    """
    out, count, i = np.empty((x.size, 6)), 0, 0
    while i < x.size:
        panel, end, straight = i // nodes, i + 1, True
        if i % nodes == nodes - 1:
            i += 1
            continue
        j = (panel + 1) * nodes - 1 if smooth[panel] or i % nodes == 0 else x.size
        while j < x.size and _fits(x, d, slopes, tolerance, steepest, i, j):
            end, straight, j = j, False, j + nodes
        if j < x.size and smooth[panel] and smooth[j // nodes]:
            k = max(i + 1, j - nodes + 2)
            while k < j and _fits(x, d, slopes, tolerance, steepest, i, k):
                end, straight, k = k, False, k + 1
        rise = (d[end] - d[i]) / (x[end] - x[i])
        out[count, 0], out[count, 1], out[count, 2], out[count, 3] = x[i], x[end], d[i], d[end]
        out[count, 4], out[count, 5] = (rise, rise) if straight else (slopes[i], slopes[end])
        count, i = count + 1, end
    return out[:count]
