"""Pareto fronts: every point is a separate design, and none dominates another."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest

from solvers import linkage
from solvers.errors import InvalidInput
from tests.solvers.linkage.machines import BREAKER, BREAKER_LIMITS, CLEANER, problem


def test_box_against_pin_force_over_all_types():
    asked = problem(BREAKER, BREAKER_LIMITS, "box_area")
    solved = []
    points = linkage.front(asked, "pin_force", 5, solved=lambda: solved.append(len(solved)))
    assert len(solved) == 5
    assert points[0].against == pytest.approx(261.0781, abs=1e-4)
    assert points[-1].objective * 1e6 == pytest.approx(1412.2836, abs=5e-5)
    for before, after in pairwise(points):
        assert before.against < after.against
        assert before.objective > after.objective
    kinds = [point.check.mechanism.bar.kind.name for point in points]
    assert (kinds[0], kinds[-1]) == ("largest_base", "largest_coupler")
    middle = points[2]
    held = replace(BREAKER_LIMITS, max_pin_force=middle.against)
    alone = linkage.design(problem(BREAKER, held, "box_area")).value
    assert middle.objective == pytest.approx(alone.value, rel=1e-4)


def test_where_both_agree_the_front_is_one_point():
    asked = problem(BREAKER, BREAKER_LIMITS, "box_area", "largest_coupler")
    (point,) = linkage.front(replace(asked, objective=linkage.OBJECTIVES["enclosing_radius"]), "longest_link", 2)[:1]
    assert point.against > 0
    assert linkage.front(problem(CLEANER, linkage.Limits(min_link=0.2), "box_area"), "pin_force", 3) == ()


@pytest.mark.parametrize(
    ("objective", "against", "points"),
    [("box_area", "box_area", 5), ("pin_force", "pin_force", 5), ("box_area", "pin_force", 1),
     ("box_area", "pin_force", 26)],
)  # fmt: skip
def test_questions_that_make_no_sense_are_refused(objective, against, points):
    with pytest.raises(InvalidInput):
        linkage.front(problem(BREAKER, BREAKER_LIMITS, objective), against, points)
