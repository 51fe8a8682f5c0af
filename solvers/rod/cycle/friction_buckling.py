"""How far a strip that buckles by friction alone is beyond its stability boundary.

    share = min over phi of max over p of p/(-P0 - friction),   0 < p <= P_cr,   friction of the strip under P = -p

is the greatest share of all axial forces, friction included, under which the strip has an equilibrium at every angle
(``state.greatest_share``). It is below 1 if friction buckles the strip; without friction it would be P_cr over the
maximum compression.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.rod.cycle.state import GOLDEN, GOLDEN_STEPS, Strip, greatest_share
from solvers.rod.load.axial_force import Drive, axial_force

SHARE_ERROR = 1e-13
"""Relative error of the share."""
_MIN_SEPARATION = 1e-9
"""Least difference of neighbouring angles [rad]."""
_GREATEST = 1.0 - 1e-14
"""Of a strip that has no equilibrium, whatever rounding makes of it at the boundary."""


@kernel
def carried_share(drive: Drive, strip: Strip, critical: float, angle: Array) -> float:
    """The share of the axial forces that a strip buckled by friction alone would carry, P_cr [N] given. The angles must
    not decrease over a revolution; between their neighbours all those are refined whose share can lead to the least."""
    separate, count = np.empty(angle.size), 0
    for i in range(angle.size):
        # Where two panels meet, both have a point: of such a pair neither would be less than both of its neighbours.
        if i == angle.size - 1 or angle[i + 1] - angle[i] > _MIN_SEPARATION:
            separate[count] = angle[i]
            count += 1
    angle = separate[:count]
    share, least = np.empty(count), np.inf
    for i in range(angle.size):
        share[i] = _share_at(drive, strip, critical, angle[i])
        least = min(least, share[i])
    for i in range(angle.size):
        before, after = max(i - 1, 0), min(i + 1, angle.size - 1)
        # A smooth minimum is below the neighbouring samples by less than those differ.
        change = max(abs(share[before] - share[i]), abs(share[after] - share[i]))
        if share[i] <= share[before] and share[i] <= share[after] and share[i] - change <= least:
            least = min(least, _least_between(drive, strip, critical, angle[before], angle[after]))
    return min(least, _GREATEST)


@kernel
def _least_between(drive: Drive, strip: Strip, critical: float, left: float, right: float) -> float:
    """The least share between two angles, by golden section."""
    least = np.inf
    for _ in range(GOLDEN_STEPS):
        lower, upper = right - GOLDEN * (right - left), left + GOLDEN * (right - left)
        at_lower = _share_at(drive, strip, critical, lower)
        at_upper = _share_at(drive, strip, critical, upper)
        least = min(least, at_lower, at_upper)
        if at_lower < at_upper:
            right = upper
        else:
            left = lower
    return least


@kernel
def _share_at(drive: Drive, strip: Strip, critical: float, angle: float) -> float:
    """The share at one angle; inf where friction pulls."""
    friction_factor = strip.friction * drive.crank_radius * math.sin(angle)
    if not friction_factor < 0.0:
        return np.inf
    return greatest_share(strip, axial_force(drive, angle), friction_factor, critical, np.inf)[0]
