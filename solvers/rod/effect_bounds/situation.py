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
from solvers.rod.effect_bounds.ringing_bound import left_ringing, pieces_of
from solvers.rod.load.axial_force import Drive, axial_force, drive_of, pressure
from solvers.rod.piston import skirt
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.strip import beam_column
from solvers.rod.strip.buckling import log_critical_parameter
from solvers.rod.vibration.natural_frequencies import natural_frequency

Array = NDArray[np.float64]

_EVEN = grid(128)
"""Close enough for second differences of what changes evenly; pieces between a load's own angles are ``jolts``."""

_FLEXURE = 0.35
"""Of L/l: how much more a short flexure's reactions feel a force on the strip than its first frequency tells."""
_LIVELIEST = 20.0
"""How much the strip's inertia is taken to magnify at the most: where it may cancel the reactions no bound holds."""
_TOLD = 1e-6
"""Of the critical force: a force whose effect on the reactions has digits left."""


def relative(part: float, whole: float) -> float:
    """part/(whole - part): a change relative to the changed value; inf when it may cancel it."""
    return part / (whole - part) if part < whole else (0.0 if part == 0 else math.inf)


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
    clearance: float
    """Least sqrt(m (m - 4 F)) [N], m what the compression leaves of P_cr and F the friction force; 0 where friction may
    buckle the strip."""
    steepness: float
    """Greatest change of these reactions between no force and the present one, per newton, as a share of theirs."""
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
        ln_u, _ = log_critical_parameter(d.l, s.mechanism.rod_length)
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
    def sensitivity(self) -> float:
        """How much a small change of the strip's flexibility is magnified in what the guide feels.

        Reactions go as 1/(P_cr - P), and so does the friction force F, which adds to the compression: with
        P = P_0 + F m/(P_cr - P) closed, m = P_cr - P_0, they change by P_cr/sqrt(m (m - 4 F)) times the share by which
        P_cr does; too little within a tenth of the friction that buckles the strip, which comes a little sooner. The
        strip's inertia may magnify the change once more, or cancel what it is compared with.
        """
        clearance = self.reactions.clearance
        if not clearance:
            return math.inf
        lively = 1.0 / max(1.0 - self.vibration, 1.0 / _LIVELIEST)
        return max(self.amplification, self.critical / clearance) * lively

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
            *(lever, piston.clamp_offset, piston.friction_coefficient, self.critical),
        )
        return Reactions(*found[:6], found[6:9], found[9:12], found[12:])

    @property
    def unsteadiness(self) -> float:
        """Greatest acceleration of the strip's middle, beside that of one that follows the stroke's sine: 1 or more."""
        return max(1.0, self.reactions.unsteadiness)

    @cached_property
    def vibration(self) -> float:
        """Bound of what the strip's own inertia changes, as a share of the reactions."""
        if not math.isfinite(self.amplification):
            return math.inf
        slowest, mechanism = natural_frequency(self.scene, self.dimensions, -self.compression), self.scene.mechanism
        flexure = max(1.0, _FLEXURE * mechanism.rod_length / self.dimensions.l)
        share = relative((3.0 * mechanism.speed) ** 2 * self.unsteadiness, slowest**2)
        steady = 2.0 * share * flexure * self.weakness if share else 0.0
        # Closing the turn enlarges what rings by a factor that no phase over so many periods tells.
        return max(steady, 4.0 * flexure * self.jolt(slowest))

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

    def by_force(self, force: float) -> float:
        """What a small axial force [N] changes: a share of the others, of reactions that these nearly cancel, and its
        own stress beside the amplitude of the bending stress."""
        if not force:
            return 0.0
        reactions = max(self.weakness / self.critical, self.reactions.steepness)
        share = max(relative(force, self.least_extreme), force * reactions)
        return 3.0 * share * self.sensitivity + 2.0 * self._direct(force)

    def _direct(self, force: float) -> float:
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
    lever: float, offset: float, coefficient: float, critical: float,
) -> tuple[float, ...]:  # fmt: skip
    """The fields of ``Reactions`` one after the other."""
    q = np.empty(force.size + 3)
    for i in range(force.size):
        q[i] = force[i] / stiffness
    q[-3], q[-2], q[-1] = least / stiffness, most / stiffness, 0.0
    clamp, shear, head, _ = beam_column.solve(q, l, rod_length)
    stroke = stiffness * radius
    most_side, most_moment, most_contact, clearance = 0.0, 0.0, 0.0, np.inf
    steep_side, steep_moment, steep_contact = 0.0, 0.0, 0.0
    for i in range(force.size):
        side, moment = -shear[i] * stroke * sine[i], clamp[i] * stroke * sine[i]
        most_side, most_moment = max(most_side, abs(side)), max(most_moment, abs(moment))
        couple = lever * abs(moment + side * offset)
        most_contact = max(most_contact, abs(side) + couple)
        reach = stroke * abs(sine[i]) / max(abs(force[i]), _TOLD * critical)
        by_side, by_moment = reach * (shear[i] - shear[-1]), reach * (clamp[-1] - clamp[i])
        steep_side, steep_moment = max(steep_side, abs(by_side)), max(steep_moment, abs(by_moment))
        steep_contact = max(steep_contact, abs(by_side) + lever * abs(by_moment + by_side * offset))
        # On the way up it adds to the compression, on the way down it relieves it.
        friction = math.copysign(coefficient * 4.0 / np.pi * skirt.both_walls(abs(side), couple), -sine[i])
        left = critical + force[i]
        clearance = min(clearance, left * (left - 4.0 * friction) if left > 0.0 else 0.0)
    few = (
        clamp[-3], shear[-3], head[-3], clamp[-2], shear[-2], head[-2], clamp[-1], shear[-1], head[-1],
    )  # fmt: skip
    # The middle, at the even angles and, last of all, with no force.
    count = _EVEN.size
    q[count], clamp[count], shear[count], head[count] = q[-1], clamp[-1], shear[-1], head[-1]
    q, clamp, shear, head = q[: count + 1], clamp[: count + 1], shear[: count + 1], head[: count + 1]
    middle = beam_column.deflection(q, l, clamp, shear, head, np.array([0.5 * l]))[0]
    greatest = 0.0
    before, here = middle[count - 1] * sine[count - 1], middle[0] * sine[0]
    for i in range(count):
        follows = i + 1 if i < count - 1 else 0
        after = middle[follows] * sine[follows]
        greatest = max(greatest, abs(before - 2.0 * here + after))
        before, here = here, after
    unsteadiness = greatest * (count / TURN) ** 2 / middle[count]
    steepness = 0.0
    for steep, most in ((steep_side, most_side), (steep_moment, most_moment), (steep_contact, most_contact)):
        steepness = max(steepness, steep / most if most > 0.0 else (np.inf if steep > 0.0 else 0.0))
    return (most_side, most_moment, most_contact, math.sqrt(max(clearance, 0.0)), steepness, unsteadiness, *few)
