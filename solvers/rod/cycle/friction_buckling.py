"""How far a strip that buckles by friction alone is beyond its stability boundary.

    share = min over phi of max over p of p/(-P0 - friction),   0 < p <= P_cr,   friction of the strip under P = -p

is the greatest share of all axial forces, friction included, under which the strip has an equilibrium at every angle
(``state.greatest_share``). It is below 1 if friction buckles the strip; without friction it would be P_cr over the
maximum compression.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.rod.cycle.state import GOLDEN, GOLDEN_STEPS, Strip, greatest_share
from solvers.rod.load.axial_force import Drive, axial_force

Array = NDArray[np.float64]

SHARE_ERROR = 1e-13
"""Relative error of the share."""
_GREATEST = 1.0 - 1e-14
"""Of a strip that has no equilibrium, whatever rounding makes of it at the boundary."""


@kernel
def carried_share(drive: Drive, strip: Strip, critical: float, angle: Array) -> float:
    """The share of the axial forces that a strip buckled by friction alone would carry, P_cr [N] given; the worst of
    the angles, which must increase over a revolution, is refined."""
    share, worst = np.inf, 0
    for i in range(angle.size):
        found = _share_at(drive, strip, critical, angle[i], share)
        if found < share:
            share, worst = found, i
    left, right = angle[max(worst - 1, 0)], angle[min(worst + 1, angle.size - 1)]
    for _ in range(GOLDEN_STEPS):
        lower, upper = right - GOLDEN * (right - left), left + GOLDEN * (right - left)
        at_lower = _share_at(drive, strip, critical, lower, np.inf)
        at_upper = _share_at(drive, strip, critical, upper, np.inf)
        share = min(share, at_lower, at_upper)
        if at_lower < at_upper:
            right = upper
        else:
            left = lower
    return min(share, _GREATEST)


@kernel
def _share_at(drive: Drive, strip: Strip, critical: float, angle: float, enough: float) -> float:
    """The share at one angle, or any lower bound of it that is above ``enough``; inf where friction pulls."""
    friction_factor = strip.friction * drive.crank_radius * math.sin(angle)
    if not friction_factor < 0.0:
        return np.inf
    return greatest_share(strip, axial_force(drive, angle), friction_factor, critical, enough)[0]
