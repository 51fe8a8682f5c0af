"""What a design says beside its strip: why there is none, and what its limits are worth."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from itertools import pairwise

import numpy as np
import pytest

from bench.rod_problems import problem as realistic
from solvers import rod
from solvers.outcome import EffectState, Status
from solvers.rod.constraints import BY_NAME
from solvers.rod.optimum.answer.requirement_as_objective import RequirementsAsObjectives
from solvers.rod.optimum.search.context import Context
from tests.solvers.rod.dense_search import MISSED, dense_search, sample
from tests.solvers.rod.machines import CORE
from tests.solvers.rod.test_design import REFERENCE, bound_of, cost_of

_Design = import_module("solvers.rod.design")._Design
ANYTHING = rod.Requirements(1e-3, 1.0)


def without(asked, name):
    """The other requirements alone."""
    return replace(asked, **{name: getattr(ANYTHING, name)})


def settled(outcome):
    """The selection that runs the effects of an answer."""
    active = frozenset(effect.name for effect in outcome.effects if effect.state is EffectState.ACTIVE)
    return rod.EffectSelection(active, frozenset(effect.name for effect in rod.EFFECTS) - active)


def test_a_safety_out_of_reach_is_named_with_the_best_there_is():
    outcome = rod.design(replace(REFERENCE, requirements=rod.Requirements(4.0, 1.8)), CORE)
    assert outcome.status is Status.INFEASIBLE
    (entry,) = outcome.diagnosis
    best = 1 / dense_search(REFERENCE, "fatigue_safety", replace(ANYTHING, min_stability_safety=1.8))[0]
    assert (entry.requirement, entry.required) == ("min_fatigue_safety", 4.0)
    assert entry.attainable == pytest.approx(best, rel=2 * MISSED)
    assert outcome.certificate.gap == 0.0


def test_limits_that_only_clash_are_each_named_with_what_the_other_leaves():
    asked = rod.Requirements(2.7, 2.6)
    outcome = rod.design(replace(REFERENCE, requirements=asked), CORE)
    assert outcome.status is Status.INFEASIBLE
    entries = {entry.requirement: entry for entry in outcome.diagnosis}
    assert set(entries) == {"min_fatigue_safety", "min_stability_safety"}
    fatigue = 1 / dense_search(REFERENCE, "fatigue_safety", replace(ANYTHING, min_stability_safety=2.6))[0]
    stability = 1 / dense_search(REFERENCE, "stability_safety", replace(ANYTHING, min_fatigue_safety=2.7), 0.0)[0]
    assert entries["min_fatigue_safety"].attainable == pytest.approx(fatigue, rel=2 * MISSED)
    assert entries["min_stability_safety"].attainable == pytest.approx(stability, rel=0.02)
    # What is said to be attainable can be had.
    given = replace(asked, min_fatigue_safety=entries["min_fatigue_safety"].attainable * 0.999)
    assert rod.design(replace(REFERENCE, requirements=given), CORE).status is Status.SUCCEEDED


def test_what_is_attainable_can_be_had_where_its_strip_selects_other_effects():
    """The infeasible strip selects rod inertia, the one of greatest fatigue safety does not."""
    asked = realistic(6031)
    limits = replace(asked.requirements, min_fatigue_safety=2.0 * asked.requirements.min_fatigue_safety)
    asked = replace(asked, stock_h=None, step_b=None, step_l=None, requirements=limits)
    outcome = rod.design(asked)
    (entry,) = (entry for entry in outcome.diagnosis if entry.requirement == "min_fatigue_safety")
    assert_attainable(asked, entry)


def assert_attainable(problem, entry):
    """A requirement can be met up to what is said to be attainable, and no further."""
    for share, status in ((0.999, Status.SUCCEEDED), (1.001, Status.INFEASIBLE)):
        asked = replace(problem.requirements, **{entry.requirement: share * entry.attainable})
        assert rod.design(replace(problem, requirements=asked)).status is status


def test_what_effects_put_out_of_reach_is_not_called_nearly_met():
    """Friction of a short skirt: the core meets each requirement, no strip comes near the first."""
    short = replace(REFERENCE.scene, piston=replace(REFERENCE.scene.piston, skirt_length=2.7e-5))
    feedback = rod.EffectSelection(CORE.include | {"friction_feedback"}, CORE.exclude - {"friction_feedback"})
    (entry,) = rod.design(replace(REFERENCE, scene=short), feedback).diagnosis
    assert entry.requirement == "min_fatigue_safety"
    assert entry.attainable < 0.5 * entry.required
    assert "slightly" not in entry.advice


@pytest.mark.parametrize("name", ["min_fatigue_safety", "min_yield_safety"])
def test_a_strip_that_rings_attains_what_is_told_far_beyond_it(name):
    problem = replace(realistic(78), requirements=replace(ANYTHING, **{name: 60.0}))
    outcome = rod.design(problem)
    assert "rod_inertia" in settled(outcome).include
    assert outcome.accuracy.estimated < 1e-3
    (entry,) = outcome.diagnosis
    assert_attainable(problem, entry)


OUT_OF_REACH = {
    "min_fatigue_safety": (4.0, lambda s: s.fatigue),
    "min_stability_safety": (500.0, lambda s: s.stability),
    "max_contact_pressure": (1e4, lambda s: s.pressure),
    "max_friction_power": (0.01, lambda s: s.power),
    "min_yield_safety": (6.0, lambda s: s.strength),
}


@pytest.fixture(scope="module")
def sampled():
    """Strips all over the bounds of the reference problem."""
    heights, lengths = np.geomspace(0.2e-3, 1e-3, 120), np.linspace(8e-3, 26e-3, 25)
    b, h, l = (v.ravel() for v in np.meshgrid([4e-3, 9e-3], heights, lengths))
    return sample(REFERENCE.scene, b, h, l)


@pytest.mark.parametrize("name", OUT_OF_REACH)
def test_every_requirement_out_of_reach_is_named_alone_with_the_best_beside_the_others(sampled, name):
    required, result = OUT_OF_REACH[name]
    asked = replace(rod.Requirements(1.0, 1.0), **{name: required})
    outcome = rod.design(replace(REFERENCE, requirements=asked), CORE)
    assert outcome.status is Status.INFEASIBLE
    (entry,) = outcome.diagnosis
    assert (entry.requirement, entry.required) == (name, required)
    values = result(sampled)[sampled.admissible(without(asked, name), 0.0)]
    best = values.max() if name.startswith("min") else values.min()
    assert entry.attainable == pytest.approx(best, rel=0.04)
    # Not worse than any strip sampled, as far as sampling sees the peaks.
    assert (entry.attainable - best) * (1 if name.startswith("min") else -1) >= -MISSED * best


def test_a_strip_that_cannot_stand_at_all_is_said_to_buckle():
    thin = replace(REFERENCE, bounds=rod.Bounds((1e-3, 2e-3), (0.1e-3, 0.2e-3), (20e-3, 26e-3)))
    (entry,) = rod.design(thin, CORE).diagnosis
    assert entry.requirement == "min_stability_safety"
    best = sample(REFERENCE.scene, np.array([2e-3]), np.array([0.2e-3]), np.array([20e-3])).stability[0]
    assert entry.attainable == pytest.approx(best, rel=1e-6)


def test_a_strip_that_only_effects_beyond_the_core_buckle_is_said_to_buckle(monkeypatch):
    """The stiffest strip is stable on the core and not under what friction adds to its compression."""
    monkeypatch.setattr("bench.rod_problems.FACTOR", 30.0)
    asked = realistic(557)
    outcome, b = rod.design(asked), asked.bounds
    stiffest = rod.Dimensions(b.b[1], b.h[1], b.l[0])
    (entry,) = outcome.diagnosis
    assert entry.requirement == "min_stability_safety"
    assert rod.check(asked.scene, stiffest, CORE).value.stresses is not None
    assert entry.attainable == pytest.approx(rod.check(asked.scene, stiffest).value.stability_safety, rel=1e-6)
    assert entry.attainable < 1.0


def test_opponents_name_each_other():
    """Fatigue and yield want a long, thick strip, contact a thin one; stability stands by."""
    asked = rod.Requirements(2.65, 1.2, max_contact_pressure=3.4e4, min_yield_safety=5.3)
    outcome = rod.design(replace(REFERENCE, requirements=asked), CORE)
    entries = {entry.requirement: entry for entry in outcome.diagnosis}
    assert set(entries) == {"min_fatigue_safety", "max_contact_pressure", "min_yield_safety"}
    assert "while max_contact_pressure holds" in entries["min_fatigue_safety"].advice
    assert "while max_contact_pressure holds" in entries["min_yield_safety"].advice
    assert "while min_fatigue_safety or min_yield_safety holds" in entries["max_contact_pressure"].advice
    # Each may be had with the others as they are left: contact against both, either one against contact.
    given = replace(asked, max_contact_pressure=entries["max_contact_pressure"].attainable * 1.001)
    assert rod.design(replace(REFERENCE, requirements=given), CORE).status is Status.SUCCEEDED
    for name in ("min_fatigue_safety", "min_yield_safety"):
        other = {"min_fatigue_safety": 1.0, "min_yield_safety": None}
        reached = {name: entries[name].attainable * 0.998}
        given = replace(asked, **{**other, **reached})
        assert rod.design(replace(REFERENCE, requirements=given), CORE).status is Status.SUCCEEDED


@pytest.mark.parametrize(
    "asked",
    [
        rod.Requirements(4.0, 1.8),
        rod.Requirements(3.5, 6.0),
        rod.Requirements(2.65, 1.8, max_friction_power=0.02),
        rod.Requirements(2.65, 1.8, max_contact_pressure=1.0e4),
    ],
)
@pytest.mark.parametrize("selection", [rod.AUTO, rod.ALL], ids=["auto", "all"])
def test_what_is_attainable_is_reached_by_a_strip_and_known_as_well_as_is_said(asked, selection):
    """The best on the full model is that of a design for the result itself, with the same effects."""
    outcome = rod.design(replace(REFERENCE, requirements=asked), selection)
    assert outcome.status is Status.INFEASIBLE
    assert 0.0 < outcome.accuracy.estimated < 0.06
    for entry in outcome.diagnosis:
        row = BY_NAME[entry.requirement]
        beside = replace(REFERENCE, objective=row.result, requirements=without(asked, entry.requirement))
        best = rod.design(beside, settled(outcome))
        value, doubt = row.result.read(best.value.check), best.accuracy.estimated
        assert entry.attainable == pytest.approx(value, rel=outcome.accuracy.estimated + doubt), row.name
        # A strip reaches it: it is not better than the best.
        assert (entry.attainable / value - 1.0) * (1 if row.is_minimum else -1) <= doubt + 1e-6, row.name


@pytest.mark.parametrize("seed", [15, 106, 293])
def test_what_is_attainable_is_as_accurate_as_was_asked(seed):
    """Rods that vibrate: the attainable safety is another design, to the same accuracy."""
    outcome = rod.design(realistic(seed))
    assert outcome.status is Status.INFEASIBLE
    assert outcome.accuracy.met


def test_no_other_gaps_are_searched_if_the_first_optimum_leaves_vibration_out(monkeypatch):
    """The core's optimum selects vibration, the first optimum beside it does not: no gap between resonances matters."""

    def search(*_):
        raise AssertionError("other gaps were searched")

    monkeypatch.setattr("solvers.rod.optimum.search.discrete_sizes.search_other_gaps", search)
    monkeypatch.setattr("solvers.rod.optimum.search.continuous_sizes.search_other_gaps", search)
    outcome = rod.design(realistic(260))
    assert outcome.status is Status.SUCCEEDED
    active = {effect.name for effect in outcome.effects if effect.state is EffectState.ACTIVE}
    assert "friction_feedback" in active and "rod_inertia" not in active


@pytest.fixture
def designs(monkeypatch):
    """The designs for missed requirements: the starts of the searches of each, and its best strip."""
    made, running = [], []
    design, search = _Design.attainable_best, Context.search_from

    def recorded_design(self, *given):
        running.append([])
        try:
            best = design(self, *given)
            made.append((running[-1], best))
        finally:
            running.pop()
        return best

    def recorded_search(self, start, *given, **named):
        if running:
            running[-1].append(start)
        return search(self, start, *given, **named)

    monkeypatch.setattr(_Design, "attainable_best", recorded_design)
    monkeypatch.setattr(Context, "search_from", recorded_search)
    return made


def test_a_requirement_that_the_core_s_best_strip_meets_is_not_designed_for_alone(designs):
    """Each of two that clash is designed for beside the other, with all sizes discrete."""
    assert len(rod.design(realistic(1192)).diagnosis) == 2
    assert len(designs) == 2


def test_a_design_starts_at_the_strip_of_another_that_nearly_meets_its_requirements(designs):
    rod.design(realistic(2380))
    (_, first), *others = designs
    assert any(first.check.dimensions in starts for starts, _ in others)


@pytest.mark.parametrize(
    ("seed", "within"),
    [(35, 1e-6), (358, 2e-2), (356, 1e-6), (47, 0.1), (68, 0.1)],
    ids=["beside stability", "two that conflict, in steps", "rings, close", "rings", "in steps"],
)
def test_a_requirement_lowered_to_what_is_attainable_beside_the_others_can_be_met(seed, within):
    asked = realistic(seed)
    outcome = rod.design(asked)
    assert outcome.status is Status.INFEASIBLE
    assert 0.0 < outcome.accuracy.estimated < within
    for entry in outcome.diagnosis:
        row = BY_NAME[entry.requirement]
        assert entry.attainable < entry.required
        lowered = {entry.requirement: entry.attainable * (1 - outcome.accuracy.estimated)}
        met = rod.design(replace(asked, requirements=replace(asked.requirements, **lowered)))
        assert met.status is Status.SUCCEEDED
        beside = without(asked.requirements, entry.requirement)
        best = rod.design(replace(asked, objective=row.result, requirements=beside), accuracy=1e-5)
        value, doubt = row.result.read(best.value.check), min(best.accuracy.estimated, 1e-4)
        assert value == pytest.approx(entry.attainable, rel=outcome.accuracy.estimated + doubt)


LIMITS = {
    "min_fatigue_safety": lambda p, f: replace(
        p, requirements=replace(p.requirements, min_fatigue_safety=p.requirements.min_fatigue_safety * f)
    ),
    "min_stability_safety": lambda p, f: replace(
        p, requirements=replace(p.requirements, min_stability_safety=p.requirements.min_stability_safety * f)
    ),
    "max_contact_pressure": lambda p, f: replace(
        p, requirements=replace(p.requirements, max_contact_pressure=p.requirements.max_contact_pressure * f)
    ),
    "b_upper": lambda p, f: replace(p, bounds=replace(p.bounds, b=(p.bounds.b[0], p.bounds.b[1] * f))),
    "b_lower": lambda p, f: replace(p, bounds=replace(p.bounds, b=(p.bounds.b[0] * f, p.bounds.b[1]))),
    "l_upper": lambda p, f: replace(p, bounds=replace(p.bounds, l=(p.bounds.l[0], p.bounds.l[1] * f))),
    "l_lower": lambda p, f: replace(p, bounds=replace(p.bounds, l=(p.bounds.l[0] * f, p.bounds.l[1]))),
}


@pytest.mark.parametrize(
    "problem",
    [
        REFERENCE,
        replace(REFERENCE, requirements=rod.Requirements(2.5, 2.3)),
        replace(REFERENCE, requirements=rod.Requirements(2.3, 1.8, max_contact_pressure=3.6e4)),
        replace(REFERENCE, objective=rod.OBJECTIVES["stability_safety"]),
        replace(REFERENCE, objective=rod.OBJECTIVES["contact_pressure"], requirements=rod.Requirements(2.5, 1.8)),
        replace(REFERENCE, objective=rod.OBJECTIVES["fatigue_safety"], requirements=rod.Requirements(2.0, 2.5)),
    ],
    ids=lambda p: p.objective.name,
)
def test_sensitivities_are_what_solving_again_gives(problem):
    outcome = rod.design(problem, CORE, accuracy=1e-4)
    active = {a.name: a.sensitivity for a in outcome.value.active}
    assert active

    def value(p):
        return problem.objective.read(rod.design(p, CORE, accuracy=1e-4).value.check)

    step = 2e-4
    for name, sensitivity in active.items():
        move = LIMITS[name]
        change = np.log(value(move(problem, 1 + step)) / value(move(problem, 1 - step))) / np.log(
            (1 + step) / (1 - step)
        )
        assert sensitivity == pytest.approx(change, rel=2e-2, abs=2e-3), name


def test_a_tighter_limit_never_helps():
    costs = []
    for safety in (2.0, 2.3, 2.5, 2.6, 2.65, 2.68):
        problem = replace(REFERENCE, requirements=rod.Requirements(safety, 1.8))
        outcome = rod.design(problem, CORE)
        costs.append((bound_of(problem, outcome), cost_of(problem, outcome)))
    for (_, loose), (tight, _) in pairwise(costs):
        assert loose <= tight * (1 + 1e-6)


def test_effects_beyond_the_core_are_met_on_the_full_model():
    """With all effects the answer meets every requirement as the full check sees it, and says what its proof leaves."""
    outcome = rod.design(REFERENCE, rod.ALL)
    again = rod.check(REFERENCE.scene, outcome.value.check.dimensions, rod.ALL).value
    assert again.stresses.fatigue_safety >= 2.65 * (1 - 1e-9)
    assert again.stability_safety >= 1.8 * (1 - 1e-9)
    assert outcome.certificate.evidence["effects_beyond_the_core"]


@pytest.mark.parametrize("seed", [303, 358, 414, 919, 971])
def test_what_is_attainable_is_known_to_the_accuracy(seed):
    """Two requirements that clash or are both out of reach, of strips that ring, with free sizes or in steps; and one
    that is out of reach while others clash."""
    outcome = rod.design(realistic(seed))
    assert outcome.status is Status.INFEASIBLE and len(outcome.diagnosis) == (1 if seed == 414 else 2)
    assert outcome.accuracy.met


@pytest.mark.parametrize(
    ("name", "value"), [("min_stability_safety", 6.0), ("max_friction_power", 0.19), ("max_contact_pressure", 0.025e6)]
)
def test_a_conflict_is_named_where_all_sizes_are_discrete(name, value):
    """No size is continuous, so that no limit is active; each of the two requirements can be met without the other."""
    asked = replace(rod.Requirements(2.2, 1.8), **{name: value})
    stocked = replace(
        REFERENCE, requirements=asked, stock_h=(0.2e-3, 0.3e-3, 0.4e-3, 0.5e-3, 0.6e-3), step_b=0.5e-3, step_l=0.5e-3
    )
    outcome = rod.design(stocked)
    assert {entry.requirement for entry in outcome.diagnosis} == {"min_fatigue_safety", name}
    for entry in outcome.diagnosis:
        assert "can be met alone" in entry.advice
        eased = replace(
            asked, **{entry.requirement: entry.attainable * (0.999 if "min" in entry.requirement else 1.001)}
        )
        assert rod.design(replace(stocked, requirements=eased)).value is not None


def test_that_others_conflict_too_is_said_where_relaxing_one_does_not_suffice():
    asked = rod.Requirements(2.2, 5.0, max_contact_pressure=0.025e6, min_yield_safety=4.5)
    for entry in rod.design(replace(REFERENCE, requirements=asked)).diagnosis:
        eased = replace(
            asked, **{entry.requirement: entry.attainable * (0.999 if "min" in entry.requirement else 1.001)}
        )
        feasible = rod.design(replace(REFERENCE, requirements=eased)).value is not None
        assert feasible == ("relaxing this one does not suffice" not in entry.advice)


def test_what_the_core_s_best_strips_meet_beside_the_others_is_not_called_out_of_reach(monkeypatch):
    """The core meets none of three requirements alone, the full model two; a design takes 1 s to find that."""
    designed = []
    of = RequirementsAsObjectives.best

    def best(self, c, but=()):
        designed.append((c.name, frozenset({c, *but})))
        return of(self, c, but)

    monkeypatch.setattr(RequirementsAsObjectives, "best", best)
    outcome = rod.design(realistic(414))
    assert [entry.requirement for entry in outcome.diagnosis] == ["max_friction_power"]
    alone = {name for name, left_out in designed if len(left_out) == len(realistic(414).requirements.requested())}
    assert not alone


def test_no_problem_within_a_design_is_designed_for_twice(monkeypatch):
    """Designs for the same requirement begin with other effects here, and end with their own."""
    solved, of = [], _Design.attainable_best

    def attainable_best(self, effects, problem, suffices):
        best = of(self, effects, problem, suffices)
        solved.append((problem.objective.name, problem.requirements))
        return best

    monkeypatch.setattr(_Design, "attainable_best", attainable_best)
    rod.design(realistic(305))
    assert len(solved) == len(set(solved))
