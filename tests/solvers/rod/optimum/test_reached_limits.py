"""Requirements that leave no room: each is exactly what a known strip reaches."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bench.rod_problems import problem as realistic
from solvers import rod
from solvers.outcome import EffectState, Status
from solvers.rod.constraints import CONSTRAINTS
from solvers.rod.optimum.search import continuous_sizes
from tests.solvers.rod.machines import CORE
from tests.solvers.rod.test_design import REFERENCE

ACCURACY = 1e-6


def reached(check):
    """All results that can be limited, as requirements."""
    return rod.Requirements(**{c.name: c.result.read(check) for c in CONSTRAINTS})


def active(outcome):
    return {effect.name for effect in outcome.effects if effect.state is EffectState.ACTIVE}


@pytest.mark.parametrize(
    "seed", [3003, 3005, 3019, 3010, 3016], ids=["side force", "stability", "on the core", "in steps", "rings"]
)
def test_what_an_answer_reaches_may_be_asked_for(seed):
    """Three limits meet in one strip, and no other meets them all: a search that keeps a distance finds none."""
    asked = realistic(seed)
    known = rod.design(asked).value.check
    again = rod.design(replace(asked, requirements=reached(known)), accuracy=ACCURACY)
    assert again.status is Status.SUCCEEDED
    assert reached(known).relaxed(ACCURACY).met_by(again.value.check)
    assert rod.judge(again.value.check, again.accuracy, reached(known)).holds
    worse = asked.objective.log_cost(again.value.check, asked.scene) - asked.objective.log_cost(known, asked.scene)
    assert worse <= again.accuracy.estimated <= ACCURACY


@pytest.mark.parametrize("beyond, found", [(0.0, True), (1e-5, False), (1e-4, False)])
def test_only_what_the_accuracy_does_not_resolve_is_given_way(beyond, found):
    """The greatest safety is proven on the core."""
    safest = rod.design(replace(REFERENCE, objective=rod.OBJECTIVES["fatigue_safety"]), CORE).value.check
    least = safest.stresses.fatigue_safety * (1.0 + beyond)
    asked = replace(REFERENCE, requirements=replace(REFERENCE.requirements, min_fatigue_safety=least))
    assert (rod.design(asked, CORE).status is Status.SUCCEEDED) is found


@pytest.mark.parametrize("seed", [2060, 2108], ids=["to rounding", "to within the accuracy"])
def test_other_gaps_are_searched_once_where_a_safety_is_lowered_to_what_is_attainable(seed, monkeypatch):
    """The design for the safety has searched all gaps between resonances: no other one leaves room for a strip."""
    asked, gaps = realistic(seed), 0
    (entry,) = rod.design(asked).diagnosis
    search = continuous_sizes.search_other_gaps

    def counted(*given):
        nonlocal gaps
        gaps += 1
        return search(*given)

    monkeypatch.setattr(continuous_sizes, "search_other_gaps", counted)
    lowered = replace(asked.requirements, min_fatigue_safety=entry.attainable)
    again = rod.design(replace(asked, requirements=lowered))
    assert gaps == 1
    assert again.accuracy.estimated < 1e-5
    assert lowered.relaxed(ACCURACY).met_by(again.value.check)
    assert "another may be deeper" in again.certificate.evidence["optimality"]


@pytest.mark.parametrize("sizes", ["all from below", "its length"])
def test_an_answer_does_not_depend_on_the_way_to_it(sizes):
    """With bounds set to sizes of the answer the core has another optimum, which selects effects that the answer does
    not need."""
    asked = realistic(3020)
    answer = rod.design(asked)
    d, b = answer.value.check.dimensions, asked.bounds
    bounds = {
        "all from below": rod.Bounds((d.b, b.b[1]), (d.h, b.h[1]), (d.l, b.l[1])),
        "its length": replace(b, l=(d.l, d.l)),
    }[sizes]
    again = rod.design(replace(asked, bounds=bounds))
    assert active(again) == active(answer)
    found, known = (asked.objective.log_cost(o.value.check, asked.scene) for o in (again, answer))
    assert found == pytest.approx(known, abs=again.accuracy.estimated + answer.accuracy.estimated)
