"""A local search beside the results of others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from solvers.effects import EffectSelection
from solvers.fatigue import serensen
from solvers.rod.effects import choose_for, compose
from solvers.rod.optimum.full_model.model import FullModel
from solvers.rod.optimum.full_model.strip import dimensions_of
from solvers.rod.optimum.search.local_search import Task, local_search
from solvers.rod.optimum.sqp import required_results
from tests.solvers.rod.optimum.test_full_model import FALSELY_CERTIFIED as ASKED

CLOSED = EffectSelection(frozenset({"beam_column"}), frozenset({"rod_inertia", "large_displacement"}), automatic=False)
START = np.log([0.0115, 0.0003, 0.0095])
THICKER_AND_LONGER = np.array([0.0, 0.025, 0.03])
"""To strips that meet all limits of a light one, and are heavier."""


@pytest.fixture(scope="module")
def search():
    """A search from a start, beside the results of others."""
    limits = ASKED.requirements.limits(ASKED.scene)
    composition = compose(choose_for(ASKED.scene, dimensions_of(START, ASKED.scene), CLOSED, 1e-2))
    wanted = required_results(ASKED.objective, limits)
    model = FullModel(ASKED.scene, composition, serensen(ASKED.scene.material), CLOSED, 1e-2, 1e-6, wanted)
    task = Task(ASKED.objective, ASKED.requirements, limits, 1e-8, 1e-7)
    return lambda start, results=(), bounds=ASKED.bounds: local_search(model, task, bounds, start, results=results)


def test_a_search_that_leads_to_the_end_of_another_is_over(search):
    end = search(START)
    assert end.feasible_best is not None and end.predicted_gain <= 1e-7
    beside = end.best.x + THICKER_AND_LONGER
    again = search(beside)
    assert np.max(np.abs(again.best.x - end.best.x)) < 1e-4
    assert search(beside, [end]) is None


def test_ends_that_tell_nothing_of_a_search_do_not_stop_it(search):
    end = search(START)
    beside = end.best.x + THICKER_AND_LONGER
    dearer = replace(end, best=replace(end.best, log_cost=end.best.log_cost + 0.03))
    unfinished = replace(end, predicted_gain=1e-3)
    assert search(beside, [dearer]).feasible_best is not None
    assert search(beside, [unfinished]).feasible_best is not None
    # The same valley within other bounds may have its bottom elsewhere.
    length = float(np.exp(end.best.x[2]))
    longer = replace(ASKED.bounds, l=(1.001 * length, ASKED.bounds.l[1]))
    assert search(beside, [end], longer).feasible_best is not None
