"""Steps along the full model's own slopes, beside the best of many strips drawn at random."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from solvers import rod
from solvers.rod.optimum import constraints as rows
from solvers.rod.optimum.full_model.straight import downhill
from solvers.rod.optimum.full_model.tilt import Tilt, full_rows, logarithms
from solvers.rod.optimum.peak_model import FIRST_GROUP, STRESS
from solvers.rod.problem import OBJECTIVES, Bounds, Requirements
from tests.solvers.rod.machines import CORE, PAPER, STRIP

REACH, GUARD = 0.01, 1e-7
BOX = Bounds(*((size * math.exp(-REACH), size * math.exp(REACH)) for size in (STRIP.b, STRIP.h, STRIP.l)))
FULL = rod.check(PAPER, STRIP, CORE).value
LIMITED = {
    rows.UTILISATION: lambda r: -math.log(r.min_fatigue_safety),
    rows.STABILITY: lambda r: -math.log(r.min_stability_safety),
    STRESS: lambda r: -math.log(r.min_yield_safety),
    rows.PRESSURE: lambda r: math.log(r.max_contact_pressure),
    rows.POWER: lambda r: math.log(r.max_friction_power),
}


def requirements(room):
    """Limits that leave every result of the strip so much room, in logarithms."""
    s = FULL.stresses
    return Requirements(
        min_fatigue_safety=s.fatigue_safety * math.exp(-room),
        min_stability_safety=FULL.stability_safety * math.exp(-room),
        max_contact_pressure=s.contact_pressure_max * math.exp(room),
        max_friction_power=s.friction_power * math.exp(room),
        min_yield_safety=s.yield_safety * math.exp(-room),
    )


def slopes_of_sizes(slopes):
    """With what follows from b, h, l alone: 1/(b h^3), l, h."""
    slopes = slopes.copy()
    slopes[rows.TAU], slopes[rows.LENGTH], slopes[rows.THICKNESS] = (-1, -3, 0), (0, 0, 1), (0, 1, 0)
    return slopes


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("name", ["mass", "side_force", "fatigue_safety"])
def test_no_strip_in_reach_is_better_as_far_as_the_slopes_are_straight(seed, name):
    rng = np.random.default_rng(seed)
    slopes = rng.standard_normal((FIRST_GROUP, 3))
    asked, objective = requirements(2e-3), OBJECTIVES[name]
    strip, change = downhill(objective, asked, GUARD, Tilt(logarithms(STRIP), slopes, slopes), FULL, BOX)
    along, values = slopes_of_sizes(slopes), full_rows(FULL)
    down = sum(weight * along[row] for row, weight in objective.weights)

    def broken(moves):
        """By how much the worst limit is passed at moves of the shape (n, 3)."""
        return np.max([values[r] + moves @ along[r] - limit(asked) for r, limit in LIMITED.items()], axis=0)

    move = logarithms(strip) - logarithms(STRIP)
    assert np.all(np.abs(move) <= REACH * (1 + 1e-12))
    assert broken(move[None])[0] <= -0.5 * GUARD
    assert down @ move == pytest.approx(change, rel=1e-9, abs=1e-12)
    drawn = rng.uniform(-REACH, REACH, (200_000, 3))
    best = np.min(drawn[broken(drawn) <= -GUARD] @ down)
    assert change <= best < 0.8 * change < 0


def test_a_strip_at_a_limit_goes_along_it():
    """Where less mass means less safety and nothing else, there is no way down."""
    slopes = np.zeros((FIRST_GROUP, 3))
    slopes[rows.UTILISATION] = (-1, -1, -1)
    tilt, asked = Tilt(logarithms(STRIP), slopes, slopes), requirements(0.1)
    at_its_limit = replace(asked, min_fatigue_safety=FULL.stresses.fatigue_safety)
    strip, change = downhill(OBJECTIVES["mass"], asked, GUARD, tilt, FULL, BOX)
    assert change == pytest.approx(-3 * REACH)
    assert logarithms(strip) == pytest.approx(logarithms(STRIP) - REACH)
    assert downhill(OBJECTIVES["mass"], at_its_limit, GUARD, tilt, FULL, BOX) is None
