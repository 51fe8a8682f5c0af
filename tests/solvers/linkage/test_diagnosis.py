"""Limits that no linkage meets: which are named, what is attainable, and what would help."""

from __future__ import annotations

from dataclasses import replace

import pytest

from solvers import linkage
from solvers.linkage.limits import Limits
from solvers.linkage.optimum import infeasibility
from solvers.linkage.optimum.branch_and_bound import search_all
from tests.solvers.linkage.machines import BREAKER, designed, problem


@pytest.mark.parametrize(
    ("limits", "requirement"),
    [
        (Limits(min_link=8e-3, longest_link=0.016), "longest_link"),
        (Limits(min_link=8e-3, joint_radius=6e-3, enclosing_radius=0.02), "enclosing_radius"),
        (Limits(min_link=0.2), "min_link"),
        (Limits(max_pin_force=100.0), "max_pin_force"),
        (Limits(min_link=8e-3, joint_radius=6e-3, width=0.04, height=0.03), "width"),
    ],
)
def test_an_impossible_limit_is_diagnosed_by_its_best_value(limits, requirement):
    outcome = designed(BREAKER, limits, "longest_link")
    assert outcome.value is None
    entry = next(e for e in outcome.diagnosis if e.requirement == requirement)
    assert "closest with the" in entry.advice
    # Beside the other limits the best value can be reached, but not one that is 1 % better.
    better = -1 if requirement == "min_link" else 1
    for share, there in ((1e-3, True), (-1e-2, False)):
        asked = {requirement: entry.attainable * (1 + better * share)}
        if requirement == "width":
            height = next(e for e in outcome.diagnosis if e.requirement == "height")
            asked["height"] = height.attainable * (1 + share)
        feasible = designed(BREAKER, replace(limits, **asked), "longest_link").value is not None
        assert feasible == there, (requirement, asked)


TOOLED = replace(BREAKER, tool_radius=0.2)
PADDED = Limits(min_link=8e-3, joint_radius=6e-3)
REMEDIES = {
    "higher blow frequency": lambda p: of_scene(p, blow_frequency=1.1 * p.scene.blow_frequency),
    "lower blow frequency": lambda p: of_scene(p, blow_frequency=p.scene.blow_frequency / 1.1),
    "higher impact speed": lambda p: of_scene(p, impact_speed=1.1 * p.scene.impact_speed),
    "lower impact speed": lambda p: of_scene(p, impact_speed=p.scene.impact_speed / 1.1),
    "lower impact energy": lambda p: of_scene(p, impact_energy=p.scene.impact_energy / 1.1),
    "minimum link length": lambda p: of_limits(p, min_link=p.limits.min_link / 1.1),
    "smaller joints": lambda p: of_limits(p, joint_radius=p.limits.joint_radius / 1.1),
}
"""What an advice may name, as a change by a tenth."""
SIZES = "longest_link", "width", "height", "enclosing_radius"


def of_scene(asked, **changes):
    return replace(asked, scene=replace(asked.scene, **changes))


def of_limits(asked, **changes):
    return replace(asked, limits=replace(asked.limits, **changes))


@pytest.mark.parametrize(
    ("scene", "limits", "objective", "named"),
    [
        (BREAKER, replace(PADDED, longest_link=0.016), "box_area", {"higher blow frequency", "lower impact speed"}),
        (BREAKER, replace(PADDED, enclosing_radius=0.02), "box_area",
         {"higher blow frequency", "lower impact speed", "smaller joints"}),
        (BREAKER, Limits(min_link=0.2), "box_area", {"lower blow frequency", "higher impact speed"}),
        (BREAKER, Limits(max_pin_force=100.0), "longest_link",
         {"lower blow frequency", "higher impact speed", "lower impact energy"}),
        (BREAKER, replace(PADDED, width=0.25, height=0.15, max_pin_force=10.0), "box_area",
         {"lower blow frequency", "higher impact speed", "lower impact energy"}),
        (BREAKER, replace(PADDED, width=0.25, height=0.15, min_link=0.3), "box_area",
         {"lower blow frequency", "higher impact speed"}),
        # Where speed or frequency is the objective, neither fixes the size.
        (BREAKER, replace(PADDED, enclosing_radius=0.02), "impact_speed", {"minimum link length", "smaller joints"}),
        (BREAKER, replace(PADDED, enclosing_radius=0.02), "blow_frequency", {"minimum link length", "smaller joints"}),
        (BREAKER, replace(PADDED, longest_link=0.01), "impact_speed", {"minimum link length"}),
        (BREAKER, Limits(min_link=8e-3, width=0.02, height=0.02), "impact_speed", {"minimum link length"}),
        (TOOLED, replace(PADDED, enclosing_radius=0.02), "box_area", {"minimum link length", "smaller joints"}),
        (BREAKER, replace(PADDED, enclosing_radius=0.04, max_pin_force=100.0), "impact_speed",
         {"smaller joints", "lower impact energy"}),
        (BREAKER, Limits(min_link=8e-3, longest_link=0.05, max_pin_force=1000.0), "longest_link",
         {"lower impact energy"}),
    ],
)  # fmt: skip
def test_what_an_advice_names_brings_the_limit_closer(scene, limits, objective, named):
    asked = problem(scene, limits, objective)
    diagnosis = linkage.design(asked).diagnosis
    for entry in diagnosis:
        assert {remedy for remedy in REMEDIES if remedy in entry.advice} == named
        assert ("looser other limits" in entry.advice) == (len(diagnosis) > 2)
        sign = -1 if entry.requirement == "min_link" else 1
        room = 1.5 if "looser limits on the size" in entry.advice else 1.0
        eased = of_limits(asked, **{n: room * v for n in SIZES if (v := getattr(limits, n)) is not None})
        for remedy in named:
            later = {each.requirement: each for each in linkage.design(REMEDIES[remedy](eased)).diagnosis}
            if entry.attainable is not None and entry.requirement in later:
                assert sign * later[entry.requirement].attainable < sign * entry.attainable * (1.0 - sign * 1e-3)


def test_a_limit_out_of_reach_beside_others_that_clash_is_named_with_them():
    limits = Limits(min_link=8e-3, longest_link=0.05, max_pin_force=1000.0, enclosing_radius=5e-3)
    entries = {e.requirement: e for e in designed(BREAKER, limits, "longest_link").diagnosis}
    assert set(entries) == {"enclosing_radius", "min_link", "longest_link", "max_pin_force"}
    assert [name for name, e in entries.items() if "even alone" in e.advice] == ["enclosing_radius"]


def test_a_diagnosis_is_as_accurate_as_the_linkages_it_names():
    outcome = designed(BREAKER, Limits(min_link=0.2), "longest_link", accuracy=1e-9)
    assert outcome.value is None
    assert outcome.accuracy.met
    (entry,) = outcome.diagnosis
    met = designed(BREAKER, Limits(min_link=entry.attainable * (1.0 - 1e-9)), "longest_link")
    assert met.value is not None
    assert designed(BREAKER, Limits(min_link=entry.attainable * (1.0 + 1e-9)), "longest_link").value is None


def test_limits_that_only_clash_with_each_other_are_named():
    limits = Limits(min_link=8e-3, longest_link=0.05, max_pin_force=1000.0)
    outcome = designed(BREAKER, limits, "longest_link")
    assert outcome.value is None
    assert {e.requirement for e in outcome.diagnosis} == {"min_link", "longest_link", "max_pin_force"}
    assert not any("even alone" in e.advice for e in outcome.diagnosis)


@pytest.mark.parametrize("speed", [1.0, 8.0])
@pytest.mark.parametrize(("limit", "value"), [("longest_link", 12e-3), ("enclosing_radius", 16e-3), ("height", 16e-3)])
def test_what_is_attainable_does_not_depend_on_the_speed_that_is_sought(limit, value, speed):
    scene = replace(BREAKER, impact_speed=speed)
    asked = Limits(**{"min_link": 8e-3, "joint_radius": 6e-3, limit: value})
    (entry,) = designed(scene, asked, "impact_speed").diagnosis
    assert entry.requirement == limit
    pad = 2 * asked.joint_radius if limit == "height" else 0.0
    for factor, attained in ((1 + 1e-6, True), (0.98, False)):
        eased = replace(asked, **{limit: pad + (entry.attainable - pad) * factor})
        assert (designed(scene, eased, "impact_speed").value is not None) == attained


def test_of_two_sides_only_the_one_out_of_reach_is_reported():
    (entry,) = designed(BREAKER, Limits(joint_radius=6e-3, width=29e-3, height=0.15), "longest_link").diagnosis
    assert entry.requirement == "width"
    assert designed(BREAKER, Limits(joint_radius=6e-3, height=0.15), "longest_link").value is not None
    both = designed(BREAKER, Limits(joint_radius=6e-3, width=20e-3, height=20e-3), "longest_link").diagnosis
    assert {entry.requirement for entry in both} == {"width", "height"}


def searches_of(limits, monkeypatch):
    """Objective and number of ranges of every search for the diagnosis of a breaker's largest base."""
    sought = []

    def recorded(problem, gap):
        found = search_all(problem, gap)
        sought.extend((problem.objective.name, each.cells) for each in found)
        return found

    monkeypatch.setattr(infeasibility, "search_all", recorded)
    assert designed(BREAKER, limits, "longest_link", "largest_base").diagnosis
    return sought


def test_the_least_width_is_sought_once_for_both_sides_of_the_box(monkeypatch):
    sought = searches_of(Limits(min_link=8e-3, width=21e-3, height=20e-3), monkeypatch)
    assert [name for name, _ in sought] == ["min_link", "fit", "side"]


def test_of_a_limit_that_is_met_it_is_not_asked_by_how_much(monkeypatch):
    sought = searches_of(Limits(longest_link=0.05, width=0.3, max_pin_force=1e4), monkeypatch)
    assert [name for name, _ in sought] == ["longest_link", "pin_force", "side"]
    assert max(cells for _, cells in sought) < 100


@pytest.mark.parametrize(("objective", "other"), [("box_area", 0.042), ("impact_speed", 0.033)])
@pytest.mark.parametrize("short", ["width", "height"])
def test_a_side_out_of_reach_is_attainable_in_the_orientation_that_the_other_one_needs(objective, other, short):
    asked = Limits(**{"min_link": 8e-3, "joint_radius": 6e-3, "width": other, "height": other, short: 0.018})
    (entry,) = designed(BREAKER, asked, objective).diagnosis
    assert entry.requirement == short
    for share, attained in ((1.0, True), (0.998, False)):
        eased = replace(asked, **{short: entry.attainable * share})
        assert (designed(BREAKER, eased, objective).value is not None) == attained
