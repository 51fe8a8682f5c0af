"""Ten machines whose designs were once beaten by a local search on the check, by 9e-5 to 5e-3 of the objective.

What was given then rested on a search that took the influence of some effects for constant. ``beaten_designs.json`` has
the problems in SI units, the effects that ran, the answer of that time, and the strip that beat it, which keeps every
limit with 1e-6 to spare.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from oracles.rivals.rod import Strength, contest, log_cost, margins
from solvers import rod
from solvers.outcome import Status

CASES = {case["name"]: case for case in json.loads(Path(__file__).with_name("beaten_designs.json").read_text("utf-8"))}
QUICK = Strength(starts=3, evaluations=40, ways=("SLSQP", "linear programs"), most=300)
CONTESTED = ("realistic problem 33", "realistic problem 139", "realistic problem 204", "realistic problem 231")
"""Those whose checks are quick; the campaign has contests for all sorts."""
ACCURACY, ENOUGH = 1e-7, 1e-5
"""Of the strips checked, and of the designs: strips beat what was given then by ten times as much at least."""


def problem_of(case: dict) -> tuple[rod.RodProblem, rod.EffectSelection]:
    scene = rod.Scene(
        rod.Mechanism(**case["mechanism"]),
        rod.Piston(**case["piston"]),
        rod.SchmidtLoad(**case["load"]),
        rod.Material(**case["material"], loss_factor=0.0),
    )
    bounds = rod.Bounds(**{name: tuple(pair) for name, pair in case["bounds"].items()})
    asked, objective = rod.Requirements(**case["requirements"]), rod.OBJECTIVES[case["objective"]]
    active = frozenset(case["effects"])
    selection = rod.EffectSelection(active, frozenset(e.name for e in rod.EFFECTS) - active)
    return rod.RodProblem(scene, bounds, asked, objective), selection


@pytest.mark.parametrize("name", CASES)
def test_the_strip_that_beat_it_keeps_the_limits_and_is_better(name):
    case = CASES[name]
    problem, selection = problem_of(case)
    found, before = (
        rod.check(problem.scene, rod.Dimensions(*case[strip]), selection, accuracy=ACCURACY).value
        for strip in ("rival", "answer")
    )
    assert margins(problem.requirements, found).min() > 0.0
    assert problem.objective.read(found) == pytest.approx(case["rival_objective"], rel=10 * ACCURACY)
    assert log_cost(problem, found) < log_cost(problem, before) - 5e-5


@pytest.mark.parametrize("name", CASES)
def test_a_design_is_as_good_as_the_strip_that_beat_it(name):
    case = CASES[name]
    problem, selection = problem_of(case)
    outcome = rod.design(problem, selection, accuracy=ENOUGH)
    assert outcome.status is Status.SUCCEEDED
    value, rival = problem.objective.read(outcome.value.check), case["rival_objective"]
    behind = (value / rival) ** problem.objective.sign - 1.0
    assert behind <= ENOUGH + outcome.accuracy.estimated


@pytest.mark.parametrize("name", CONTESTED)
def test_a_local_search_finds_no_better_strip(name):
    problem, selection = problem_of(CASES[name])
    outcome = rod.design(problem, selection)
    rivals = contest(problem, outcome, QUICK)
    assert rivals.missed <= outcome.accuracy.estimated
    assert not rivals.won, rivals
