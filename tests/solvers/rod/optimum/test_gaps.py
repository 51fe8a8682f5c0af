"""Designs among damped resonances."""

from __future__ import annotations

import math

import numpy as np

from bench.rod_problems import problem
from oracles.rivals.rod import log_cost, settled
from solvers import rod


def test_an_optimum_between_damped_resonances_is_exact():
    """Undamped, this answer's estimate is 2e-3: a flat optimum among poles."""
    asked = problem(40)
    found = rod.design(asked)
    assert found.accuracy.met
    best, effects = found.value.check.dimensions, settled(found.effects)
    assert "rod_inertia" in effects.include
    own = log_cost(asked, found.value.check)
    for step in np.concatenate([np.geomspace(1e-4, 0.05, 6), -np.geomspace(1e-4, 0.05, 6)]):
        # Along the limit of stability h^3/l^2 is about constant.
        strip = rod.Dimensions(best.b, best.h * math.exp(step), best.l * math.exp(1.5 * step))
        if not asked.bounds.l[0] <= strip.l <= asked.bounds.l[1]:
            continue
        beside = rod.check(asked.scene, strip, effects, accuracy=1e-7).value
        if asked.requirements.met_by(beside):
            assert log_cost(asked, beside) > own - found.accuracy.estimated
