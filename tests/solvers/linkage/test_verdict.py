"""Verdicts on linkages: limits, the required speed, full rotation, ability to strike, and durability."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from solvers import linkage
from solvers.linkage.effects import NO_STEADY_RUNNING
from solvers.outcome import Accuracy
from tests.solvers.linkage.machines import BREAKER, BREAKER_LIMITS, CLEANER, CLEANER_LIMITS, problem

EXACT = Accuracy(1e-6, 1e-12)


def judged(mechanism, scene=CLEANER, limits=CLEANER_LIMITS, **given):
    outcome = linkage.check(scene, mechanism, limits)
    return linkage.judge(outcome.value, scene, outcome.accuracy, limits, linkage.Given(**given))


def of(verdict, name):
    return next(criterion for criterion in verdict.criteria if criterion.name == name)


def failing(verdict):
    return {criterion.name for criterion in verdict.criteria if not criterion.holds}


GOOD = linkage.of_ratio(CLEANER, linkage.LARGEST_BASE, 3.17356675)


def test_the_worked_example_holds():
    verdict = judged(GOOD)
    assert verdict.holds
    assert verdict.governing.name == "greatest_transmission_angle"
    assert verdict.governing.margin == pytest.approx(140.0 / 117.391837 - 1.0)


@pytest.mark.parametrize(
    ("limits", "name"),
    [
        ({"min_link": 50e-3}, "min_link"), ({"longest_link": 20e-3}, "longest_link"), ({"width": 30e-3}, "width"),
        ({"height": 20e-3}, "height"), ({"enclosing_radius": 20e-3}, "enclosing_radius"),
        ({"max_pin_force": 1.0}, "max_pin_force"),
        ({"transmission_angle": (math.radians(150), math.pi)}, "least_transmission_angle"),
        ({"transmission_angle": (0.0, math.radians(20))}, "greatest_transmission_angle"),
    ],
)  # fmt: skip
def test_every_limit_is_judged(limits, name):
    verdict = judged(GOOD, limits=replace(CLEANER_LIMITS, **limits))
    assert failing(verdict) == {name}
    assert verdict.governing.name == name and verdict.governing.margin < 0 and verdict.governing.asked


def test_what_does_not_turn_does_not_hold():
    verdict = judged(linkage.of_ratio(CLEANER, linkage.LARGEST_COUPLER, 1.0))
    assert {"turns_fully", "least_transmission_angle"} <= failing(verdict)
    assert verdict.governing.name == "turns_fully"


def test_lengths_that_miss_the_closure_do_not_strike():
    links = GOOD.lengths
    verdict = judged(linkage.of_lengths(linkage.Lengths(1.05 * links.base, links.crank, links.coupler, links.rocker)))
    assert "strikes" in failing(verdict)


def test_a_blow_of_another_speed_than_asked_and_one_that_no_part_stands():
    links = GOOD.lengths
    sizes = (links.base, links.crank, links.coupler, links.rocker)
    slow = judged(linkage.of_lengths(linkage.Lengths(*(0.8 * x for x in sizes))), limits=linkage.Limits())
    assert failing(slow) == {"impact_speed"}
    assert of(slow, "impact_speed").margin == pytest.approx(-0.2)
    hard = replace(CLEANER, impact_speed=12.0)
    fast = judged(linkage.of_ratio(hard, linkage.LARGEST_BASE, 3.17356675), scene=hard)
    assert failing(fast) == {"greatest_impact_speed"}
    assert not of(fast, "greatest_impact_speed").asked


def test_what_the_request_leaves_open_is_not_judged_and_a_limit_on_it_does_not_hold():
    limits = replace(CLEANER_LIMITS, width=1.0, max_pin_force=1e9)
    assert judged(GOOD, limits=limits).holds
    assert failing(judged(GOOD, limits=limits, size=False)) == {"min_link", "width", "max_pin_force"}
    assert failing(judged(GOOD, limits=limits, energy=False)) == {"max_pin_force"}
    unasked = judged(GOOD, speed=False)
    assert not any("speed" in criterion.name for criterion in unasked.criteria)


def test_a_coupler_that_gives_way_is_judged_by_the_pin_force():
    scene = replace(CLEANER, restitution=linkage.Restitution(0.2, 0.4), coupler_stiffness=1e8)
    rigid = linkage.check(scene, GOOD).value.strike.peaks.force
    verdict = judged(GOOD, scene, replace(CLEANER_LIMITS, max_pin_force=1.01 * rigid))
    assert failing(verdict) == {"coupler_peak"}


def test_a_motor_that_stalls_or_is_too_weak_for_the_speed_required_does_not_hold():
    driven = replace(CLEANER, drive=linkage.Drive(5.0, 2 * math.pi * 27, 2e-3))
    outcome = linkage.check(driven, GOOD)
    assert linkage.judge(outcome.value, driven, EXACT, CLEANER_LIMITS).holds
    stalled = replace(outcome.value, running=None, warnings=(NO_STEADY_RUNNING,))
    assert failing(linkage.judge(stalled, driven, EXACT, CLEANER_LIMITS)) == {"runs_steadily"}
    driven = replace(driven, drive=linkage.Drive(1e-3, 2 * math.pi * 25, 1e-4))
    weak = judged(GOOD, driven)
    assert failing(weak) == {"runs_steadily"}
    assert any("with this motor the tool strikes at" in text for text in weak.cautions)
    assert judged(GOOD, driven, speed_asked=False).holds


@pytest.mark.parametrize("objective", ["box_area", "longest_link", "pin_force"])
def test_designs_on_their_limits_hold(objective):
    asked = problem(BREAKER, BREAKER_LIMITS, objective)
    outcome = linkage.design(asked)
    assert linkage.judge(outcome.value.check, outcome.value.scene, outcome.accuracy, BREAKER_LIMITS).holds
    tight = replace(BREAKER_LIMITS, longest_link=1.05 * outcome.value.check.mechanism.lengths.base)
    squeezed = linkage.design(replace(asked, limits=tight))
    if squeezed.value is not None:
        assert linkage.judge(squeezed.value.check, squeezed.value.scene, EXACT, tight).holds
