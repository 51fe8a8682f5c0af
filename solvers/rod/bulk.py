"""Checks of many strips, each with its own scene and settings."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from solvers.effects import AUTO, Demand, EffectSelection
from solvers.errors import InvalidInput
from solvers.fatigue import FatigueCriterion
from solvers.outcome import Outcome
from solvers.rod.check import RodCheck, check
from solvers.rod.scene import Dimensions, Scene


class Case(NamedTuple):
    """Arguments of one call of ``check``."""

    scene: Scene
    dimensions: Dimensions
    effects: EffectSelection = AUTO
    effect_tolerance: float = 1e-2
    accuracy: float = 1e-6
    criterion: FatigueCriterion | None = None
    demands: tuple[Demand, ...] = ()

    def evaluate(self) -> Outcome[RodCheck]:
        """Evaluate this case by ``check``."""
        return check(*self)


def check_many(cases: Iterable[Case]) -> list[Outcome[RodCheck] | InvalidInput]:
    """Outcomes of all cases, in order; for an invalid case its InvalidInput."""
    found: list[Outcome[RodCheck] | InvalidInput] = []
    for case in cases:
        try:
            found.append(case.evaluate())
        except InvalidInput as refusal:
            found.append(refusal)
    return found
