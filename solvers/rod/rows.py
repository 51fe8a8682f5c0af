"""The rows of a design: logarithms of the results of a strip that objectives and limits are made of.

In logarithms the mass is linear, and a relative tolerance is an absolute one. Every limit of a design is "row at most
so much"; a least safety n is a greatest utilisation 1/n. The first rows are results; a result that is the greatest of
several smooth ones, its parts, is followed by a row for each of them (``Layout``).
"""

from __future__ import annotations

from typing import NamedTuple

TAU, LENGTH, THICKNESS, UTILISATION, STABILITY, SIDE, PRESSURE, POWER, SIDEWAYS, STRESS = range(10)
"""ln of 1/(b h^3), l, h, fatigue utilisation 1/n, compression/critical force in the crank's plane, side force [N],
contact pressure [Pa], friction power [W], compression/critical force out of the crank's plane, greatest stress [Pa]."""

COUNT = 8
"""Rows that an objective may weigh: those up to POWER."""

FIRST_PART = 10

NEVER_COMPRESSED = -700.0
"""ln(compression/critical force) of a strip that is never compressed: finite, and smaller than any other."""

BUCKLED = 40.0
"""The rows of a buckled strip, whose results mean nothing: finite, and greater than any other."""


class Layout(NamedTuple):
    """Where the parts are: so many utilisations, so many stresses, then side force and contact pressure at each of so
    many peaks in turn."""

    utilisations: int
    stresses: int
    peaks: int

    @property
    def size(self) -> int:
        """The number of all rows."""
        return FIRST_PART + self.utilisations + self.stresses + 2 * self.peaks

    def parts(self, row: int) -> range:
        """The rows that a row is the greatest of, or the row itself."""
        stresses = FIRST_PART + self.utilisations
        reactions = stresses + self.stresses
        if row == UTILISATION:
            return range(FIRST_PART, stresses)
        if row == STRESS:
            return range(stresses, reactions)
        if row in (SIDE, PRESSURE) and self.peaks:
            return range(reactions + (row == PRESSURE), self.size, 2)
        return range(row, row + 1)
