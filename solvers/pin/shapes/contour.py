"""Conversion of a curve given at the stations into a few cubics for drawings and solid models.

Between its kinks, a designed diameter is a smooth function of the position. Over each panel it is the polynomial of
degree 8 through the Lobatto nodes. It is replaced by cubic Hermite interpolants, each as long as it stays within the
tolerance at every node it spans. Where no cubic does, the polynomial is bisected; in panels with a kink or a step,
where it would oscillate, straight segments from node to node are used.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial import Chebyshev

from solvers.numerics.arrays import Array
from solvers.pin.stations.lobatto_panels import NODE_PLACES, NODE_WEIGHTS, NODES, Stations

_TOLERANCE = 1e-7
"""Relative to the greatest diameter: 2 nm for a pin of 20 mm."""
_POSITION_TOLERANCE = 1e-9
"""Relative to the length: positions closer than manufacturing can resolve."""

_UNRESOLVED = 1e-4
"""Last Chebyshev coefficients of a panel's polynomial, relative to the greatest, above which a kink is assumed."""
_MAX_BISECTIONS = 5
_SAMPLES = np.linspace(0.0, 1.0, 9)


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
        """Return the diameter at positions between the ends, in the same shape (Hermite's form)."""
        width = self.end - self.start
        t = (x - self.start) / width
        s = 1.0 - t
        from_values = self.first * s * s * (1.0 + 2.0 * t) + self.last * t * t * (1.0 + 2.0 * s)
        return from_values + width * t * s * (self.slope_first * s - self.slope_last * t)


@cache
def _differentiation_matrix() -> Array:
    """Return the barycentric differentiation matrix at the nodes on [-1, 1], (9, 9)."""
    differences = NODE_PLACES[:, None] - NODE_PLACES
    np.fill_diagonal(differences, 1.0)
    table = NODE_WEIGHTS / NODE_WEIGHTS[:, None] / differences
    np.fill_diagonal(table, 0.0)
    np.fill_diagonal(table, -table.sum(axis=1))
    return table


def contour(stations: Stations, diameters: Array, length: float) -> tuple[Cubic, ...]:
    """Return the diameters [m] at the stations as cubics over the whole bar, in order.

    Stations up to the middle represent both halves. Adjacent cubics may differ in slope, a kink, and in value, a
    step. At every station further than 1e-9 of the length from a step they are within 1e-7 of the greatest diameter.
    """
    tolerance = _TOLERANCE * float(np.max(diameters))
    kept = stations.width > _POSITION_TOLERANCE * length
    x = stations.x.reshape(-1, NODES)[kept]
    values = np.asarray(diameters, float).reshape(-1, NODES)[kept]
    slopes = 2.0 / stations.width[kept, None] * (values @ _differentiation_matrix().T)
    pieces: list[Cubic] = []
    begin = 0
    while begin < len(x):
        piece, end = _longest_cubic(x, values, slopes, begin, tolerance)
        if piece is None:
            pieces += _bisected(x[begin], values[begin], tolerance) or _lines(x[begin], values[begin], tolerance)
        else:
            pieces.append(piece)
        begin = end
    # Close the gaps of panels dropped as too narrow: they are steps.
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


def _longest_cubic(x: Array, values: Array, slopes: Array, begin: int, tolerance: float) -> tuple[Cubic | None, int]:
    """Return the longest cubic from a panel's left end within the tolerance, and the index of the next panel."""
    best, end, stride = None, begin + 1, 1
    while begin + stride <= len(x):
        last = begin + stride - 1
        piece = Cubic(
            float(x[begin, 0]), float(x[last, -1]), float(values[begin, 0]), float(values[last, -1]),
            float(slopes[begin, 0]), float(slopes[last, -1]),
        )  # fmt: skip
        error = np.abs(piece.at(x[begin : last + 1]) - values[begin : last + 1])
        if not error.max() <= tolerance:
            break
        best, end = piece, last + 1
        stride += 1
    return best, end


def _bisected(x: Array, values: Array, tolerance: float) -> list[Cubic] | None:
    """Split a panel's polynomial into cubics by repeated bisection; None if the maximum depth is exceeded, or if the
    polynomial oscillates about a kink, so that its last Chebyshev coefficients have not decayed."""
    series = Chebyshev.fit(x, values, NODES - 1, domain=(x[0], x[-1]))
    sizes = np.abs(series.coef[1:])
    if sizes[-2:].max() > _UNRESOLVED * sizes.max():
        return None
    slope = series.deriv()
    found: list[Cubic] = []
    left = [(float(x[0]), float(x[-1]), _MAX_BISECTIONS)]
    while left:
        a, b, halvings = left.pop()
        piece = Cubic(a, b, float(series(a)), float(series(b)), float(slope(a)), float(slope(b)))
        samples = a + (b - a) * _SAMPLES
        if np.abs(piece.at(samples) - series(samples)).max() <= tolerance:
            found.append(piece)
        elif halvings:
            middle = 0.5 * (a + b)
            left += [(middle, b, halvings - 1), (a, middle, halvings - 1)]
        else:
            return None
    return found


def _lines(x: Array, values: Array, tolerance: float) -> list[Cubic]:
    """Approximate a panel by straight segments between nodes, merging collinear ones."""
    found, begin = [], 0
    while begin < NODES - 1:
        end = begin + 1
        for far in range(begin + 2, NODES):
            samples = np.interp(x[begin:far], x[[begin, far]], values[[begin, far]])
            if not np.abs(samples - values[begin:far]).max() <= tolerance:
                break
            end = far
        slope = float((values[end] - values[begin]) / (x[end] - x[begin]))
        found.append(Cubic(float(x[begin]), float(x[end]), float(values[begin]), float(values[end]), slope, slope))
        begin = end
    return found
