"""The effects a flexible rod's scene can call for, each an object with an a-priori bound.

Every bound looks at closed forms only: extremes of the gas load, the critical load, and the beam's constants at the two
extreme forces. The factors in front are conservative by test over random machines, not by proof; where leaving an
effect out is known to be harmless by proof, the docstring says so.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from solvers.effects import AUTO, Choice, Demand, EffectSelection, choose
from solvers.rod.cycle.composition import BeamColumn, Composition, PlainBending, ShearFlexible
from solvers.rod.effect_bounds.situation import Situation, relative
from solvers.rod.piston import skirt
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.strip.elastica import LargeDisplacement
from solvers.rod.strip.stiffness import shear_stiffness
from solvers.rod.vibration.steady_response import RodInertia


class RodEffect(Protocol):
    """An effect of the flexible rod: what it is, how much it may matter, and its part in the composition."""

    name: str
    summary: str
    measure: str

    def influence(self, situation: Situation) -> float: ...

    def join(self, composition: Composition) -> Composition: ...


@dataclass(frozen=True)
class ReciprocatingInertia:
    name: str = "reciprocating_inertia"
    summary: str = "inertia of the reciprocating mass in the axial force"
    measure: str = "m_j r omega^2 (1 + lambda) / least extreme of the gas force, and its own stress"

    def influence(self, situation: Situation) -> float:
        return situation.by_force(situation.inertia_force)

    def join(self, composition: Composition) -> Composition:
        return _with(composition, moving=(*composition.moving, self))

    def mass(self, scene: Scene) -> float:
        return scene.piston.reciprocating_mass


@dataclass(frozen=True)
class BeamColumnEffect:
    """Proof: C, D and V''(l) are monotone in q, so they change most at the extreme forces.

    Where one of them may vanish or change its sign there is no bound relative to what it becomes; the number is then
    the change relative to what it was without the force, plus one, which no tolerance admits.
    """

    name: str = "beam_column"
    summary: str = "the axial force stiffens (tension) or softens (compression) the strip"
    measure: str = "greatest change of V''(0), V'''(0), V''(l) between the extreme forces and none"

    def influence(self, situation: Situation) -> float:
        if not math.isfinite(situation.amplification):
            return math.inf
        found, changes = situation.reactions, []
        for *loaded, unloaded in zip(found.at_least, found.at_most, found.unloaded, strict=True):
            if unloaded != 0:
                for v in loaded:
                    bound = relative(abs(v - unloaded), max(abs(v), abs(unloaded)))
                    changes.append(bound if math.isfinite(bound) else 1.0 + abs(v / unloaded - 1.0))
        return max(changes)

    def join(self, composition: Composition) -> Composition:
        return _with(composition, beam=BeamColumn())


@dataclass(frozen=True)
class FrictionEffect:
    """Contact and friction results exist only where this runs; it changes no other result, so its bound is 0 or 1."""

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
        "2 (k omega/omega_1)^2, k = 3 or what the force's changes make of it, omega_1 under the greatest compression; "
        "or, if greater, 4 times what the load's corners and jumps leave ringing"
    )

    def influence(self, situation: Situation) -> float:
        return situation.vibration

    def join(self, composition: Composition) -> Composition:
        return _with(composition, corrections=(*composition.corrections, RodInertia()))


@dataclass(frozen=True)
class LargeDisplacementEffect:
    name: str = "large_displacement"
    summary: str = "second order of V/l: the elastica's first correction"
    measure: str = "1.5 (r/l)^2, amplified near buckling, by friction and inertia, and where the reactions are small"

    def influence(self, situation: Situation) -> float:
        slope = situation.scene.mechanism.crank_radius / situation.dimensions.l
        return 1.5 * slope**2 * situation.sensitivity * situation.weakness

    def join(self, composition: Composition) -> Composition:
        return _with(composition, corrections=(LargeDisplacement(), *composition.corrections))


@dataclass(frozen=True)
class ShearEffect:
    name: str = "shear"
    summary: str = "shear flexibility of the strip (Engesser)"
    measure: str = "24 EI/(kGA l^2), amplified near buckling, by friction and inertia, and where reactions are small"

    def influence(self, situation: Situation) -> float:
        stiffness = shear_stiffness(situation.scene, situation.dimensions)
        # Under strong tension bending lives in a layer of the width 1/sqrt(q) beside the clamp.
        tension = max(situation.extremes[1] / situation.stiffness, 0.0)
        share = situation.stiffness / stiffness * (1.0 / situation.dimensions.l**2 + tension / 40.0)
        return 24.0 * share * situation.sensitivity * situation.weakness

    def join(self, composition: Composition) -> Composition:
        return _with(composition, beam=ShearFlexible(composition.beam))


@dataclass(frozen=True)
class FrictionFeedbackEffect:
    name: str = "friction_feedback"
    summary: str = "the friction force acts back on the axial force"
    measure: str = "greatest friction force of the plain cycle / least extreme of the gas force, and its own stress"

    def influence(self, situation: Situation) -> float:
        if not math.isfinite(situation.amplification):
            return math.inf
        piston, found = situation.scene.piston, situation.reactions
        stroke = situation.stiffness * situation.scene.mechanism.crank_radius
        walls = []
        for clamp, shear, _ in (found.at_least, found.at_most, found.unloaded):
            side, moment = -stroke * shear, stroke * clamp
            couple = 6.0 * abs(moment + side * piston.clamp_offset) / piston.skirt_length
            walls.append(skirt.both_walls(abs(side), couple))
        friction = piston.friction_coefficient * (4.0 / math.pi) * max(walls)
        return situation.by_force(friction)

    def join(self, composition: Composition) -> Composition:
        return _with(composition, feedback=True)


def _with(composition: Composition, **parts: object) -> Composition:
    from dataclasses import replace

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
"""Every effect, in the order in which they join a composition: forces, beam, feedback, corrections, results."""


def choose_for(
    scene: Scene,
    dimensions: Dimensions,
    selection: EffectSelection = AUTO,
    tolerance: float = 1e-2,
    demands: tuple[Demand, ...] = (),
) -> Choice[RodEffect]:
    """The effects for a scene with this strip (see ``solvers.effects.choose``)."""
    return choose(EFFECTS, Situation.of(scene, dimensions), selection, tolerance, demands)


def compose(choice: Choice[RodEffect]) -> Composition:
    """The physics that the chosen effects make up, on top of gas load and plain bending."""
    composition = Composition(beam=PlainBending())
    for effect in choice.active:
        composition = effect.join(composition)
    return composition
