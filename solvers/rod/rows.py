"""Rows of a design: logarithms of a strip's results, of which objectives and limits are composed.

In logarithms the mass is linear, and a relative tolerance is an absolute one. Every limit is an upper limit of a row; a
minimum safety n is a maximum utilisation 1/n. The first rows are results; a result that is the maximum of several
smooth functions, its parts, is followed by a row for each of them (``Layout``).
"""

from __future__ import annotations

from typing import NamedTuple

TAU, LENGTH, THICKNESS, UTILISATION, STABILITY, SIDE, PRESSURE, POWER, SIDEWAYS, STRESS, FIRST_PART = range(11)
"""ln of tau = 1/(b h^3), l, h, fatigue utilisation 1/n, compression/critical force in the crank's plane, side force
[N], contact pressure [Pa], friction power [W], compression/critical force out of the crank's plane, maximum stress
[Pa]; and the first part of a result."""

NEVER_COMPRESSED = -700.0
"""ln(compression/critical force) of a strip that is never compressed: finite, and smaller than any other."""

BUCKLED = 40.0
"""The rows of a buckled strip, whose results are meaningless: finite, and greater than any other."""


class Layout(NamedTuple):
    """Layout of the parts: the numbers of utilisations and stresses, then side force and contact pressure in turn at
    each of ``peaks`` peaks."""

    utilisations: int
    stresses: int
    peaks: int

    @property
    def size(self) -> int:
        """Total number of rows."""
        return FIRST_PART + self.utilisations + self.stresses + 2 * self.peaks

    def parts(self, row: int) -> range:
        """The parts of a row, or the row itself."""
        stresses = FIRST_PART + self.utilisations
        reactions = stresses + self.stresses
        if row == UTILISATION:
            return range(FIRST_PART, stresses)
        if row == STRESS:
            return range(stresses, reactions)
        if row in (SIDE, PRESSURE) and self.peaks:
            return range(reactions + (row == PRESSURE), self.size, 2)
        return range(row, row + 1)
