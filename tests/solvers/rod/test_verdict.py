"""Verdicts on strips: their requirements, and those that any strip must meet."""

from __future__ import annotations

from dataclasses import replace

import pytest

from solvers import rod
from tests.solvers.rod.machines import PAPER, STRIP


def judged(dimensions=STRIP, scene=PAPER, accuracy=1e-6, **required):
    outcome = rod.check(scene, dimensions, accuracy=accuracy)
    asked = rod.Requirements(**required) if required else None
    return rod.judge(outcome.value, outcome.accuracy, asked), outcome.value


def test_a_check_is_judged_by_three_safeties_of_one():
    verdict, check = judged()
    assert [(c.name, c.required, c.asked) for c in verdict.criteria] == [
        ("stability_safety", 1.0, False), ("fatigue_safety", 1.0, False), ("yield_safety", 1.0, False),
    ]  # fmt: skip
    assert [c.reached for c in verdict.criteria] == [
        check.stability_safety, check.stresses.fatigue_safety, check.stresses.yield_safety,
    ]  # fmt: skip
    assert verdict.holds and verdict.governing.name == "stability_safety"


def test_a_buckled_strip_does_not_hold_and_nothing_else_is_known_of_it():
    verdict, _ = judged(replace(STRIP, h=0.1e-3), min_fatigue_safety=2.0, min_stability_safety=1.5)
    assert not verdict.holds
    assert verdict.governing.name == "min_stability_safety"
    assert verdict.governing.margin == pytest.approx(0.0195 / 1.5 - 1.0, abs=1e-3)
    assert {c.name: (c.reached, c.holds) for c in verdict.criteria[:1]} == {"min_fatigue_safety": (None, False)}


def test_a_strip_that_only_friction_buckles_does_not_hold():
    """Its safety is reported as 1, because the maximum compression reached is the critical force."""
    outcome = rod.check(PAPER, STRIP)
    verdict = rod.judge(replace(outcome.value, stability_safety=1.0, stresses=None), outcome.accuracy)
    assert not any(criterion.holds for criterion in verdict.criteria)
    assert verdict.governing.name == "stability_safety" and verdict.governing.margin < 0.0


def test_a_requirement_replaces_the_safety_of_one_unless_it_asks_for_less():
    asked, _ = judged(min_fatigue_safety=2.0, min_stability_safety=1.8, max_contact_pressure=1e6)
    assert [c.name for c in asked.criteria] == [
        "min_fatigue_safety", "min_stability_safety", "max_contact_pressure", "yield_safety",
    ]  # fmt: skip
    less, _ = judged(min_fatigue_safety=0.5, min_stability_safety=1.8)
    assert [(c.name, c.asked) for c in less.criteria] == [
        ("min_fatigue_safety", True), ("min_stability_safety", True),
        ("fatigue_safety", False), ("yield_safety", False),
    ]  # fmt: skip


def test_a_strip_that_tires_does_not_hold_though_less_was_asked():
    weak = replace(PAPER, material=replace(PAPER.material, fatigue_limit=120e6))
    verdict, check = judged(scene=weak, min_fatigue_safety=0.5, min_stability_safety=1.0)
    assert 0.5 < check.stresses.fatigue_safety < 1.0
    assert not verdict.holds and verdict.governing.name == "fatigue_safety"


@pytest.mark.parametrize("accuracy", [1e-2, 1e-4])
def test_a_design_on_its_limits_holds(accuracy):
    requirements = rod.Requirements(2.65, 1.8)
    problem = rod.RodProblem(
        PAPER, rod.Bounds((4e-3, 9e-3), (0.2e-3, 1e-3), (8e-3, 26e-3)), requirements, rod.OBJECTIVES["mass"]
    )
    outcome = rod.design(problem, accuracy=accuracy)
    verdict = rod.judge(outcome.value.check, outcome.accuracy, requirements)
    assert verdict.holds
    assert 0.0 <= verdict.governing.margin < accuracy


def test_an_effect_left_out_that_matters_is_a_caution_and_one_that_does_not_is_none():
    without = rod.EffectSelection(exclude=frozenset({"friction_feedback", "friction"}))
    fast = replace(PAPER, piston=replace(PAPER.piston, friction_coefficient=0.3))
    outcome = rod.check(fast, STRIP, without)
    told = rod.judge(outcome.value, outcome.accuracy, effects=outcome.effects).cautions
    matters = {e.name for e in outcome.effects if e.state == "skipped" and e.influence > 0.01} - {"friction"}
    assert "friction_feedback" in matters
    assert {text.split()[2] for text in told} == matters
    assert (
        rod.judge(rod.check(PAPER, STRIP).value, outcome.accuracy, effects=rod.check(PAPER, STRIP).effects).cautions
        == ()
    )
