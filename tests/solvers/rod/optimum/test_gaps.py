"""Designs among damped resonances."""

from __future__ import annotations

import math

import numpy as np

from bench.rod_problems import problem
from solvers import rod
from tests.solvers.rod.optimum.beside import assert_none_beside_is_better


def test_an_optimum_between_damped_resonances_is_exact():
    """Undamped, this answer's estimate is 2e-3: a flat optimum among poles."""
    asked = problem(40)

    def beside(best):
        for step in np.concatenate([np.geomspace(1e-4, 0.05, 6), -np.geomspace(1e-4, 0.05, 6)]):
            # Along the limit of stability h^3/l^2 is about constant.
            strip = rod.Dimensions(best.b, best.h * math.exp(step), best.l * math.exp(1.5 * step))
            if asked.bounds.l[0] <= strip.l <= asked.bounds.l[1]:
                yield strip

    assert_none_beside_is_better(asked, beside)
