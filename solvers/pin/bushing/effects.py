"""The effects of a bushing: the pin's, but for the bound on shear, which no given size of the outside limits."""

from __future__ import annotations

from dataclasses import dataclass

from solvers.effects import AUTO, Choice, EffectSelection, choose
from solvers.pin.bushing.scene import BushingScene
from solvers.pin.effects import ContactPressure, Ovalization, PinEffect, ShearDeflection, demands_of
from solvers.pin.limits import Limits


@dataclass(frozen=True)
class BushingShear(ShearDeflection):
    """Shear's part grows with the outside, which is what is sought: up to all of the deflection."""

    measure: str = "1: its share of the deflection has no bound before the outside is known"

    def influence(self, situation: object) -> float:
        return 1.0


EFFECTS: tuple[PinEffect, ...] = (BushingShear(), Ovalization(), ContactPressure())


def choose_for(
    scene: BushingScene, limits: Limits, selection: EffectSelection = AUTO, tolerance: float = 1e-2
) -> Choice[PinEffect]:
    """The effects for a bushing (see ``solvers.effects.choose``)."""
    return choose(EFFECTS, scene, selection, tolerance, demands_of(limits))
