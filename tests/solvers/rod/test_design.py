"""Designs against a dense search that shares nothing with the solver, on random problems of every objective."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.rod_problems import problem as realistic
from solvers import rod
from solvers.outcome import Status
from solvers.rod.load.gas import ConstantLoad
from tests.solvers.rod.brute_force import CoreModel
from tests.solvers.rod.dense_search import MISSED, dense_search, random_problem, sample
from tests.solvers.rod.machines import CORE, PAPER, random_machine

REFERENCE = rod.RodProblem(
    PAPER,
    rod.Bounds((4e-3, 9e-3), (0.2e-3, 1e-3), (8e-3, 26e-3)),
    rod.Requirements(2.65, 1.8),
    rod.OBJECTIVES["mass"],
)


def arrays(dimensions):
    return tuple(np.array([v]) for v in (dimensions.b, dimensions.h, dimensions.l))


def cost_of(problem, outcome):
    value = problem.objective.read(outcome.value.check)
    return value if problem.objective.sign > 0 else 1 / value


def bound_of(problem, outcome):
    bound = outcome.certificate.bound
    return bound if problem.objective.sign > 0 else 1 / bound


@pytest.mark.parametrize("seed", [100, 101])
@pytest.mark.parametrize("objective", rod.OBJECTIVES)
def test_no_sampled_strip_beats_the_design_or_its_bound(objective, seed):
    problem, _ = random_problem(np.random.default_rng(seed), objective, random_machine)
    outcome = rod.design(problem, CORE)
    assert outcome.status is Status.SUCCEEDED
    d, r = outcome.value.check.dimensions, problem.requirements
    cost = cost_of(problem, outcome)

    # The reported values are correct and the requirements are met, by the densely sampled model.
    seen = sample(problem.scene, *arrays(d), angles=720, sections=201)
    assert seen.cost(objective)[0] == pytest.approx(cost, rel=1e-4)
    assert seen.admissible(r, -1e-8)[0]
    for name in ("b", "h", "l"):
        low, high = getattr(problem.bounds, name)
        assert low <= getattr(d, name) <= high

    # Sampling misses peaks: of an objective that is a peak, the sampled cost may be too low by as much.
    sampled = dense_search(problem, objective, r)[0]
    assert cost <= sampled * (1 + MISSED / 2)
    assert bound_of(problem, outcome) <= sampled * (1 + MISSED / 2)
    assert sampled <= cost * 1.03, "the search that judges was not dense enough"


@pytest.mark.parametrize("seed", [103, 104])
@pytest.mark.parametrize("objective", rod.OBJECTIVES)
def test_bound_and_gap_keep_their_promise(objective, seed):
    problem, strip = random_problem(np.random.default_rng(seed), objective, random_machine)
    outcome = rod.design(problem, CORE)
    certificate, cost = outcome.certificate, cost_of(problem, outcome)
    assert 0 <= certificate.gap <= 1e-6
    assert bound_of(problem, outcome) == pytest.approx(cost / (1 + certificate.gap), rel=1e-12)
    assert certificate.gap <= outcome.accuracy.estimated <= outcome.accuracy.requested == 1e-6
    assert bound_of(problem, outcome) <= sample(problem.scene, *arrays(strip)).cost(objective)[0] * (1 + MISSED)

    # Neighbours that would be better than the bound allows must break a requirement.
    d, r = outcome.value.check.dimensions, problem.requirements
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-4, -1, (400, 1))
    low = [getattr(problem.bounds, n)[0] for n in ("b", "h", "l")]
    high = [getattr(problem.bounds, n)[1] for n in ("b", "h", "l")]
    near = np.clip(np.array([d.b, d.h, d.l]) * np.exp(size * rng.uniform(-1, 1, (400, 3))), low, high)
    found = sample(problem.scene, *near.T)
    better = found.cost(objective) < bound_of(problem, outcome) * (1 - MISSED)
    assert not np.any(better & found.admissible(r, 1e-9 + MISSED))


def test_strips_whose_worst_sections_are_harmless_to_each_other_are_told_apart():
    # The bulge governs short strips and the clamp long ones: a search that forgets one of the two cycles between them
    # and believes a strip to be half again as safe as it is.
    problem, _ = random_problem(np.random.default_rng(1144), "fatigue_safety", random_machine)
    outcome = rod.design(problem, CORE)
    # By hand: the widest and thinnest strip, of the length at which clamp and bulge are equally utilised.
    b, h = problem.bounds.b[1], problem.bounds.h[0]
    lengths = np.linspace(0.104, 0.106, 41)
    sampled = sample(problem.scene, np.full(41, b), np.full(41, h), lengths, angles=720, sections=201)
    assert outcome.value.check.stresses.fatigue_safety >= sampled.fatigue.max() * (1 - 1e-4)
    d = outcome.value.check.dimensions
    assert (d.b, d.h) == pytest.approx((b, h), rel=1e-9)
    assert d.l == pytest.approx(lengths[sampled.fatigue.argmax()], rel=1e-3)
    assert 0 <= outcome.certificate.gap <= 1e-6


@pytest.mark.parametrize(
    ("seed", "objective"), [(1612, "fatigue_safety"), (1672, "fatigue_safety"), (1550, "contact_pressure")]
)
def test_peaks_that_are_nearly_each_others_equal_do_not_keep_a_proof_open(seed, objective):
    # Two peaks of a stress a few 1e-5 apart, the greater one narrower; a pressure that two angles share.
    problem, _ = random_problem(np.random.default_rng(seed), objective, random_machine)
    outcome = rod.design(problem, CORE)
    assert 0 <= outcome.certificate.gap <= 1e-6
    assert outcome.certificate.evidence["rounds"] < 16


def test_a_limit_that_the_search_misses_by_its_own_tolerance_is_met():
    """The greatest stress is 2e-9 above its limit, whenever the search is told to stay 1e-9 below it."""
    problem, known = random_problem(np.random.default_rng(1130), "contact_pressure", random_machine)
    assert problem.requirements.met_by(rod.check(problem.scene, known, CORE).value)
    outcome = rod.design(problem, CORE)
    assert outcome.status is Status.SUCCEEDED
    assert outcome.certificate.gap <= 1e-6


@pytest.mark.parametrize("seed", [1009, 1015, 1021, 1027])
def test_friction_power_is_bounded_by_the_power_that_the_check_says(seed):
    # The power's mean over a coarse cycle is off by up to 3e-5 in these, where the piston leaves its second wall.
    problem, _ = random_problem(np.random.default_rng(seed), "friction_power", random_machine)
    outcome = rod.design(problem, CORE)
    assert 0 <= outcome.certificate.gap <= 1e-6
    assert outcome.certificate.bound == pytest.approx(outcome.value.check.stresses.friction_power, rel=1e-6)
    near = replace(problem, bounds=_around(problem.bounds, outcome.value.check.dimensions))
    again = rod.design(near, CORE)
    assert outcome.certificate.bound <= again.value.check.stresses.friction_power


def _around(bounds, d):
    """A hundredth of the way to each side."""
    return rod.Bounds(*(
        (max(low, getattr(d, name) / 1.01), min(high, getattr(d, name) * 1.01))
        for name in ("b", "h", "l") for low, high in [getattr(bounds, name)]
    ))  # fmt: skip


def test_a_rod_that_is_only_pulled_has_no_stability_to_be_made_great():
    pulled = replace(REFERENCE.scene, load=ConstantLoad(-3e4))
    problem = replace(REFERENCE, scene=pulled, objective=rod.OBJECTIVES["stability_safety"])
    outcome = rod.design(problem, CORE)
    assert outcome.status is Status.SUCCEEDED
    assert outcome.value.check.stability_safety is None
    assert (outcome.certificate.bound, outcome.certificate.gap) == (np.inf, 0.0)


def test_without_friction_any_strip_has_the_least_power():
    smooth = replace(REFERENCE.scene, piston=replace(REFERENCE.scene.piston, friction_coefficient=0.0))
    outcome = rod.design(replace(REFERENCE, scene=smooth, objective=rod.OBJECTIVES["friction_power"]), CORE)
    assert outcome.status is Status.SUCCEEDED
    assert outcome.value.check.stresses.friction_power == outcome.certificate.bound == 0.0


def test_reference_problem():
    """Mass of the paper's machine: three governing limits meet in one point, checked by peaks searched one by one."""
    outcome = rod.design(REFERENCE, CORE)
    d = outcome.value.check.dimensions
    model = CoreModel(PAPER, d)
    material = PAPER.material

    def use(high, low):
        mean = max((high + low) / 2, 0)
        return (1.15 * (high - low) / 2 + 0.12 * mean) / material.fatigue_limit

    assert 1 / model.worst(use) == pytest.approx(2.65, rel=1e-8)
    assert d.b == pytest.approx(9e-3, rel=1e-12)
    assert outcome.value.check.mass == pytest.approx(7850 * d.b * d.h * d.l, rel=1e-14)
    assert outcome.value.check.mass == pytest.approx(0.57120936e-3, rel=1e-6)
    assert {a.name for a in outcome.value.active} == {"min_fatigue_safety", "b_upper"}
    # Any strip lighter by 1e-5 of the same section breaks a limit, so does one shorter, thinner or both.
    for shrink in ((0, 1e-5, 0), (0, 0, 1e-5), (0, -1e-4, 2e-4), (0, 2e-4, -1e-4)):
        other = rod.Dimensions(*(v * (1 - s) for v, s in zip((d.b, d.h, d.l), shrink, strict=True)))
        assert 1 / CoreModel(PAPER, other).worst(use) < 2.65


@pytest.mark.parametrize("accuracy", [1e-2, 1e-4, 1e-6])
def test_gap_follows_the_accuracy_asked_for(accuracy):
    outcome = rod.design(REFERENCE, CORE, accuracy=accuracy)
    assert outcome.certificate.gap <= accuracy
    assert outcome.accuracy.estimated <= accuracy
    assert outcome.value.check.mass == pytest.approx(0.571209360e-3, rel=accuracy)
    assert outcome.certificate.bound <= 0.57120937e-3


@pytest.mark.parametrize("objective", ["friction_power", "contact_pressure", "mass"])
def test_tight_accuracies_are_met_where_clamp_and_an_inner_section_govern_together(objective):
    """Their stresses peak 0.002 rad apart, and thinner or thicker strips are both weaker."""
    feedback = rod.EffectSelection(CORE.include | {"friction_feedback"}, CORE.exclude - {"friction_feedback"})
    asked = replace(REFERENCE, objective=rod.OBJECTIVES[objective])
    outcome = rod.design(asked, feedback, accuracy=1e-8)
    assert outcome.accuracy.met
    best, least = outcome.value.check.dimensions, asked.objective.read(outcome.value.check)
    rng, feasible = np.random.default_rng(1), 0
    for step, share in zip(10 ** rng.uniform(-9.0, -3.0, 200), rng.uniform(-0.5, 1.5, 200), strict=True):
        beside = rod.Dimensions(best.b, best.h * (1 + share * step), best.l * (1 + step))
        other = rod.check(PAPER, beside, feedback, accuracy=1e-10).value
        if asked.requirements.met_by(other):
            feasible += 1
            assert asked.objective.read(other) >= least * (1 - outcome.accuracy.estimated)
    assert feasible > 40


def test_an_accuracy_out_of_reach_is_not_claimed():
    outcome = rod.design(REFERENCE, CORE, accuracy=1e-12)
    assert outcome.accuracy.estimated >= outcome.certificate.gap > 1e-12


@pytest.mark.parametrize(
    ("l", "h", "safety"), [(18e-3, 0.41e-3, 2.619), (20e-3, 0.43e-3, 2.660), (23e-3, 0.46e-3, 2.698)]
)
def test_paper_strip_is_the_best_of_its_width_and_length(l, h, safety):
    bounds = rod.Bounds((9e-3, 9e-3), (0.3e-3, 0.7e-3), (l, l))
    steps = tuple(round(n * 0.01e-3, 9) for n in range(30, 71))
    problem = rod.RodProblem(PAPER, bounds, rod.Requirements(1.0, 1.0), rod.OBJECTIVES["fatigue_safety"], steps)
    outcome = rod.design(problem, CORE)
    assert outcome.value.check.dimensions.h == pytest.approx(h, abs=1e-9)
    assert outcome.value.check.stresses.fatigue_safety == pytest.approx(safety, abs=6e-4)


def test_paper_strip_without_steps():
    bounds = rod.Bounds((9e-3, 9e-3), (0.3e-3, 0.7e-3), (23e-3, 23e-3))
    problem = rod.RodProblem(PAPER, bounds, rod.Requirements(1.0, 1.0), rod.OBJECTIVES["fatigue_safety"])
    outcome = rod.design(problem, CORE)
    found = outcome.value.check
    heights = np.linspace(0.44e-3, 0.47e-3, 301)
    every = sample(PAPER, np.full(301, 9e-3), heights, np.full(301, 23e-3), angles=360, sections=101)
    assert found.dimensions.h == pytest.approx(heights[every.fatigue.argmax()], abs=2e-7)
    assert found.stresses.fatigue_safety == pytest.approx(every.fatigue.max(), rel=3e-4)


@pytest.mark.parametrize("objective", ["contact_pressure", "side_force", "friction_power"])
def test_limits_that_leave_a_corner_of_strips_are_met_and_the_best_of_these_is_proven(objective):
    """The strips that a few angles admit may be a single one: no box around it has an admissible centre."""
    asked = realistic(5103)
    safest = rod.design(replace(asked, objective=rod.OBJECTIVES["fatigue_safety"])).value.check
    requirements = replace(asked.requirements, min_fatigue_safety=0.998 * safest.stresses.fatigue_safety)
    problem = replace(asked, requirements=requirements, objective=rod.OBJECTIVES[objective])
    outcome, lightest = rod.design(problem), rod.design(replace(problem, objective=rod.OBJECTIVES["mass"]))
    assert outcome.status is Status.SUCCEEDED
    assert requirements.met_by(outcome.value.check)
    assert outcome.accuracy.met and outcome.certificate.gap <= 1e-6
    for known in (safest, lightest.value.check):
        assert outcome.certificate.bound <= problem.objective.read(known) * (1 + 1e-9)


@pytest.mark.parametrize("sizes", [{}, {"stock_h": None}, {"stock_h": None, "step_b": None, "step_l": None}])
def test_a_stress_that_is_closer_to_its_limit_than_the_utilisation_does_not_bound_the_safety(sizes):
    """The greatest fatigue safety, little of it asked for, under a yield safety that strips in the middle just have."""
    asked = realistic(68)
    problem = replace(
        asked, objective=rod.OBJECTIVES["fatigue_safety"],
        requirements=replace(asked.requirements, min_fatigue_safety=1e-6), **sizes,
    )  # fmt: skip
    outcome = rod.design(problem, CORE)
    known = rod.check(problem.scene, rod.Dimensions(10.2e-3, 0.35e-3, 12.5e-3), CORE).value
    assert problem.requirements.met_by(known)
    assert outcome.value.check.stresses.fatigue_safety >= known.stresses.fatigue_safety * (1 - 1e-9)
    assert outcome.certificate.bound >= known.stresses.fatigue_safety


def test_a_size_that_few_angles_admit_does_not_end_the_search():
    """Of sizes in steps the best one that a mean over few angles admits exceeds the limit by a fifth of a percent."""
    asked = realistic(6065)
    free = replace(asked.requirements, max_friction_power=None)
    least = rod.design(replace(asked, requirements=free, objective=rod.OBJECTIVES["friction_power"])).value.check
    limited = replace(free, max_friction_power=1.002 * least.stresses.friction_power)
    outcome = rod.design(replace(asked, requirements=limited, objective=rod.OBJECTIVES["stability_safety"]))
    assert outcome.status is Status.SUCCEEDED
    assert limited.met_by(outcome.value.check)
    assert outcome.value.check.stability_safety >= least.stability_safety * (1 - 1e-9)


@pytest.mark.parametrize("seed", [50, 80])
def test_a_flat_optimum_inside_all_limits_is_proven_to_the_accuracy(seed):
    """No limit is active there, so boxes around the optimum cannot be cut off by a plane."""
    exclude = frozenset(effect.name for effect in rod.EFFECTS) - CORE.include - {"reciprocating_inertia"}
    outcome = rod.design(realistic(seed), rod.EffectSelection(CORE.include, exclude))
    assert outcome.value.active == ()
    assert outcome.accuracy.met and outcome.certificate.gap <= 1e-6


@pytest.mark.parametrize("accuracy", [1e-1, 3e-2])
def test_loose_infeasible_designs_are_diagnosed(accuracy):
    """Ten times the accuracy, by which an attainable value may be off, is as much as the requirement itself."""
    problem = replace(REFERENCE, stock_h=(0.4e-3, 0.5e-3, 0.6e-3), requirements=rod.Requirements(2.9, 1.8))
    outcome = rod.design(problem, accuracy=accuracy)
    assert outcome.status is Status.INFEASIBLE
    (missed,) = outcome.diagnosis
    assert missed.requirement == "min_fatigue_safety" and 2.4 < missed.attainable < 2.9


@pytest.mark.parametrize("slack", [0.0, 1e-6, 1.0, 1e3])
def test_relaxed_requirements_are_looser_and_stay_valid(slack):
    asked = rod.Requirements(2.65, 1.8, max_contact_pressure=1e5)
    relaxed = asked.relaxed(slack)
    assert 0.0 < relaxed.min_fatigue_safety <= asked.min_fatigue_safety
    assert 1.0 <= relaxed.min_stability_safety <= asked.min_stability_safety
    assert relaxed.max_contact_pressure == pytest.approx(asked.max_contact_pressure * (1.0 + slack))


def test_a_bound_beyond_the_rod_changes_nothing():
    """The fatigue safety is nearly the same for all long strips, so that searches reach the end of the rod."""
    mechanism = replace(PAPER.mechanism, crank_radius=31e-3, rod_length=384e-3, speed=2.7)
    piston = replace(PAPER.piston, diameter=200e-3, skirt_length=318e-3)
    load = rod.SchmidtLoad(p_min=0.19e6, delta=0.75, theta=-1.7, back_pressure=0.34e6)
    scene = replace(PAPER, mechanism=mechanism, piston=piston, load=load)
    bounds = rod.Bounds((21e-3, 74e-3), (1.2e-3, 12.5e-3), (118e-3, 384e-3))
    problem = rod.RodProblem(scene, bounds, rod.Requirements(1.0, 1.0), rod.OBJECTIVES["fatigue_safety"])
    longer = replace(problem, bounds=replace(bounds, l=(118e-3, 460e-3)))
    assert rod.design(longer).value == rod.design(problem).value
