"""Stock thicknesses and steps of width and length, against looking at every combination."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from app.designs.flexible_rod.request import DesignRequest
from bench.campaign.designs import DESIGNED
from bench.rod_problems import problem as realistic
from bench.rod_relaxations import relaxed
from solvers import rod
from solvers.effects import EffectSelection
from solvers.outcome import EffectState, Status
from tests.solvers.rod.dense_search import MISSED, random_problem, sample
from tests.solvers.rod.machines import CORE, PAPER, random_machine
from tests.solvers.rod.test_design import REFERENCE, arrays, cost_of


def multiples(step, low, high):
    return [n * step for n in range(int(np.ceil(low / step - 1e-9)), int(np.floor(high / step + 1e-9)) + 1)]


def combinations(scene, widths, heights, lengths):
    """Everything about every combination."""
    return sample(scene, *(np.array(v) for v in zip(*product(widths, heights, lengths), strict=True)))


def best_of_all(problem, found, margin):
    """Least cost over all combinations, and how many are admissible."""
    cost = np.where(found.admissible(problem.requirements, margin), found.cost(problem.objective.name), np.inf)
    return cost.min(), int(np.isfinite(cost).sum())


@pytest.fixture(scope="module")
def steps():
    return combinations(REFERENCE.scene, multiples(1e-3, 4e-3, 9e-3), STOCK, multiples(1e-3, 8e-3, 26e-3))


STOCK = (0.25e-3, 0.3e-3, 0.4e-3, 0.45e-3, 0.5e-3, 0.6e-3, 0.8e-3)


@pytest.mark.parametrize("objective", rod.OBJECTIVES)
def test_all_three_sizes_in_steps(objective, steps):
    problem = replace(
        REFERENCE, requirements=rod.Requirements(2.3, 1.8), objective=rod.OBJECTIVES[objective],
        stock_h=STOCK, step_b=1e-3, step_l=1e-3,
    )  # fmt: skip
    outcome = rod.design(problem, CORE)
    d = outcome.value.check.dimensions
    assert d.h in STOCK
    assert d.b / 1e-3 == pytest.approx(round(d.b / 1e-3), abs=1e-9)
    assert d.l / 1e-3 == pytest.approx(round(d.l / 1e-3), abs=1e-9)
    sure, _ = best_of_all(problem, steps, MISSED)
    hopeful, count = best_of_all(problem, steps, -MISSED)
    assert count > 10
    assert hopeful * (1 - MISSED) <= cost_of(problem, outcome) <= sure * (1 + MISSED)
    assert sample(problem.scene, *arrays(d), angles=720, sections=201).admissible(problem.requirements, -1e-8)[0]


@pytest.mark.parametrize("seed", range(3))
def test_only_some_sizes_in_steps(seed):
    """One, two of the three sizes free: no combination of the steps with sampled free sizes does better."""
    rng = np.random.default_rng(seed)
    problem, strip = random_problem(rng, "mass", random_machine)
    low_h, high_h = problem.bounds.h
    stock = (strip.h, *np.linspace(low_h, high_h, 7)) if seed != 1 else None
    step_b, step_l = (strip.b / 6 if seed else None), (strip.l / 12 if seed != 2 else None)
    problem = replace(problem, stock_h=stock, step_b=step_b, step_l=step_l)
    outcome = rod.design(problem, CORE)
    assert outcome.status is Status.SUCCEEDED
    d, bounds = outcome.value.check.dimensions, problem.bounds
    heights = [h for h in stock if low_h <= h <= high_h] if stock else np.geomspace(low_h, high_h, 24)
    widths = multiples(step_b, *bounds.b) if step_b else np.geomspace(*bounds.b, 8)
    lengths = multiples(step_l, *bounds.l) if step_l else np.geomspace(*bounds.l, 14)
    sure, count = best_of_all(problem, combinations(problem.scene, widths, heights, lengths), MISSED)
    assert count > 0
    assert cost_of(problem, outcome) <= sure
    assert sample(problem.scene, *arrays(d), angles=720, sections=201).admissible(problem.requirements, -1e-8)[0]
    assert stock is None or d.h in stock
    for size, step in ((d.b, step_b), (d.l, step_l)):
        assert step is None or size / step == pytest.approx(round(size / step), abs=1e-9)


def test_no_stock_that_is_thin_enough_is_an_answer():
    outcome = rod.design(replace(REFERENCE, stock_h=(0.8e-3, 0.9e-3)), CORE)
    assert outcome.status is Status.INFEASIBLE
    assert outcome.value is None
    assert [entry.requirement for entry in outcome.diagnosis] == ["min_fatigue_safety"]


@pytest.mark.parametrize("objective", rod.OBJECTIVES)
def test_fine_steps_cost_little(objective):
    """With thousands of sizes one is found, and nearly as good as the best of sizes chosen at will."""
    free = replace(REFERENCE, requirements=rod.Requirements(2.3, 1.8), objective=rod.OBJECTIVES[objective])
    outcome = rod.design(replace(free, step_b=1e-4, step_l=1e-4), CORE)
    least = cost_of(free, rod.design(free, CORE))
    assert least * (1 - 1e-6) <= cost_of(free, outcome) <= least * 1.02
    assert outcome.certificate.gap < 1e-6


@pytest.mark.parametrize(
    ("seed", "rival"),
    [
        (296, rod.Dimensions(0.009, 0.0005, 0.0156)),
        (832, rod.Dimensions(0.0075, 0.0004, 0.021)),
        (502, rod.Dimensions(0.0065, 0.000162, 0.016)),
        (2506, rod.Dimensions(0.007, 0.0003178, 0.02125)),
        (2872, rod.Dimensions(0.0105, 0.0003, 0.0292)),
        (40048, rod.Dimensions(0.009353400793068463, 0.0004, 0.02499)),
    ],
    ids=[
        "as stiff in another thickness",
        "the next length",
        "a length whose core is next to a resonance",
        "lengths with the strip between other resonances",
        "lengths that no path of one thickness leads to",
        "another thickness three gaps away",
    ],
)
def test_sizes_that_rivals_found_are_found(seed, rival):
    asked = realistic(seed)
    best = rod.design(asked).value.check
    beside = rod.check(asked.scene, rival, accuracy=1e-6).value
    assert asked.requirements.met_by(beside)
    assert asked.objective.log_cost(best, asked.scene) <= asked.objective.log_cost(beside, asked.scene) + 1e-6


def test_a_row_of_lengths_ends_at_the_bounds():
    """The step is a third of the only length within the bounds: a row that went on would reach a length of zero."""
    asked = realistic(40048)
    asked = replace(asked, step_l=8.3e-3, bounds=replace(asked.bounds, l=(20e-3, 24.9e-3)))
    best = rod.design(asked).value.check
    assert best.dimensions.l == pytest.approx(24.9e-3)
    assert asked.requirements.met_by(best)


def campaigns(seed):
    """A random design problem of the campaign."""
    body = DESIGNED["flexible-rod"](np.random.default_rng([seed, 1])).body
    return DesignRequest.model_validate_json(json.dumps(body)).problem()


def test_lengths_in_other_gaps_are_looked_at():
    """A rival found a length four steps away; paths of sizes chosen at will lead to other thicknesses."""
    asked = campaigns(9)
    best = rod.design(asked).value.check
    d = best.dimensions
    for n in range(59, 93):
        length = min(max(n * asked.step_l, asked.bounds.l[0]), asked.bounds.l[1])
        beside = rod.check(asked.scene, rod.Dimensions(d.b, d.h, length), accuracy=1e-6).value
        if asked.requirements.met_by(beside):
            assert asked.objective.log_cost(best, asked.scene) <= asked.objective.log_cost(beside, asked.scene) + 1e-6


def test_a_thickness_that_is_not_in_stock_is_no_answer():
    """The search for any admissible strip ends at one; none in stock has the contact pressure that is asked for."""
    asked = campaigns(11)
    outcome = rod.design(asked)
    assert outcome.status is Status.INFEASIBLE
    greatest = asked.requirements.max_contact_pressure
    for h, l in product(asked.stock_h, np.linspace(*asked.bounds.l, 12)):
        for b in asked.bounds.b:
            strip = rod.check(asked.scene, rod.Dimensions(b, h, float(l)), accuracy=1e-3).value
            assert strip.stresses is None or strip.stresses.contact_pressure_max > 1.1 * greatest


def test_a_search_along_a_curved_limit_ends_at_the_optimum():
    """Width and length of a stock thickness trade off along the fatigue limit: ten iterations ended 4e-5 from the
    optimum."""
    piston, material = replace(PAPER.piston, skirt_length=8.2e-3), replace(PAPER.material, loss_factor=0.01)
    scene, stock = replace(PAPER, piston=piston, material=material), (0.4e-3, 0.5e-3, 0.6e-3)
    bounds = rod.Bounds((4e-3, 9e-3), (0.2e-3, 1e-3), (8e-3, 26e-3))
    problem = rod.RodProblem(scene, bounds, rod.Requirements(2.65, 1.8), rod.OBJECTIVES["mass"], stock_h=stock)
    assert rod.design(problem).accuracy.met


def test_sizes_far_from_each_other_that_cost_about_as_much():
    """A wide and thin strip, a thousandth from the core's optimum, was once taken for the best: 1.7e-4 worse than this
    one, which stricter requirements led to."""
    asked = relaxed(387, 0.0153)
    found = rod.design(asked)
    effects = EffectSelection(
        *(
            frozenset(e.name for e in found.effects if (e.state is EffectState.ACTIVE) is active)
            for active in (True, False)
        )
    )
    other = rod.check(asked.scene, rod.Dimensions(13.2e-3, 0.8e-3, 6.6e-3), effects).value
    assert asked.requirements.met_by(other)
    best, cost = (asked.objective.log_cost(check, asked.scene) for check in (found.value.check, other))
    assert best < cost + 2e-6


def test_relaxing_a_requirement_does_not_lead_past_better_neighbours():
    """Of the neighbours predicted to be better only the first forty were searched: the answer was 7e-4 worse."""
    strict = realistic(5109)
    eased = strict.requirements.min_fatigue_safety / 1.02
    loose = replace(strict, requirements=replace(strict.requirements, min_fatigue_safety=eased))
    assert cost_of(loose, rod.design(loose)) <= cost_of(strict, rod.design(strict)) * (1.0 + 1e-9)
