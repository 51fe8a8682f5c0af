"""The effects a flexible rod's scene can call for, each an object with an a-priori bound.

Every bound looks at closed forms only: extremes of the gas load, the critical load, and the beam's constants at the two
extreme forces. The factors in front are conservative by test over random machines, not by proof; where leaving an
effect out is known to be harmless by proof, the docstring says so.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from solvers.crank import kinematics
from solvers.effects import AUTO, Choice, Demand, EffectSelection, choose
from solvers.numerics.periodic import grid
from solvers.rod import beam_column, guide, strip_kernels
from solvers.rod.cycle import Array, BeamColumn, Composition, PlainBending
from solvers.rod.enclosures import critical_parameter
from solvers.rod.friction import FrictionFeedback
from solvers.rod.large_displacement import LargeDisplacement
from solvers.rod.rod_inertia import RodInertia
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.shear import ShearFlexible, shear_stiffness
from solvers.rod.vibration import natural_frequency

_ANGLES, _FINE_ANGLES = 64, 512
_FLEXURE = 0.35
"""Of L/l: how much more a short flexure's reactions feel a force on the strip than its first frequency tells."""


@dataclass(frozen=True)
class Situation:
    """A scene with its strip, and what the bounds need of it, each computed once."""

    scene: Scene
    dimensions: Dimensions

    @cached_property
    def gas_force(self) -> Array:
        load = self.scene.load
        angles = np.concatenate([grid(_ANGLES), load.sharp_angles()])
        return -(load.pressure(angles) - load.reference_pressure()) * self.scene.piston.area

    @cached_property
    def inertia_force(self) -> float:
        """m_j r omega^2 (1 + lambda) [N]: the greatest, at top dead centre."""
        m = self.scene.mechanism
        top = kinematics.acceleration(np.array([0.0]), m.crank_radius, m.rod_length, m.angular_speed)
        return self.scene.piston.reciprocating_mass * float(top[0])

    @cached_property
    def stiffness(self) -> float:
        return self.scene.material.elastic_modulus * self.dimensions.b * self.dimensions.h**3 / 12.0

    @cached_property
    def critical(self) -> float:
        d, s = self.dimensions, self.scene
        ln_u, _ = critical_parameter(d.l, s.mechanism.rod_length)
        weaker = d.b * d.h * min(d.b, d.h) ** 2 / 12.0
        return s.material.elastic_modulus * weaker * (math.exp(ln_u) / s.mechanism.rod_length) ** 2

    @cached_property
    def compression(self) -> float:
        """The greatest compression [N], inertia included."""
        return max(float(-self.gas_force.min()), 0.0) + self.inertia_force

    @cached_property
    def least_extreme(self) -> float:
        """The smaller of the force's two extremes in magnitude: what a small error weighs most against."""
        return min(abs(float(self.gas_force.min())), abs(float(self.gas_force.max())))

    @cached_property
    def amplification(self) -> float:
        """1/(1 - |P|/P_cr): how much nearness to buckling magnifies a small change; inf at and beyond buckling."""
        margin = 1.0 - self.compression / self.critical
        return 1.0 / margin if margin > 0 else math.inf

    @cached_property
    def constants(self) -> beam_column.BeamConstants:
        """The beam at the least and the greatest force, and at none."""
        extremes = np.array([self.gas_force.min() - self.inertia_force, self.gas_force.max() + self.inertia_force, 0.0])
        length, rod_length = self.dimensions.l, self.scene.mechanism.rod_length
        coupling = extremes / self.stiffness
        return beam_column.BeamConstants(
            coupling, length, rod_length, *strip_kernels.solve(coupling, length, rod_length)
        )

    @cached_property
    def _guide(self) -> tuple[Array, Array]:
        """Side force and clamp moment at the sampled angles and, last, without an axial force at mid-stroke."""
        angles = np.concatenate([grid(_ANGLES), self.scene.load.sharp_angles()])
        m, mass = self.scene.mechanism, self.scene.piston.reciprocating_mass
        inertia = mass * kinematics.acceleration(angles, m.crank_radius, m.rod_length, m.angular_speed)
        force = np.append(self.gas_force + inertia, 0.0)
        stroke = m.crank_radius * np.append(np.sin(angles), 1.0)
        clamp, shear, _, _ = strip_kernels.solve(force / self.stiffness, self.dimensions.l, m.rod_length)
        return -self.stiffness * shear * stroke, self.stiffness * clamp * stroke

    @cached_property
    def unsteadiness(self) -> float:
        """Greatest acceleration of the strip's middle, beside that of one that follows the stroke's sine: 1 or more."""
        angles, m, l = grid(_FINE_ANGLES), self.scene.mechanism, self.dimensions.l
        load, mass = self.scene.load, self.scene.piston.reciprocating_mass
        force = -(load.pressure(angles) - load.reference_pressure()) * self.scene.piston.area
        force += mass * kinematics.acceleration(angles, m.crank_radius, m.rod_length, m.angular_speed)
        coupling = np.append(force / self.stiffness, 0.0)
        clamp, shear, head, _ = strip_kernels.solve(coupling, l, m.rod_length)
        middle = strip_kernels.deflection(coupling, l, clamp, shear, head, np.array([0.5 * l]))[0]
        moving = middle[:-1] * np.sin(angles)
        bend = np.roll(moving, 1) - 2.0 * moving + np.roll(moving, -1)
        return float(max(1.0, np.abs(bend).max() * (_FINE_ANGLES / (2.0 * np.pi)) ** 2 / middle[-1]))

    @cached_property
    def weakness(self) -> float:
        """How small the axial force makes the guide's greatest reactions, beside those of the strip's stiffness alone.

        An effect changes them by a share of the latter. The greatest ratio of side forces, moments and contact loads.
        """
        side, moment = self._guide
        piston = self.scene.piston
        contact = np.abs(side) + 6.0 / piston.skirt_length * np.abs(moment + side * piston.clamp_offset)
        whole = abs(side[-1]) + 6.0 / piston.skirt_length * (abs(moment[-1]) + abs(side[-1] * piston.clamp_offset))
        with np.errstate(divide="ignore"):
            ratios = [abs(x[-1]) / np.abs(x[:-1]).max() for x in (side, moment)] + [whole / contact[:-1].max()]
        return float(max(1.0, *ratios))

    def direct(self, force: float) -> float:
        """The stress of a small axial force [N], as a share of the amplitude of the bending stress."""
        bending = 0.5 * self.dimensions.h / self.stiffness * np.abs(self._guide[1][:-1]).max()
        bending *= self.scene.material.elastic_modulus
        return float(force / (self.dimensions.b * self.dimensions.h) / bending)


class RodEffect(Protocol):
    """An effect of the flexible rod: what it is, how much it may matter, and its part in the composition."""

    name: str
    summary: str
    measure: str

    def influence(self, situation: Situation) -> float: ...

    def join(self, composition: Composition) -> Composition: ...


def _relative(part: float, whole: float) -> float:
    """part/(whole - part): a change relative to the changed value; inf when it may cancel it."""
    return part / (whole - part) if part < whole else (0.0 if part == 0 else math.inf)


@dataclass(frozen=True)
class ReciprocatingInertia:
    name: str = "reciprocating_inertia"
    summary: str = "inertia of the reciprocating mass in the axial force"
    measure: str = "m_j r omega^2 (1 + lambda) / least extreme of the gas force, and its own stress"

    def influence(self, situation: Situation) -> float:
        share = _relative(situation.inertia_force, situation.least_extreme)
        if not share:
            return 0.0
        return 4.0 * share * situation.amplification + 2.0 * situation.direct(situation.inertia_force)

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
        c, changes = situation.constants, []
        for values in (c.clamp_curvature, c.clamp_shear, c.head_curvature):
            if values[2] != 0:
                for v in values[:2]:
                    bound = _relative(abs(v - values[2]), max(abs(v), abs(values[2])))
                    changes.append(bound if math.isfinite(bound) else 1.0 + abs(v / values[2] - 1.0))
        return float(max(changes))

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
        "2 (k omega/omega_1)^2, k = 3 or what the force's changes make of it, omega_1 under the greatest compression"
    )

    def influence(self, situation: Situation) -> float:
        if not math.isfinite(situation.amplification):
            return math.inf
        slowest = natural_frequency(situation.scene, situation.dimensions, -situation.compression)
        speed = situation.scene.mechanism.speed
        flexure = max(1.0, _FLEXURE * situation.scene.mechanism.rod_length / situation.dimensions.l)
        share = _relative((3.0 * speed) ** 2 * situation.unsteadiness, slowest**2)
        return 2.0 * share * flexure * situation.weakness if share else 0.0

    def join(self, composition: Composition) -> Composition:
        return _with(composition, corrections=(*composition.corrections, RodInertia()))


@dataclass(frozen=True)
class LargeDisplacementEffect:
    name: str = "large_displacement"
    summary: str = "second order of V/l: the elastica's first correction"
    measure: str = "2 (r/l)^2, amplified near buckling and where the reactions are small"

    def influence(self, situation: Situation) -> float:
        slope = situation.scene.mechanism.crank_radius / situation.dimensions.l
        return 2.0 * slope**2 * situation.amplification * situation.weakness

    def join(self, composition: Composition) -> Composition:
        return _with(composition, corrections=(LargeDisplacement(), *composition.corrections))


@dataclass(frozen=True)
class ShearEffect:
    name: str = "shear"
    summary: str = "shear flexibility of the strip (Engesser)"
    measure: str = "24 EI/(kGA l^2), amplified near buckling and where the reactions are small"

    def influence(self, situation: Situation) -> float:
        stiffness = shear_stiffness(situation.scene, situation.dimensions)
        # Under strong tension bending lives in a layer of the width 1/sqrt(q) beside the clamp.
        tension = max(float(situation.constants.coupling[1]), 0.0)
        share = situation.stiffness / stiffness * (1.0 / situation.dimensions.l**2 + tension / 40.0)
        return 24.0 * share * situation.amplification * situation.weakness

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
        c, piston = situation.constants, situation.scene.piston
        stroke = situation.scene.mechanism.crank_radius
        friction = guide.friction_force(
            -situation.stiffness * c.clamp_shear * stroke,
            situation.stiffness * c.clamp_curvature * stroke,
            piston.clamp_offset,
            piston.skirt_length,
            piston.friction_coefficient,
        )
        share = _relative(float(friction.max()), situation.least_extreme)
        if not share:
            return 0.0
        return 4.0 * share * situation.amplification + 2.0 * situation.direct(float(friction.max()))

    def join(self, composition: Composition) -> Composition:
        return _with(composition, feedback=FrictionFeedback())


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
    return choose(EFFECTS, Situation(scene, dimensions), selection, tolerance, demands)


def compose(choice: Choice[RodEffect]) -> Composition:
    """The physics that the chosen effects make up, on top of gas load and plain bending."""
    composition = Composition(beam=PlainBending())
    for effect in choice.active:
        composition = effect.join(composition)
    return composition
