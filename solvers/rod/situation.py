"""A scene with its strip as the bounds of effects see it: extremes of forces and reactions, sampled closed forms."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.numerics.periodic import TURN, grid
from solvers.rod import strip_kernels
from solvers.rod.drive import Drive, axial_force, drive_of, pressure
from solvers.rod.enclosures import critical_parameter
from solvers.rod.jolts import left_ringing, pieces_of
from solvers.rod.scene import Dimensions, Scene

Array = NDArray[np.float64]

_EVEN = grid(128)
"""Close enough for second differences of what changes evenly; pieces between a load's own angles are ``jolts``."""


@dataclass(frozen=True)
class Driven:
    """A scene's forces as every strip in it feels them, sampled once."""

    scene: Scene

    @cached_property
    def drive(self) -> Drive:
        """Gas load and all inertia."""
        return drive_of(self.scene, self.scene.piston.reciprocating_mass)

    @cached_property
    def sharp(self) -> Array:
        return self.scene.load.sharp_angles()

    @cached_property
    def sampled(self) -> tuple[Array, Array, float, float]:
        """Axial force [N] with all inertia, and sin(phi), first at even angles, then where the load is sharp; the least
        and the greatest gas force [N]."""
        return _sampled(self.drive, np.concatenate([_EVEN, self.sharp]) if self.sharp.size else _EVEN)


class Reactions(NamedTuple):
    """What the strip's closed forms give at the sampled angles, and at a few forces."""

    side: float
    """Greatest side force [N]."""
    moment: float
    """Greatest clamp moment [N m]."""
    contact: float
    """Greatest contact load |T| + 6 |M0 + T e|/Lp [N]."""
    unsteadiness: float
    """Greatest acceleration of the strip's middle, beside that of one that follows the stroke's sine."""
    at_least: tuple[float, float, float]
    """V''(0), V'''(0), V''(l) per unit stroke at the least force, inertia included."""
    at_most: tuple[float, float, float]
    """The same at the greatest force."""
    unloaded: tuple[float, float, float]
    """The same at no force."""


@dataclass(frozen=True)
class Situation:
    """A scene with its strip, and what the bounds need of it; what takes more than a few operations is kept."""

    driven: Driven
    dimensions: Dimensions

    @staticmethod
    def of(scene: Scene, dimensions: Dimensions) -> Situation:
        return Situation(Driven(scene), dimensions)

    def resized(self, dimensions: Dimensions) -> Situation:
        """Another strip in the same scene."""
        return Situation(self.driven, dimensions)

    @property
    def scene(self) -> Scene:
        return self.driven.scene

    @property
    def gas_extremes(self) -> tuple[float, float]:
        """The least and the greatest gas force [N]."""
        return self.driven.sampled[2:]

    @property
    def inertia_force(self) -> float:
        """m_j r omega^2 (1 + lambda) [N]: the greatest, at top dead centre."""
        m = self.scene.mechanism
        top = m.crank_radius * m.angular_speed**2 * (1.0 + m.crank_radius / m.rod_length)
        return self.scene.piston.reciprocating_mass * top

    @property
    def stiffness(self) -> float:
        return self.scene.material.elastic_modulus * self.dimensions.b * self.dimensions.h**3 / 12.0

    @cached_property
    def critical(self) -> float:
        d, s = self.dimensions, self.scene
        ln_u, _ = critical_parameter(d.l, s.mechanism.rod_length)
        weaker = d.b * d.h * min(d.b, d.h) ** 2 / 12.0
        return s.material.elastic_modulus * weaker * (math.exp(ln_u) / s.mechanism.rod_length) ** 2

    @property
    def compression(self) -> float:
        """The greatest compression [N], inertia included."""
        return max(-self.gas_extremes[0], 0.0) + self.inertia_force

    @property
    def least_extreme(self) -> float:
        """The smaller of the force's two extremes in magnitude: what a small error weighs most against."""
        return min(abs(force) for force in self.gas_extremes)

    @property
    def amplification(self) -> float:
        """1/(1 - |P|/P_cr): how much nearness to buckling magnifies a small change; inf at and beyond buckling."""
        margin = 1.0 - self.compression / self.critical
        return 1.0 / margin if margin > 0 else math.inf

    @property
    def extremes(self) -> tuple[float, float]:
        """The least and the greatest axial force [N], as far as gas and inertia can go together."""
        least, most = self.gas_extremes
        return least - self.inertia_force, most + self.inertia_force

    @cached_property
    def reactions(self) -> Reactions:
        """What the strip's closed forms give."""
        force, sine, _, _ = self.driven.sampled
        m, piston = self.scene.mechanism, self.scene.piston
        lever = 6.0 / piston.skirt_length
        found = _reactions(
            *(force, sine, *self.extremes, self.stiffness, self.dimensions.l, m.rod_length, m.crank_radius),
            *(lever, piston.clamp_offset),
        )
        return Reactions(*found[:4], found[4:7], found[7:10], found[10:])

    @property
    def unsteadiness(self) -> float:
        """Greatest acceleration of the strip's middle, beside that of one that follows the stroke's sine: 1 or more."""
        return max(1.0, self.reactions.unsteadiness)

    def jolt(self, frequency: float) -> float:
        """How far the force sets a mode of this frequency [Hz] ringing, as a share of the greatest reactions."""
        sharp, m = self.driven.sharp, self.scene.mechanism
        if not sharp.size:
            return 0.0
        shape = self.stiffness, self.dimensions.l, m.rod_length
        left = left_ringing(self.driven.drive, pieces_of(sharp), *shape, frequency / m.speed)
        wholes = self.reactions.side, self.reactions.moment
        return max(
            part * self.stiffness * m.crank_radius / whole if whole else math.inf
            for part, whole in zip(left, wholes, strict=True)
        )

    @cached_property
    def weakness(self) -> float:
        """How small the axial force makes the guide's greatest reactions, beside those of the strip's stiffness alone.

        An effect changes them by a share of the latter. The greatest ratio of side forces, moments and contact loads.
        """
        piston, found = self.scene.piston, self.reactions
        stroke = self.stiffness * self.scene.mechanism.crank_radius
        side, moment = -stroke * found.unloaded[1], stroke * found.unloaded[0]
        contact = abs(side) + 6.0 / piston.skirt_length * (abs(moment) + abs(side * piston.clamp_offset))
        pairs = (abs(side), found.side), (abs(moment), found.moment), (contact, found.contact)
        return max(1.0, *(w / x if x else math.inf for w, x in pairs))

    def direct(self, force: float) -> float:
        """The stress of a small axial force [N], as a share of the amplitude of the bending stress."""
        bending = 0.5 * self.dimensions.h / self.stiffness * self.reactions.moment * self.scene.material.elastic_modulus
        share = force / (self.dimensions.b * self.dimensions.h)
        return share / bending if bending else math.inf


@kernel
def _sampled(drive: Drive, angles: Array) -> tuple[Array, Array, float, float]:
    """Axial force, sin(phi), and the extremes of the force without inertia."""
    force, sine = np.empty(angles.size), np.empty(angles.size)
    least, most = np.inf, -np.inf
    for i in range(angles.size):
        gas = -(pressure(drive, angles[i]) - drive.back_pressure) * drive.area
        least, most = min(least, gas), max(most, gas)
        force[i], sine[i] = axial_force(drive, angles[i]), math.sin(angles[i])
    return force, sine, least, most


@kernel
def _reactions(
    force: Array, sine: Array, least: float, most: float, stiffness: float, l: float, rod_length: float, radius: float,
    lever: float, offset: float,
) -> tuple[float, float, float, float, float, float, float, float, float, float, float, float, float]:  # fmt: skip
    """The fields of ``Reactions`` one after the other."""
    q = np.empty(force.size + 3)
    for i in range(force.size):
        q[i] = force[i] / stiffness
    q[-3], q[-2], q[-1] = least / stiffness, most / stiffness, 0.0
    clamp, shear, head, _ = strip_kernels.solve(q, l, rod_length)
    stroke = stiffness * radius
    most_side, most_moment, most_contact = 0.0, 0.0, 0.0
    for i in range(force.size):
        side, moment = -shear[i] * stroke * sine[i], clamp[i] * stroke * sine[i]
        most_side, most_moment = max(most_side, abs(side)), max(most_moment, abs(moment))
        most_contact = max(most_contact, abs(side) + lever * abs(moment + side * offset))
    few = (
        clamp[-3], shear[-3], head[-3], clamp[-2], shear[-2], head[-2], clamp[-1], shear[-1], head[-1],
    )  # fmt: skip
    # The middle, at the even angles and, last of all, with no force.
    count = _EVEN.size
    q[count], clamp[count], shear[count], head[count] = q[-1], clamp[-1], shear[-1], head[-1]
    q, clamp, shear, head = q[: count + 1], clamp[: count + 1], shear[: count + 1], head[: count + 1]
    middle = strip_kernels.deflection(q, l, clamp, shear, head, np.array([0.5 * l]))[0]
    greatest = 0.0
    before, here = middle[count - 1] * sine[count - 1], middle[0] * sine[0]
    for i in range(count):
        follows = i + 1 if i < count - 1 else 0
        after = middle[follows] * sine[follows]
        greatest = max(greatest, abs(before - 2.0 * here + after))
        before, here = here, after
    unsteadiness = greatest * (count / TURN) ** 2 / middle[count]
    return (most_side, most_moment, most_contact, unsteadiness, *few)
