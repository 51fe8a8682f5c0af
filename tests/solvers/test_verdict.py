"""Criteria: what holds, by how much, and which governs."""

from __future__ import annotations

import math

import pytest

from solvers.outcome import Accuracy
from solvers.verdict import MAX_SLACK, Sense, Verdict, at_least, at_most, equal, slack_of, unknown, yes

SLACK = 1e-6


@pytest.mark.parametrize(
    ("criterion", "holds", "margin"),
    [
        (at_least("n", 2.0, 3.0, SLACK), True, 0.5),
        (at_least("n", 2.0, 1.0, SLACK), False, -0.5),
        (at_least("n", 2.0, None, SLACK), True, None),
        (at_least("n", 0.0, 1.0, SLACK), True, None),
        (at_most("s", 150.0, 100.0, SLACK), True, 0.5),
        (at_most("s", 150.0, 300.0, SLACK), False, -0.5),
        (at_most("s", 150.0, math.inf, SLACK), False, -1.0),
        (at_most("s", 150.0, 0.0, SLACK), True, None),
        (equal("v", 5.0, 5.004, 1e-3), True, None),
        (equal("v", 5.0, 4.0, 1e-3), False, -0.2),
        (yes("turns", True), True, None),
        (yes("turns", False), False, -1.0),
        (unknown("w", Sense.AT_MOST, 1.0), False, None),
    ],
)
def test_a_figure_beside_what_is_required(criterion, holds, margin):
    assert criterion.holds is holds
    assert criterion.margin == (margin if margin is None else pytest.approx(margin))


@pytest.mark.parametrize("judged", [at_least, at_most])
def test_a_figure_on_its_limit_holds_within_the_slack_and_has_nothing_to_spare(judged):
    sign = -1.0 if judged is at_least else 1.0
    within, beyond = (judged("n", 2.65, 2.65 * (1.0 + sign * off), SLACK) for off in (0.9e-6, 1.2e-6))
    assert (within.holds, within.margin) == (True, 0.0)
    assert not beyond.holds and beyond.margin < 0.0


def test_the_slack_is_the_accuracy_asked_for_unless_that_is_loose():
    assert slack_of(Accuracy(1e-9, 0.3)) == 1e-9
    assert slack_of(Accuracy(0.1, 1e-12)) == MAX_SLACK


def test_what_fails_most_governs_then_what_is_not_known_then_what_has_least_to_spare():
    tight, ample = at_least("tight", 1.0, 1.1, SLACK), at_most("ample", 1.0, 0.2, SLACK)
    idle, dark = at_least("idle", 1.0, None, SLACK), unknown("dark", Sense.AT_MOST, 1.0)
    bad, worse = at_least("bad", 1.0, 0.9, SLACK), at_most("worse", 1.0, 3.0, SLACK)
    assert Verdict((idle, ample, tight)).governing is tight
    assert Verdict((idle, ample, tight, dark)).governing is dark
    assert Verdict((dark, bad, tight, worse)).governing is worse
    assert Verdict((idle,)).governing is None
    assert Verdict((idle, ample, tight)).holds and not Verdict((tight, dark)).holds
