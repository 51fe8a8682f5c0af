"""Conversion of a curve given at the stations into a few cubics for drawings and solid models.

Between its kinks, a designed diameter is a smooth function of the position. Over each panel it is the polynomial of
degree 8 through the Lobatto nodes. It is replaced by cubic Hermite interpolants, each as long as it stays within the
tolerance at every node it spans. Panels that no cubic spans are divided at their nodes; those with a kink or a step,
where the polynomial would oscillate, into straight segments.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.polynomial.chebyshev import chebfit

from solvers.numerics.arrays import Array
from solvers.numerics.panels import differentiation_matrix
from solvers.pin.stations.lobatto_panels import NODE_PLACES, NODE_WEIGHTS, NODES, Stations

_DIFFERENTIATION = differentiation_matrix(NODE_PLACES, NODE_WEIGHTS)
_TOLERANCE = 1e-7
"""Relative to the greatest diameter: 2 nm for a pin of 20 mm."""
_POSITION_TOLERANCE = 1e-9
"""Relative to the length: positions closer than manufacturing can resolve."""

_UNRESOLVED = 1e-4
"""Last Chebyshev coefficients of a panel's polynomial, relative to the greatest, above which a kink is assumed."""

F = TypeVar("F", float, Array)


@dataclass(frozen=True)
class Cubic:
    """A diameter over [start, end]: the cubic polynomial with these values and slopes at its ends, all lengths in the
    same unit."""

    start: float
    end: float
    first: float
    last: float
    slope_first: float
    slope_last: float

    def at(self, x: F) -> F:
        """Return the diameter at a position, or an array of positions, between the ends (Hermite's form)."""
        width = self.end - self.start
        t = (x - self.start) / width
        s = 1.0 - t
        from_values = self.first * s * s * (1.0 + 2.0 * t) + self.last * t * t * (1.0 + 2.0 * s)
        return from_values + width * t * s * (self.slope_first * s - self.slope_last * t)


def contour(stations: Stations, diameters: Array, length: float) -> tuple[Cubic, ...]:
    """Return the diameters [m] at the stations as cubics over the whole bar, in order.

    Stations up to the middle represent both halves. Adjacent cubics may differ in slope, a kink, and in value, a
    step. At every station further than 1e-9 of the length from a step they are within 1e-7 of the greatest diameter.
    """
    tolerance = _TOLERANCE * float(np.max(diameters))
    kept = stations.width > _POSITION_TOLERANCE * length
    x = stations.x.reshape(-1, NODES)[kept]
    values = np.asarray(diameters, float).reshape(-1, NODES)[kept]
    slopes = 2.0 / stations.width[kept, None] * (values @ _DIFFERENTIATION.T)
    pieces = _cubics(x, values, slopes, tolerance)
    # Close the gaps of panels dropped as too narrow: they are steps.
    starts = [0.0, *(piece.end for piece in pieces[:-1])]
    pieces = [replace(piece, start=start) for piece, start in zip(pieces, starts, strict=True)]
    middle = 0.5 * length
    if stations.right[-1] > middle * (1.0 + 1e-9):
        return tuple(pieces)
    half = [*(replace(piece, end=min(piece.end, middle)) for piece in pieces[:-1]), replace(pieces[-1], end=middle)]
    other = [
        Cubic(length - p.end, length - p.start, p.last, p.first, -p.slope_last, -p.slope_first) for p in reversed(half)
    ]
    return (*half, *other)


def _cubics(x: Array, values: Array, slopes: Array, tolerance: float) -> list[Cubic]:
    """Return the longest cubics from panel to panel within the tolerance at their nodes, (panels, nodes) each."""
    pieces: list[Cubic] = []
    begin = 0
    while begin < len(x):
        piece, end = None, begin + 1
        for last in range(begin, len(x)):
            ends = values[begin, 0], values[last, -1], slopes[begin, 0], slopes[last, -1]
            longer = Cubic(*map(float, (x[begin, 0], x[last, -1], *ends)))
            if not np.abs(longer.at(x[begin : last + 1]) - values[begin : last + 1]).max() <= tolerance:
                break
            piece, end = longer, last + 1
        pieces += [piece] if piece else _cubics(*_at_nodes(x[begin], values[begin], slopes[begin]), tolerance)
        begin = end
    return pieces


def _at_nodes(x: Array, values: Array, slopes: Array) -> tuple[Array, Array, Array]:
    """Divide a panel at its nodes; with the slopes of chords unless its polynomial has converged."""
    parts = [np.stack([nodes[:-1], nodes[1:]], axis=1) for nodes in (x, values, slopes)]
    sizes = np.abs(chebfit(NODE_PLACES, values, NODES - 1)[1:])
    if sizes[-2:].max() > _UNRESOLVED * sizes.max():
        parts[2] = np.repeat(np.diff(parts[1]) / np.diff(parts[0]), 2, axis=1)
    return tuple(parts)
