"""The effects that a crank mechanism's scene can call for, each an object with an a-priori bound.

The bounds look at the gas force at 64 angles of the cycle and at closed forms; they are conservative by test over
random machines, not by proof.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from solvers.crank.cycle import Array, Composition, Cycle
from solvers.crank.motion import ExactMotion, Motion, TwoHarmonicMotion
from solvers.crank.pressure import Curve
from solvers.crank.scene import Scene
from solvers.effects import AUTO, Choice, Demand, EffectSelection, choose

_ANGLES = 64


@dataclass(frozen=True)
class Situation:
    """A scene with its pressures over the angle, and what the bounds need of it."""

    scene: Scene
    curve: Curve

    @cached_property
    def _angle(self) -> Array:
        return (np.arange(_ANGLES) + 0.5) * (self.scene.cylinder.period / _ANGLES)

    @cached_property
    def gas_force(self) -> float:
        """The greatest magnitude of the gas force [N] at the angles."""
        cylinder = self.scene.cylinder
        force = (self.curve.pressure(self._angle) - cylinder.crankcase_pressure) * cylinder.area
        return float(np.max(np.abs(force)))

    @cached_property
    def gas_side_force(self) -> float:
        """The greatest magnitude of the gas force's own side force [N] at the angles."""
        cylinder = self.scene.cylinder
        force = (self.curve.pressure(self._angle) - cylinder.crankcase_pressure) * cylinder.area
        return float(np.max(np.abs(force * self.scene.mechanism.motion().rod_tangent(self._angle))))

    @property
    def ratio(self) -> float:
        m = self.scene.mechanism
        return m.crank_radius / m.rod_length

    @property
    def acceleration(self) -> float:
        """r omega^2 [m/s2]."""
        m = self.scene.mechanism
        return m.crank_radius * m.angular_speed**2

    @property
    def least_rod_cosine(self) -> float:
        """cos(beta) where the rod stands most askew."""
        m = self.scene.mechanism
        sine = (m.crank_radius + abs(m.offset)) / m.rod_length
        return math.sqrt((1.0 - sine) * (1.0 + sine))


class CrankEffect(Protocol):
    """An effect of the crank mechanism: what it is, how much it may matter, and its part in the composition."""

    name: str
    summary: str
    measure: str

    def influence(self, situation: Situation) -> float: ...

    def join(self, composition: Composition, scene: Scene) -> Composition: ...


def _relative(part: float, whole: float) -> float:
    """part/(whole - part): a change relative to the changed value; inf when it may cancel it."""
    return part / (whole - part) if part < whole else (0.0 if part == 0 else math.inf)


@dataclass(frozen=True)
class ReciprocatingInertia:
    """P_j = -m_j a on the mechanism, of which the wrist pin carries the piston group's share -m_p a."""

    name: str = "reciprocating_inertia"
    summary: str = "inertia of the piston group and the rod's upper share"
    measure: str = "m_j r omega^2 (1 + lambda)/cos^3(beta) against the greatest gas force"

    def influence(self, situation: Situation) -> float:
        mass = situation.scene.masses.reciprocating
        greatest = mass * situation.acceleration * (1.0 + situation.ratio) / situation.least_rod_cosine**3
        return _relative(greatest, situation.gas_force)

    def join(self, composition: Composition, scene: Scene) -> Composition:
        return replace(composition, axial=(*composition.axial, self))

    def axial_force(self, cycle: Cycle, angle: Array) -> Array:
        return self._force(cycle, angle, cycle.scene.masses.reciprocating)

    def on_wrist_pin(self, cycle: Cycle, angle: Array) -> Array:
        return self._force(cycle, angle, cycle.scene.masses.piston)

    def _force(self, cycle: Cycle, angle: Array, mass: float) -> Array:
        return -mass * cycle.angular_speed**2 * cycle.motion.acceleration(angle)


@dataclass(frozen=True)
class RodInertiaCouple:
    """The rod's true moment of inertia: a couple Delta J beta'' on top of the two-mass model.

    The pair of forces that balances it, Delta J beta''/(L cos beta) at piston and crank pin, does no net work: its
    torque is the derivative of Delta J beta'^2/2, by which the two-mass model's kinetic energy is too great.
    """

    name: str = "rod_inertia_couple"
    summary: str = "the moment of inertia by which the rod differs from its two masses"
    measure: str = "|Delta J| beta''/(L cos beta) against the greatest side force of the gas"

    def influence(self, situation: Situation) -> float:
        scene, rod = situation.scene, situation.least_rod_cosine
        turning = situation.ratio * (1.0 + situation.ratio / rod**2) / rod * scene.mechanism.angular_speed**2
        force = abs(scene.masses.rod.inertia_defect) * turning / (scene.mechanism.rod_length * rod)
        return _relative(force, situation.gas_side_force)

    def join(self, composition: Composition, scene: Scene) -> Composition:
        return replace(composition, lateral=(*composition.lateral, self))

    def side_force(self, cycle: Cycle, angle: Array) -> Array:
        motion = cycle.motion
        turning = motion.rod_angular_acceleration(angle) * cycle.angular_speed**2
        # 1/cos(beta) is the length of the tangent's own triangle, in whatever motion.
        secant = np.hypot(1.0, motion.rod_tangent(angle))
        return cycle.scene.masses.rod.inertia_defect * turning * secant / motion.rod_length


@dataclass(frozen=True)
class PinOffset:
    name: str = "pin_offset"
    summary: str = "the cylinder axis does not meet the shaft"
    measure: str = "2 |e|/r, what the rod's angle and the dead centres move by"

    def influence(self, situation: Situation) -> float:
        m = situation.scene.mechanism
        return 2.0 * _relative(abs(m.offset), m.crank_radius)

    def join(self, composition: Composition, scene: Scene) -> Composition:
        return replace(composition, motion=scene.mechanism.motion())


@dataclass(frozen=True)
class SeveralCylinders:
    """Summed torque, unbalance and the swing of the speed exist only where this runs."""

    name: str = "engine"
    summary: str = "several cylinders on one shaft: summed torque, unbalanced forces and couples"
    measure: str = "1 where there are several cylinders: its results exist only when it runs"

    def influence(self, situation: Situation) -> float:
        return 1.0 if len(situation.scene.engine.phases) > 1 else 0.0

    def join(self, composition: Composition, scene: Scene) -> Composition:
        return replace(composition, engine=scene.engine)


EFFECTS: tuple[CrankEffect, ...] = (PinOffset(), ReciprocatingInertia(), RodInertiaCouple(), SeveralCylinders())
"""Every effect, in the order in which they join a composition: motion, forces, cylinders."""


def choose_for(
    scene: Scene,
    curve: Curve,
    selection: EffectSelection = AUTO,
    tolerance: float = 1e-2,
    demands: tuple[Demand, ...] = (),
) -> Choice[CrankEffect]:
    """The effects for a scene (see ``solvers.effects.choose``)."""
    return choose(EFFECTS, Situation(scene, curve), selection, tolerance, demands)


def compose(choice: Choice[CrankEffect], scene: Scene, accuracy: float) -> Composition:
    """The physics that the chosen effects make up, on top of the gas force in an in-line mechanism.

    Without offset the two-harmonic motion will do where its error, at most lambda^2 of any result, is within the
    accuracy asked for.
    """
    m = scene.mechanism
    in_line: Motion = ExactMotion(m.crank_radius, m.rod_length)
    if (m.crank_radius / m.rod_length) ** 2 <= accuracy:
        in_line = TwoHarmonicMotion(m.crank_radius, m.rod_length)
    composition = Composition(in_line)
    for effect in choice.active:
        composition = effect.join(composition, scene)
    return composition
