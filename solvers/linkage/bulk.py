"""Batch evaluation of linkages: ``check`` for each."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from solvers.effects import AUTO, Demand, EffectSelection
from solvers.errors import InvalidInput
from solvers.linkage.check import NO_LIMITS, check
from solvers.linkage.limits import Limits
from solvers.linkage.mechanism.lengths import Mechanism
from solvers.linkage.result import LinkageCheck
from solvers.linkage.scene import Scene
from solvers.outcome import Outcome, evaluated


class Case(NamedTuple):
    """Arguments of one call of ``check``."""

    scene: Scene
    mechanism: Mechanism
    limits: Limits = NO_LIMITS
    effects: EffectSelection = AUTO
    effect_tolerance: float = 1e-2
    accuracy: float = 1e-6
    demands: tuple[Demand, ...] = ()

    def evaluate(self) -> Outcome[LinkageCheck]:
        return check(*self)


def check_many(cases: Iterable[Case]) -> list[Outcome[LinkageCheck] | InvalidInput]:
    """Outcomes of all cases, in order; for an invalid case its InvalidInput."""
    return evaluated(cases)
