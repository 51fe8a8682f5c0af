"""Strips beside an answer."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from oracles.rivals.rod import log_cost, settled
from solvers import rod


def assert_none_beside_is_better(
    asked: rod.RodProblem, beside: Callable[[rod.Dimensions], Iterable[rod.Dimensions]]
) -> None:
    """The problem's answer is exact: no strip beside it that meets the requirements costs less."""
    found = rod.design(asked)
    assert found.accuracy.met
    best, effects = found.value.check.dimensions, settled(found.effects)
    assert "rod_inertia" in effects.include
    own = log_cost(asked, found.value.check)
    for strip in beside(best):
        other = rod.check(asked.scene, strip, effects, accuracy=1e-7).value
        if asked.requirements.met_by(other):
            assert log_cost(asked, other) > own - found.accuracy.estimated
