"""Friction power of guide loads in closed form."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from solvers.numerics.panels import Panels, rule_of
from solvers.rod.cycle.guide_loads import Guide, friction_power
from solvers.rod.piston.skirt import both_walls

TURN = 2.0 * np.pi
SIDE, SIDE_AT, COUPLE_AT = 0.045, 0.0139, 0.00295
"""T = SIDE sin(phi - SIDE_AT), 6 M/Lp = sin(phi - COUPLE_AT): both vanish near a dead centre, but not at once."""


def wall_force(x: float) -> float:
    return both_walls(abs(SIDE * math.sin(x - SIDE_AT)), abs(math.sin(x - COUPLE_AT)))


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9, 1e-11])
def test_a_pole_just_beyond_a_switch_is_told(tolerance):
    """Where both walls are in contact the wall force is (couple + T^2/couple)/2, here up to 1e-3 rad from its
    pole."""
    panels = Panels(np.linspace(0.0, TURN, 9), rule_of(16))
    angle = panels.angles_inside
    side, couple = SIDE * np.sin(angle - SIDE_AT), np.sin(angle - COUPLE_AT)
    found, error = friction_power(*panels, Guide(side, couple, 1.0, 0.0, 1.0, 0.0), tolerance)
    share = SIDE * np.array([1.0, -1.0])
    # T = couple and T = -couple.
    switches = np.arctan2(np.sin(COUPLE_AT) - share * np.sin(SIDE_AT), np.cos(COUPLE_AT) - share * np.cos(SIDE_AT))
    ends = np.sort([0.0, np.pi, TURN, *switches, *(switches + np.pi)])
    parts = [
        quad(lambda x: wall_force(x) * abs(math.sin(x)), a, b, epsabs=0.0, epsrel=1e-13, limit=400)[0]
        for a, b in pairwise(ends.tolist())
    ]
    assert abs(found / (sum(parts) / TURN) - 1.0) <= error + 1e-14
    assert error <= 2.0 * tolerance + 1e-11
