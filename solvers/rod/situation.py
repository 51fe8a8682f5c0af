"""A scene with its strip as the bounds of effects see it: extremes of forces and reactions, sampled closed forms."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.numerics import periodic
from solvers.numerics.jit import kernel
from solvers.numerics.periodic import grid
from solvers.rod import beam_column, strip_kernels
from solvers.rod.drive import Drive, axial_forces, drive_of
from solvers.rod.enclosures import critical_parameter
from solvers.rod.envelope import beam_constants
from solvers.rod.scene import Dimensions, Scene

Array = NDArray[np.float64]

_EVEN, _FINE = grid(64), grid(512)


@dataclass(frozen=True)
class Driven:
    """A scene's forces as every strip in it feels them, each sampled once."""

    scene: Scene

    @cached_property
    def _angles(self) -> Array:
        return np.concatenate([_EVEN, self.scene.load.sharp_angles()])

    @cached_property
    def _gas(self) -> Drive:
        return drive_of(self.scene, 0.0)

    @cached_property
    def gas_extremes(self) -> tuple[float, float]:
        """The least and the greatest gas force [N]."""
        force = axial_forces(self._gas, self._angles)
        return float(force.min()), float(force.max())

    @cached_property
    def coarse(self) -> tuple[Array, Array]:
        """Axial force [N] with all inertia, and sin(phi), at angles that show the load's extremes."""
        return self.at(self._angles)

    @cached_property
    def fine(self) -> tuple[Array, Array]:
        """The same at evenly spaced angles, close enough for second differences."""
        return self.at(_FINE)

    def at(self, angles: Array) -> tuple[Array, Array]:
        """Axial force [N] with all inertia, and sin(phi), at these angles."""
        return axial_forces(self._gas._replace(mass=self.scene.piston.reciprocating_mass), angles), np.sin(angles)


@dataclass(frozen=True)
class Situation:
    """A scene with its strip, and what the bounds need of it, each computed once."""

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
        return self.driven.gas_extremes

    @cached_property
    def inertia_force(self) -> float:
        """m_j r omega^2 (1 + lambda) [N]: the greatest, at top dead centre."""
        m = self.scene.mechanism
        top = m.crank_radius * m.angular_speed**2 * (1.0 + m.crank_radius / m.rod_length)
        return self.scene.piston.reciprocating_mass * top

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
        return max(-self.gas_extremes[0], 0.0) + self.inertia_force

    @cached_property
    def least_extreme(self) -> float:
        """The smaller of the force's two extremes in magnitude: what a small error weighs most against."""
        return min(abs(force) for force in self.gas_extremes)

    @cached_property
    def amplification(self) -> float:
        """1/(1 - |P|/P_cr): how much nearness to buckling magnifies a small change; inf at and beyond buckling."""
        margin = 1.0 - self.compression / self.critical
        return 1.0 / margin if margin > 0 else math.inf

    @cached_property
    def constants(self) -> beam_column.BeamConstants:
        """The beam at the least and the greatest force, and at none."""
        least, most = self.gas_extremes
        coupling = np.array([least - self.inertia_force, most + self.inertia_force, 0.0]) / self.stiffness
        length, rod_length = self.dimensions.l, self.scene.mechanism.rod_length
        return beam_column.BeamConstants(
            coupling, length, rod_length, *strip_kernels.solve(coupling, length, rod_length)
        )

    @cached_property
    def _reactions(self) -> tuple[float, float, float]:
        """Greatest side force [N], clamp moment [N m] and contact load [N] at the sampled angles."""
        piston = self.scene.piston
        lever, offset = 6.0 / piston.skirt_length, piston.clamp_offset
        m = self.scene.mechanism
        stroke = self.stiffness * m.crank_radius
        return _greatest_reactions(
            *self.driven.coarse, self.stiffness, self.dimensions.l, m.rod_length, stroke, lever, offset
        )

    @cached_property
    def unsteadiness(self) -> float:
        """Greatest acceleration of the strip's middle, beside that of one that follows the stroke's sine: 1 or more."""
        length, rod_length = self.dimensions.l, self.scene.mechanism.rod_length
        return max(1.0, _middle_acceleration(*self.driven.fine, self.stiffness, length, rod_length))

    def jolt(self, frequency: float) -> float:
        """How far a jump of the force sets a mode of this frequency [Hz] ringing, as a share of the greatest reactions.

        A change that takes the time t leaves at most min(1, 1/(pi f t)) of itself as ringing. Only steps between the
        load's own angles count that even samples do not see; what they see is ``unsteadiness``.
        """
        angles = np.unique(np.mod(self.scene.load.sharp_angles(), periodic.TURN))
        gaps = np.diff(angles)
        close = np.flatnonzero(gaps < periodic.TURN / _FINE.size)
        if not close.size:
            return 0.0
        force, sine = self.driven.at(angles)
        length, rod_length = self.dimensions.l, self.scene.mechanism.rod_length
        clamp, shear, _, _ = strip_kernels.solve(force / self.stiffness, length, rod_length)
        left = 1.0 / np.maximum(1.0, 0.5 * frequency * gaps[close] / self.scene.mechanism.speed)
        shares = [0.0]
        for reaction, greatest in zip((shear * sine, clamp * sine), self._reactions[:2], strict=True):
            change = np.abs(np.diff(reaction)[close]) * self.stiffness * self.scene.mechanism.crank_radius
            shares.append(float(np.max(change * left)) / greatest if greatest else math.inf)
        return max(shares)

    @cached_property
    def weakness(self) -> float:
        """How small the axial force makes the guide's greatest reactions, beside those of the strip's stiffness alone.

        An effect changes them by a share of the latter. The greatest ratio of side forces, moments and contact loads.
        """
        piston, c, r = self.scene.piston, self.constants, self.scene.mechanism.crank_radius
        side, moment = -self.stiffness * r * float(c.clamp_shear[2]), self.stiffness * r * float(c.clamp_curvature[2])
        contact = abs(side) + 6.0 / piston.skirt_length * (abs(moment) + abs(side * piston.clamp_offset))
        wholes = abs(side), abs(moment), contact
        return max(1.0, *(w / x if x else math.inf for w, x in zip(wholes, self._reactions, strict=True)))

    def direct(self, force: float) -> float:
        """The stress of a small axial force [N], as a share of the amplitude of the bending stress."""
        bending = 0.5 * self.dimensions.h / self.stiffness * self._reactions[1] * self.scene.material.elastic_modulus
        share = force / (self.dimensions.b * self.dimensions.h)
        return share / bending if bending else math.inf


@kernel
def _greatest_reactions(
    force: Array, sine: Array, stiffness: float, l: float, rod_length: float, stroke: float, lever: float, offset: float
) -> tuple[float, float, float]:
    """Greatest |T|, |M0| and |T| + lever |M0 + T offset|; ``stroke`` is EI r."""
    most_side, most_moment, most_contact = 0.0, 0.0, 0.0
    for i in range(force.size):
        clamp, shear, _, _ = beam_constants(force[i] / stiffness, l, rod_length)
        side, moment = -shear * stroke * sine[i], clamp * stroke * sine[i]
        most_side, most_moment = max(most_side, abs(side)), max(most_moment, abs(moment))
        most_contact = max(most_contact, abs(side) + lever * abs(moment + side * offset))
    return most_side, most_moment, most_contact


@kernel
def _middle_acceleration(force: Array, sine: Array, stiffness: float, l: float, rod_length: float) -> float:
    """Greatest second difference of V(l/2) over the turn, beside that of a sine with the stiffness alone."""
    angles = force.size
    step = 2.0 * math.pi / angles
    q = np.zeros(angles + 1)
    for i in range(angles):
        q[i] = force[i] / stiffness
    clamp, shear, head, _ = strip_kernels.solve(q, l, rod_length)
    middle = strip_kernels.deflection(q, l, clamp, shear, head, np.array([0.5 * l]))[0]
    most = 0.0
    before, here = middle[angles - 1] * sine[angles - 1], middle[0] * sine[0]
    for i in range(angles):
        follows = i + 1 if i < angles - 1 else 0
        after = middle[follows] * sine[follows]
        most = max(most, abs(before - 2.0 * here + after))
        before, here = here, after
    return most / (step * step) / middle[angles]
