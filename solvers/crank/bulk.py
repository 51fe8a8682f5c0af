"""Batch analysis of cycles: ``analyse`` for each."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from solvers.crank.check import SERIES_ANGLES, CrankDynamics, analyse
from solvers.crank.scene import Scene
from solvers.effects import AUTO, EffectSelection
from solvers.errors import InvalidInput
from solvers.outcome import Outcome


@dataclass(frozen=True)
class Case:
    """The arguments of one ``analyse``."""

    scene: Scene
    effects: EffectSelection = AUTO
    effect_tolerance: float = 1e-2
    accuracy: float = 1e-6
    series_angles: int = SERIES_ANGLES

    def evaluate(self) -> Outcome[CrankDynamics]:
        """Run this analysis on its own."""
        return analyse(self.scene, self.effects, self.effect_tolerance, self.accuracy, self.series_angles)


def analyse_many(cases: Iterable[Case]) -> list[Outcome[CrankDynamics] | InvalidInput]:
    """Return one outcome per case, in input order; an invalid case yields its InvalidInput."""
    found: list[Outcome[CrankDynamics] | InvalidInput] = []
    for case in cases:
        try:
            found.append(case.evaluate())
        except InvalidInput as refusal:
            found.append(refusal)
    return found
