"""A local search that converges to the result of another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from solvers import rod
from solvers.effects import EffectSelection
from solvers.fatigue import serensen
from solvers.rod.effects import choose_for
from solvers.rod.optimum.full_model.model import FullModel
from solvers.rod.optimum.full_model.strip import dimensions_of
from solvers.rod.optimum.search.local_search import Task, local_search
from solvers.rod.optimum.sqp import required_results
from tests.solvers.rod.machines import PAPER
from tests.solvers.rod.optimum.test_full_model import FALSELY_CERTIFIED as ASKED

CLOSED = EffectSelection(frozenset({"beam_column"}), frozenset({"rod_inertia", "large_displacement"}), automatic=False)
START = np.log([0.0115, 0.0003, 0.0095])
THICKER_AND_LONGER = np.array([0.0, 0.025, 0.03])
"""Change of ln(b, h, l) from a light strip to a heavier one that meets all limits."""


@pytest.fixture(scope="module")
def search():
    """A local search from a start, given the results of others."""
    limits = ASKED.requirements.limits(ASKED.scene)
    choice = choose_for(ASKED.scene, dimensions_of(START, ASKED.scene), CLOSED, 1e-2)
    wanted = required_results(ASKED.objective, limits)
    model = FullModel(ASKED.scene, choice, serensen(ASKED.scene.material), 1e-6, wanted)
    task = Task(ASKED, 1e-8, 1e-7)
    return lambda start, results=(), bounds=ASKED.bounds: local_search(model, task, bounds, start, results=results)


def test_a_search_that_converges_to_another_result_is_abandoned(search):
    result = search(START)
    assert result.feasible and result.predicted_gain <= 1e-7
    other_start = result.at.x + THICKER_AND_LONGER
    again = search(other_start)
    assert np.max(np.abs(again.at.x - result.at.x)) < 1e-4
    assert search(other_start, [result]) is None


def test_results_of_other_optima_do_not_stop_a_search(search):
    result = search(START)
    other_start = result.at.x + THICKER_AND_LONGER
    costlier = replace(result, at=replace(result.at, log_cost=result.at.log_cost + 0.03))
    unfinished = replace(result, predicted_gain=1e-3)
    assert search(other_start, [costlier]).feasible
    assert search(other_start, [unfinished]).feasible
    # Within other bounds the same basin may have its optimum elsewhere.
    length = float(np.exp(result.at.x[2]))
    longer = replace(ASKED.bounds, l=(1.001 * length, ASKED.bounds.l[1]))
    assert search(other_start, [result], longer).feasible


def test_a_search_ends_at_a_limit_that_a_step_exceeds_by_little_more_than_rounding():
    """Near buckling fatigue rises steeply, and the first step exceeds its limit by 3e-7: SLSQP stayed there, and the
    design kept a strip that is 0.2 % heavier."""
    bounds, limits = rod.Bounds((4e-3, 9e-3), (0.2e-3, 1.0e-3), (8e-3, 26e-3)), rod.Requirements(0.6, 1.01)
    found = rod.design(rod.RodProblem(PAPER, bounds, limits, rod.OBJECTIVES["mass"]))
    assert found.accuracy.met and found.value.check.stability_safety > 1.1
    assert found.value.check.stresses.fatigue_safety == pytest.approx(0.6, rel=1e-6)
