"""Conversion of a curve given at the stations into a few cubics for drawings and solid models.

Between its kinks, a designed diameter is a smooth function of the position. Over each panel it is the polynomial of
degree 8 through the Lobatto nodes. It is replaced by cubic Hermite interpolants, each as long as it stays within the
tolerance at every node it spans. Panels that no cubic spans are divided at their nodes; those with a kink or a step,
where the polynomial would oscillate, into straight segments.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.cubics import Cubic, divided, longest_cubics
from solvers.numerics.panels import differentiation_matrix
from solvers.pin.stations.lobatto_panels import NODE_PLACES, NODE_WEIGHTS, NODES, Stations

_DIFFERENTIATION = differentiation_matrix(NODE_PLACES, NODE_WEIGHTS)
_CHEBYSHEV = np.linalg.inv(np.polynomial.chebyshev.chebvander(NODE_PLACES, NODES - 1))
_TOLERANCE, RESOLUTION = 1e-7, 1e-12
"""Tolerance relative to the greatest diameter, 2 nm for a pin of 20 mm; the same to which a thin wall is resolved."""
_POSITION_TOLERANCE = 1e-9
"""Relative to the length: positions closer than manufacturing can resolve."""
_UNRESOLVED = 1e-4
"""Last Chebyshev coefficients of a panel's polynomial, relative to the greatest, above which a kink is assumed."""
_MOST_CHORDS, _ADDED = 200, 3e-3
"""Maximum number of chords of one cubic; greatest wall that a chord adds, relative to the greatest wall."""


@dataclass(frozen=True, eq=False)
class Contour:
    """Cubics in order over one half of a symmetric bar, or over a whole one: ``rows`` of the fields of ``Cubic``,
    (n, 6). Adjacent ones may differ in slope, a kink, and in value, a step."""

    rows: Array
    length: float

    @cached_property
    def pieces(self) -> tuple[Cubic, ...]:
        """The cubics over the whole bar."""
        start, end, first, last, rise, fall = self.rows.T
        rows = self.rows
        if end[-1] < self.length * (1.0 - _POSITION_TOLERANCE):
            other = np.stack([self.length - end, self.length - start, last, first, -fall, -rise], axis=1)
            rows = np.concatenate([rows, other[::-1]])
        return tuple(Cubic(*row) for row in rows.tolist())

    def at(self, x: Array, side: Array) -> Array:
        """Return the diameters at positions x, at a step those of the cubic in which ``side`` lies."""
        last = len(self.rows) - 1
        return Cubic(*self.rows[np.minimum(np.searchsorted(self.rows[:, 1], side, side="left"), last)].T).at(x)

    def points(self, step: float, given: float, tolerance: float) -> tuple[Array, Array]:
        """Return positions at most ``step`` apart, and with each one inside its cubic, whose chords leave walls to the
        ``given`` diameter that are thinner than the curve's by ``tolerance`` of them at most."""
        start, end, first, last, rise, fall = self.rows.T
        width, bend = end - start, Cubic(*self.rows.T).bends()
        wall = np.minimum(np.abs(first - given), np.abs(last - given)) + RESOLUTION * np.max(self.rows[:, 2:4])
        toward, middle = np.sign(given - 0.5 * (first + last)), 0.5 * (start + end)
        near = np.maximum(toward * bend / (tolerance * wall), np.abs(bend) / (_ADDED * wall.max())).max(axis=0)
        near = np.minimum(np.sqrt(near / 8.0), _MOST_CHORDS / width)
        # A chord may span curves that meet smoothly; straight lines keep their ends, the points of a given profile.
        kink = np.maximum(np.abs(rise[1:] - fall[:-1]) * step, np.abs(first[1:] - last[:-1]))
        alone = (near * step > 1.0) | (rise == fall)
        apart = alone[1:] | alone[:-1] | (kink > tolerance * np.minimum(wall[1:], wall[:-1]))
        begin, stop = np.flatnonzero(np.append(True, apart)), np.flatnonzero(np.append(apart, True))
        chords = np.add.reduceat(np.maximum(1.0 / step, near) * width, begin)
        x, of = divided(start[begin], end[stop], np.ceil(chords * (1.0 - 1e-12)))
        return x, np.clip(x, middle[begin[of]], middle[stop[of]])


def contour(
    stations: Stations, diameters: Array, length: float, tolerance: Array | float = math.inf, steepest: float = math.inf
) -> Contour:
    """Return the diameters [m] at the stations as cubics that are not steeper than ``steepest``.

    At every station further than 1e-9 of the length from a step they are within the ``tolerance`` [m], and within 1e-7
    of the greatest diameter.
    """
    kept = stations.width > _POSITION_TOLERANCE * length
    tolerance = np.broadcast_to(np.minimum(tolerance, _TOLERANCE * float(np.max(diameters))), stations.x.shape)
    x, values, tolerance = (given.reshape(-1, NODES)[kept] for given in (stations.x, diameters, tolerance))
    slopes = 2.0 / stations.width[kept, None] * (values @ _DIFFERENTIATION.T)
    waves = np.abs(values @ _CHEBYSHEV[1:].T)
    smooth = waves[:, -2:].max(axis=1) <= _UNRESOLVED * waves.max(axis=1)
    rows = longest_cubics(x.ravel(), values.ravel(), slopes.ravel(), smooth, tolerance.ravel(), steepest, NODES)
    # Close the gaps of panels dropped as too narrow: they are steps.
    rows[:, 0] = np.append(0.0, rows[:-1, 1])
    if stations.right[-1] <= 0.5 * length * (1.0 + _POSITION_TOLERANCE):
        rows[-1, 1] = 0.5 * length
    return Contour(rows, length)
