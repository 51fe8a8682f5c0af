"""Designs next to what is attainable, where a limit costs hundreds of times what it moves by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import root

from solvers import rod
from solvers.rod.constraints import BY_NAME
from tests.solvers.rod.machines import PAPER
from tests.solvers.rod.optimum.test_answers import settled
from tests.solvers.rod.test_design import REFERENCE

DAMPED = replace(REFERENCE, scene=replace(PAPER, material=replace(PAPER.material, loss_factor=0.01)))


def test_the_lightest_strip_next_to_the_greatest_safety_has_the_accuracy_asked_for():
    """Two safeties at their limits and the greatest width determine the strip: checks of their own find it."""
    safest = rod.design(replace(DAMPED, objective=rod.OBJECTIVES["fatigue_safety"])).value.check
    requirements = replace(DAMPED.requirements, min_fatigue_safety=0.999 * safest.stresses.fatigue_safety)
    problem = replace(DAMPED, requirements=requirements)
    outcome = rod.design(problem)
    active = {entry.name: entry.sensitivity for entry in outcome.value.active}
    assert set(active) == {"min_fatigue_safety", "min_stability_safety", "b_upper"}
    assert active["min_fatigue_safety"] > 30.0
    assert outcome.accuracy.met

    effects, strip = settled(outcome), outcome.value.check.dimensions

    def missed(logs: np.ndarray) -> list[float]:
        h, l = np.exp(logs).tolist()
        check = rod.check(problem.scene, rod.Dimensions(strip.b, h, l), effects, accuracy=1e-9).value
        return [BY_NAME[name].result.read(check) / getattr(requirements, name) - 1.0 for name in list(active)[:2]]

    end = root(missed, np.log([strip.h, strip.l]), options={"eps": 1e-6, "xtol": 1e-8})
    assert np.max(np.abs(missed(end.x))) < 1e-9
    lightest = problem.scene.material.density * strip.b * float(np.exp(end.x.sum()))
    assert outcome.value.check.mass == pytest.approx(lightest, rel=outcome.accuracy.estimated)
