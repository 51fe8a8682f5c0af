"""Effects of the flexible rod, each with an a-priori bound.

Every bound is a first-order closed-form evaluation of the effect, times a margin
(``solvers.rod.effect_bounds.first_order``).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Protocol

from solvers.effects import AUTO, Choice, Demand, EffectSelection, choose
from solvers.rod.cycle.composition import BEAM_COLUMN, PLAIN_BENDING, Composition
from solvers.rod.cycle.large_displacement import LargeDisplacement
from solvers.rod.effect_bounds import first_order
from solvers.rod.effect_bounds.situation import Situation
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.vibration.steady_response import RodInertia


class RodEffect(Protocol):
    """An effect of the flexible rod: description, influence bound, and contribution to the composition."""

    name: str
    summary: str
    measure: str

    def influence(self, situation: Situation) -> float: ...

    def join(self, composition: Composition) -> Composition: ...


@dataclass(frozen=True)
class ReciprocatingInertia:
    name: str = "reciprocating_inertia"
    summary: str = "inertia of the reciprocating mass in the axial force"
    measure: str = "greatest relative change of the main results without the mass, times a margin"

    def influence(self, situation: Situation) -> float:
        return first_order.reciprocating_inertia(situation)

    def join(self, composition: Composition) -> Composition:
        return _with(composition, moving=(*composition.moving, self))

    def mass(self, scene: Scene) -> float:
        return scene.piston.reciprocating_mass


@dataclass(frozen=True)
class BeamColumnEffect:
    name: str = "beam_column"
    summary: str = "the axial force stiffens (tension) or softens (compression) the strip"
    measure: str = "greatest relative change of the main results in plain bending, times a margin"

    def influence(self, situation: Situation) -> float:
        return first_order.beam_column(situation)

    def join(self, composition: Composition) -> Composition:
        return _with(composition, beam=BEAM_COLUMN)


@dataclass(frozen=True)
class FrictionEffect:
    """Contact and friction results, which require this effect; it changes no other result, so its bound is 0 or 1."""

    name: str = "friction"
    summary: str = "contact pressure of the skirt and friction power"
    measure: str = "1: its results exist only when it runs"

    def influence(self, situation: Situation) -> float:
        return 1.0

    def join(self, composition: Composition) -> Composition:
        return composition


@dataclass(frozen=True)
class RodInertiaEffect:
    name: str = "rod_inertia"
    summary: str = "transverse inertia of the strip, with all harmonics of the axial force"
    measure: str = (
        "greatest relative change of the main results by the motion that follows the load and by what the first mode "
        "rings with, times a margin"
    )

    def influence(self, situation: Situation) -> float:
        return first_order.rod_inertia(situation)

    def join(self, composition: Composition) -> Composition:
        return _with(composition, corrections=(*composition.corrections, RodInertia()))


@dataclass(frozen=True)
class LargeDisplacementEffect:
    name: str = "large_displacement"
    summary: str = "second order of V/l: the elastica's first correction"
    measure: str = "greatest relative change of the main results by the third order of the slope, times a margin"

    def influence(self, situation: Situation) -> float:
        return first_order.large_displacement(situation)

    def join(self, composition: Composition) -> Composition:
        return _with(composition, corrections=(LargeDisplacement(), *composition.corrections))


@dataclass(frozen=True)
class ShearEffect:
    name: str = "shear"
    summary: str = "shear flexibility of the strip (Engesser)"
    measure: str = "greatest relative change of the main results rigid in shear, times a margin"

    def influence(self, situation: Situation) -> float:
        return first_order.shear(situation)

    def join(self, composition: Composition) -> Composition:
        return _with(composition, beam=composition.beam.with_shear())


@dataclass(frozen=True)
class FrictionFeedbackEffect:
    name: str = "friction_feedback"
    summary: str = "the friction force acts back on the axial force"
    measure: str = "greatest relative change of the main results without friction in the axial force, times a margin"

    def influence(self, situation: Situation) -> float:
        return first_order.friction_feedback(situation)

    def join(self, composition: Composition) -> Composition:
        return _with(composition, feedback=True)


def _with(composition: Composition, **parts: object) -> Composition:
    return replace(composition, **parts)


EFFECTS: tuple[RodEffect, ...] = (
    ReciprocatingInertia(),
    BeamColumnEffect(),
    ShearEffect(),
    FrictionFeedbackEffect(),
    LargeDisplacementEffect(),
    RodInertiaEffect(),
    FrictionEffect(),
)
"""All effects, in the order in which they join a composition: forces, beam, feedback, corrections, results."""


def choose_for(
    scene: Scene,
    dimensions: Dimensions,
    selection: EffectSelection = AUTO,
    tolerance: float = 1e-2,
    demands: tuple[Demand, ...] = (),
) -> Choice[RodEffect]:
    """Select the effects for a scene with this strip (see ``solvers.effects.choose``)."""
    return choose(EFFECTS, Situation(scene, dimensions, selection.exclude), selection, tolerance, demands)


def compose(choice: Choice[RodEffect]) -> Composition:
    """The composition of the selected effects, based on gas load and plain bending."""
    return _composed(choice.active)


@lru_cache(maxsize=128)
def _composed(active: tuple[RodEffect, ...]) -> Composition:
    composition = Composition(beam=PLAIN_BENDING)
    for effect in active:
        composition = effect.join(composition)
    return composition
