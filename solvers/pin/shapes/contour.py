"""A curve known at the stations as few cubics: what a drawing or a solid is made from.

Between the places where it bends, a diameter that a design found is a smooth function of the place. Over each panel it
is the polynomial of degree 8 through Lobatto's nodes; here cubics with its values and slopes at their ends replace it,
each as long as it stays within the tolerance at every node it spans. Where no cubic does, in the narrow panels that
hold a kink or a step, straight lines from node to node follow the curve.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from solvers.pin.stations.lobatto_panels import NODE_PLACES, NODE_WEIGHTS, NODES, Stations

Array = NDArray[np.float64]
_TOLERANCE = 1e-7
"""Of the greatest diameter: 2 nm of a pin of 20 mm."""
_SAME = 1e-9
"""Of the length: places that no tool tells apart."""

_MOST_HALVINGS = 5
_BETWEEN = np.linspace(0.0, 1.0, 9)


@dataclass(frozen=True)
class Cubic:
    """A diameter over [start, end]: the cubic polynomial with these values [m] and slopes at its ends, x in m."""

    start: float
    end: float
    first: float
    last: float
    slope_first: float
    slope_last: float

    def at(self, x: Array) -> Array:
        """The diameter at places between the ends; same shape (Hermite's form)."""
        width = self.end - self.start
        t = (x - self.start) / width
        s = 1.0 - t
        from_values = self.first * s * s * (1.0 + 2.0 * t) + self.last * t * t * (1.0 + 2.0 * s)
        return from_values + width * t * s * (self.slope_first * s - self.slope_last * t)


@cache
def _differences() -> Array:
    """Slopes at the nodes on [-1, 1] of the polynomial through the values there: (9, 9), barycentric."""
    apart = NODE_PLACES[:, None] - NODE_PLACES
    np.fill_diagonal(apart, 1.0)
    table = NODE_WEIGHTS / NODE_WEIGHTS[:, None] / apart
    np.fill_diagonal(table, 0.0)
    np.fill_diagonal(table, -table.sum(axis=1))
    return table


def contour(stations: Stations, diameters: Array, length: float) -> tuple[Cubic, ...]:
    """The diameters [m] at the stations as cubics over the whole bar, in order.

    Stations up to the middle stand for both halves. Two cubics that meet may differ in slope, a kink, and in value, a
    step. At every station further than 1e-9 of the length from a step they are within 1e-7 of the greatest diameter.
    """
    tolerance = _TOLERANCE * float(np.max(diameters))
    kept = stations.width > _SAME * length
    x = stations.x.reshape(-1, NODES)[kept]
    values = np.asarray(diameters, float).reshape(-1, NODES)[kept]
    slopes = 2.0 / stations.width[kept, None] * (values @ _differences().T)
    pieces: list[Cubic] = []
    begin = 0
    while begin < len(x):
        piece, end = _longest(x, values, slopes, begin, tolerance)
        if piece is None:
            pieces += _divided(x[begin], values[begin], tolerance) or _lines(x[begin], values[begin], tolerance)
        else:
            pieces.append(piece)
        begin = end
    # Panels too narrow to keep left gaps, which are steps.
    closed = [
        Cubic(before.end if before else 0.0, p.end, p.first, p.last, p.slope_first, p.slope_last)
        for before, p in zip([None, *pieces[:-1]], pieces, strict=True)
    ]
    if stations.right[-1] <= 0.5 * length * (1.0 + 1e-9):
        middle = 0.5 * length
        half = [Cubic(p.start, min(p.end, middle), p.first, p.last, p.slope_first, p.slope_last) for p in closed[:-1]]
        p = closed[-1]
        half.append(Cubic(p.start, middle, p.first, p.last, p.slope_first, p.slope_last))
        other = [
            Cubic(length - p.end, length - p.start, p.last, p.first, -p.slope_last, -p.slope_first)
            for p in reversed(half)
        ]
        return (*half, *other)
    return tuple(closed)


def _longest(x: Array, values: Array, slopes: Array, begin: int, tolerance: float) -> tuple[Cubic | None, int]:
    """The longest cubic from a panel's left end that keeps the tolerance, and the panel behind it."""
    best, end, stride = None, begin + 1, 1
    while begin + stride <= len(x):
        last = begin + stride - 1
        piece = Cubic(
            float(x[begin, 0]), float(x[last, -1]), float(values[begin, 0]), float(values[last, -1]),
            float(slopes[begin, 0]), float(slopes[last, -1]),
        )  # fmt: skip
        off = np.abs(piece.at(x[begin : last + 1]) - values[begin : last + 1])
        if not off.max() <= tolerance:
            break
        best, end = piece, last + 1
        stride += 1
    return best, end


def _divided(x: Array, values: Array, tolerance: float) -> list[Cubic] | None:
    """A panel's polynomial as cubics over halves of halves; None where that does not end soon."""
    shape = Polynomial.fit(x, values, NODES - 1, domain=(x[0], x[-1]))
    slope = shape.deriv()
    found: list[Cubic] = []
    left = [(float(x[0]), float(x[-1]), _MOST_HALVINGS)]
    while left:
        a, b, halvings = left.pop()
        piece = Cubic(a, b, float(shape(a)), float(shape(b)), float(slope(a)), float(slope(b)))
        between = a + (b - a) * _BETWEEN
        if np.abs(piece.at(between) - shape(between)).max() <= tolerance:
            found.append(piece)
        elif halvings:
            middle = 0.5 * (a + b)
            left += [(middle, b, halvings - 1), (a, middle, halvings - 1)]
        else:
            return None
    return found


def _lines(x: Array, values: Array, tolerance: float) -> list[Cubic]:
    """A panel that no cubic follows: straight from node to node, over nodes that lie on one line."""
    found, begin = [], 0
    while begin < NODES - 1:
        end = begin + 1
        for far in range(begin + 2, NODES):
            between = np.interp(x[begin:far], x[[begin, far]], values[[begin, far]])
            if not np.abs(between - values[begin:far]).max() <= tolerance:
                break
            end = far
        slope = float((values[end] - values[begin]) / (x[end] - x[begin]))
        found.append(Cubic(float(x[begin]), float(x[end]), float(values[begin]), float(values[end]), slope, slope))
        begin = end
    return found
