"""Rivals can win: each search ends in an optimum known by hand, and a strip a little off its optimum is beaten."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.rod_problems import problem
from oracles.rivals.hunt import Hunt, Look, Space, Spent
from oracles.rivals.rod import Strength, contest, scouted_contest
from oracles.rivals.search import WAYS, search
from oracles.rivals.worsened import worsened
from solvers import rod
from tests.solvers.rod.machines import CORE, PAPER

LOW, HIGH = np.exp(np.array([-3.0, -2.0, -0.5])), np.exp(np.array([3.0, 2.0, 0.7]))

CLOSE = {**dict.fromkeys(WAYS, 1e-6), "Nelder-Mead": 1e-2}
"""A simplex gets stuck before the corner of two limits; the linear programs that polish its end go on from there."""


def wedge(sizes: np.ndarray) -> Look:
    """ln y + ln z, y above two curves that meet at a corner: ln y >= exp(ln x - 1) - 1 and ln y >= (1 - ln x)/2."""
    x, y, z = np.log(sizes)
    return Look(y + z, np.array([min(y - math.expm1(x - 1.0), y - 0.5 * (1.0 - x)), 2.0 - x]))


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(
    "start", [(1.3, 0.9, 0.2), (-2.0, 1.9, 0.0), (2.5, -1.0, 0.5)], ids=["inside", "far", "outside"]
)
def test_a_search_ends_in_the_corner(way, start):
    hunt = Hunt(Space(LOW, HIGH), wedge)
    search(hunt, way, np.array(start), 200, 0.1)
    cost, sizes = hunt.best
    assert cost == pytest.approx(-0.5, abs=CLOSE[way])
    assert np.log(sizes) == pytest.approx([1.0, 0.0, -0.5], abs=10 * CLOSE[way])


@pytest.mark.parametrize("way", WAYS)
def test_sizes_that_come_in_steps_are_searched_over_their_grid(way):
    widths = np.exp(np.array([-2.1, -1.0, 0.1, 0.4, 1.3, 2.4]))
    hunt = Hunt(Space(LOW, HIGH, (widths, None, None)), wedge)
    search(hunt, way, np.array([-2.0, 1.9, 0.0]), 200, 0.1)
    cost, sizes = hunt.best
    x = np.log(widths)
    assert cost == pytest.approx(np.maximum(np.expm1(x - 1.0), 0.5 * (1.0 - x)).min() - 0.5, abs=CLOSE[way])
    assert sizes[0] in widths


def test_what_breaks_a_limit_does_not_count():
    hunt = Hunt(Space(LOW, HIGH), lambda sizes: Look(wedge(sizes).cost, np.array([-1e-12])))
    search(hunt, "linear programs", np.zeros(3), 50, 0.1)
    assert hunt.best is None


def test_a_strip_off_its_optimum_is_beaten():
    """The least mass of the paper's machine, and an answer that is thicker and longer, and 0.3 % heavier."""
    problem = rod.RodProblem(
        PAPER,
        rod.Bounds((4e-3, 9e-3), (0.2e-3, 1e-3), (8e-3, 26e-3)),
        rod.Requirements(2.5, 1.8),
        rod.OBJECTIVES["mass"],
    )
    outcome = rod.design(problem, CORE)
    quick = Strength(2, 60)
    assert not contest(problem, outcome, quick).won
    strip = outcome.value.check.dimensions
    worse = rod.check(PAPER, replace(strip, h=strip.h * 1.001, l=strip.l * 1.002), CORE).value
    assert worse.stresses.fatigue_safety > 2.5
    spoiled = replace(outcome, value=replace(outcome.value, check=worse))
    beaten = contest(problem, spoiled, quick)
    assert beaten.won and beaten.gain == pytest.approx(0.003002, rel=1e-2)


def test_a_false_no_is_found():
    """Told that there is none, rivals find one."""
    case = json.loads(Path(__file__).with_name("beaten_designs.json").read_text("utf-8"))[1]
    bounds = rod.Bounds(**{name: tuple(pair) for name, pair in case["bounds"].items()})
    problem = rod.RodProblem(PAPER, bounds, rod.Requirements(2.5, 1.8), rod.OBJECTIVES["mass"])
    none = rod.design(replace(problem, requirements=rod.Requirements(9.0, 1.8)), CORE)
    assert none.value is None
    # Far from any limit that can be met, COBYQA dwells on strips whose check takes seconds.
    quick = Strength(2, 40, ("SLSQP", "Nelder-Mead", "linear programs"))
    assert contest(problem, none, quick).won
    assert not contest(replace(problem, requirements=rod.Requirements(9.0, 1.8)), none, quick).won


@pytest.mark.parametrize("seed", [2, 210, 613])
def test_a_realistic_answer_made_a_little_worse_is_beaten(seed):
    """By all that it was made worse; the answer itself is not."""
    asked = problem(seed)
    outcome = rod.design(asked)
    spoiled = scouted_contest(asked, worsened(asked, outcome, 1e-4, seed), seed)
    assert spoiled.won and math.log1p(spoiled.gain) == pytest.approx(1e-4, rel=0.01)
    assert not scouted_contest(asked, outcome, seed).won


def test_a_search_that_does_not_approach_is_over():
    hunt = Hunt(Space(LOW, HIGH), wedge, target=-0.5)
    hunt.allow(1000, "")
    with pytest.raises(Spent):
        for n in range(1000):
            hunt.at(np.array([1.0, 1.9, 0.1 + 1e-6 * n]))
    assert hunt.evaluations < 30
    hunt.allow(1000, "")
    for n in range(60):
        hunt.at(np.array([1.0, 1.8 * 0.9**n, -0.5]))
