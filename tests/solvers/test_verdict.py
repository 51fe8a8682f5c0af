"""Criteria: result, margin, and the governing one."""

from __future__ import annotations

import math

import pytest

from solvers.outcome import Accuracy
from solvers.verdict import MAX_SLACK, Sense, Verdict, at_least, at_most, equal, per_cent, slack_of, unknown, yes

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
def test_criteria_against_their_requirements(criterion, holds, margin):
    assert criterion.holds is holds
    assert criterion.margin == (margin if margin is None else pytest.approx(margin))


@pytest.mark.parametrize("judged", [at_least, at_most])
def test_a_value_at_its_limit_holds_with_zero_margin(judged):
    sign = -1.0 if judged is at_least else 1.0
    within, beyond = (judged("n", 2.65, 2.65 * (1.0 + sign * off), SLACK) for off in (0.9e-6, 1.2e-6))
    assert (within.holds, within.margin) == (True, 0.0)
    assert not beyond.holds and beyond.margin < 0.0


def test_the_slack_is_the_requested_accuracy_up_to_a_maximum():
    assert slack_of(Accuracy(1e-9, 0.3)) == 1e-9
    assert slack_of(Accuracy(0.1, 1e-12)) == MAX_SLACK


def test_the_governing_criterion():
    tight, ample = at_least("tight", 1.0, 1.1, SLACK), at_most("ample", 1.0, 0.2, SLACK)
    idle, dark = at_least("idle", 1.0, None, SLACK), unknown("dark", Sense.AT_MOST, 1.0)
    bad, worse = at_least("bad", 1.0, 0.9, SLACK), at_most("worse", 1.0, 3.0, SLACK)
    assert Verdict((idle, ample, tight)).governing is tight
    assert Verdict((idle, ample, tight, dark)).governing is dark
    assert Verdict((dark, bad, tight, worse)).governing is worse
    assert Verdict((idle,)).governing is None
    assert Verdict((idle, ample, tight)).holds and not Verdict((tight, dark)).holds


@pytest.mark.parametrize(("share", "said"), [(1.2e-5, "0.0012"), (3e-8, "3e-6"), (0.0472, "4.7"), (2.5, "250")])
def test_shares_in_messages_have_no_padded_exponent(share, said):
    assert per_cent(share) == said
