"""Batch evaluation of crank cycles: ``analyse`` for each."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from solvers.crank.check import SERIES_ANGLES, CrankDynamics, analyse
from solvers.crank.scene import Scene
from solvers.effects import AUTO, EffectSelection
from solvers.errors import InvalidInput
from solvers.outcome import Outcome, evaluated


class Case(NamedTuple):
    """Arguments of one call of ``analyse``."""

    scene: Scene
    effects: EffectSelection = AUTO
    effect_tolerance: float = 1e-2
    accuracy: float = 1e-6
    series_angles: int = SERIES_ANGLES

    def evaluate(self) -> Outcome[CrankDynamics]:
        return analyse(*self)


def analyse_many(cases: Iterable[Case]) -> list[Outcome[CrankDynamics] | InvalidInput]:
    """Outcomes of all cases, in order; for an invalid case its InvalidInput."""
    return evaluated(cases)
