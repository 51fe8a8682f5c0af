"""Many cycles analysed in one call: the numbers of ``analyse``, by the same kernels.

Scenes that differ in speed or masses alone, as in a sweep, share their unrolled pressures. What stands over the angle
is computed for none that is not read.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from solvers.crank.check import SERIES_ANGLES, CrankDynamics, Unroll, analyse, analyse_unrolled
from solvers.crank.scene import Scene
from solvers.effects import AUTO, EffectSelection
from solvers.errors import InvalidInput
from solvers.outcome import Outcome


@dataclass(frozen=True)
class Case:
    """One analysis as ``analyse`` would be asked for it."""

    scene: Scene
    effects: EffectSelection = AUTO
    effect_tolerance: float = 1e-2
    accuracy: float = 1e-6
    series_angles: int = SERIES_ANGLES

    def alone(self) -> Outcome[CrankDynamics]:
        """The single analysis."""
        return analyse(self.scene, self.effects, self.effect_tolerance, self.accuracy, self.series_angles)


def analyse_many(cases: Iterable[Case]) -> list[Outcome[CrankDynamics] | InvalidInput]:
    """An outcome for every case, in their order; in the place of one that makes no sense, what is wrong with it."""
    known, found = Unroll(), []
    for case in cases:
        try:
            found.append(
                analyse_unrolled(
                    case.scene, known, case.effects, case.effect_tolerance, case.accuracy, case.series_angles
                )
            )
        except InvalidInput as refusal:
            found.append(refusal)
    return found
