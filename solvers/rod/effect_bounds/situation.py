"""A scene with its strip as the influences of effects see it: one turn with every effect in closed form, and what is
needed to take one away."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue import serensen
from solvers.numerics.periodic import TURN, grid
from solvers.rod.cycle.state import FORCE, MOMENT, SIDE, Strip
from solvers.rod.effect_bounds.inertia import NODES, Motion, motion_rows
from solvers.rod.effect_bounds.main_results import Judged, Judging, change_without, judge, sampled_turn
from solvers.rod.load.axial_force import Drive, axial_forces, drive_of
from solvers.rod.load.gas import sharpest
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.strip.buckling import log_critical_parameter
from solvers.rod.strip.elastica_kernels import collocation
from solvers.rod.strip.shear import critical_coupling
from solvers.rod.strip.stiffness import shear_stiffness
from solvers.rod.vibration.natural_frequencies import natural_frequency

Array = NDArray[np.float64]

_EVEN, _MOST_EVEN = 128, 1024
"""Even angles, as many times more as it takes to resolve the clamp moment."""

_BENT = 0.06
"""Second difference of the clamp moment at even angles, as a share of its greatest, up to which they resolve it."""

_FEW, _MANY = 32, 256
"""Pieces of a load up to which each is sampled inside as well, and up to which all of their ends are."""

_APART = 1e-6


class Sampling(NamedTuple):
    """Crank angles [rad], the first ``even`` of them even; indices that put them in rising order; |dx/dphi| [m] at them
    times each one's share of the turn."""

    angle: Array
    even: int
    order: NDArray[np.intp]
    travel: Array


@dataclass(frozen=True)
class Driven:
    """A scene's turn as every strip in it feels it, sampled once."""

    scene: Scene
    _samplings: dict[int, Sampling] = field(default_factory=dict, repr=False, compare=False)

    @cached_property
    def drive(self) -> Drive:
        """Gas load and all inertia."""
        return drive_of(self.scene, self.scene.piston.reciprocating_mass)

    @cached_property
    def sharp(self) -> Array:
        """Angles [rad] where the load is sharp, with three between the ends of each piece where there are few."""
        sharp = self.scene.load.sharp_angles()
        if not sharp.size:
            return sharp
        ends = np.unique(np.mod(sharp, TURN))
        if ends.size > _MANY:
            ends = sharpest(ends, axial_forces(self.drive, ends), _MANY)
        if ends.size > _FEW:
            return ends
        width = np.diff(ends, append=ends[0] + TURN)
        return np.mod((ends[:, None] + width[:, None] * np.arange(4) / 4).ravel(), TURN)

    def sampling(self, even: int) -> Sampling:
        """So many even angles, and behind them the sharp ones."""
        if even not in self._samplings:
            step = TURN / even
            beside = np.mod(self.sharp + 0.5 * step, step) - 0.5 * step
            angle = np.concatenate([grid(even), self.sharp[np.abs(beside) > _APART]])
            order = np.argsort(angle)
            self._samplings[even] = Sampling(angle, even, order, self._travel(angle, order))
        return self._samplings[even]

    def _travel(self, angle: Array, order: NDArray[np.intp]) -> Array:
        m, rising, width = self.scene.mechanism, angle[order], np.empty(order.size)
        width[order] = 0.5 * (np.append(rising[1:], rising[0] + TURN) - np.append(rising[-1] - TURN, rising[:-1]))
        sine, ratio = np.sin(angle), m.crank_radius / m.rod_length
        lean = np.sqrt((1.0 - ratio * sine) * (1.0 + ratio * sine))
        return np.abs(m.crank_radius * sine * (1.0 + ratio * np.cos(angle) / lean)) * width / TURN


class Turn(NamedTuple):
    """A sampled turn: its strip, what results are made with, the states (``cycle.state``), and the main results."""

    sampling: Sampling
    strip: Strip
    judging: Judging
    states: Array
    judged: Judged

    def part(self, step: int) -> Turn:
        """The turn at every so many of its even angles alone."""
        even = self.sampling.even
        if step == 1 and even == self.sampling.angle.size:
            return self
        angle, travel = self.judging.angle[:even:step].copy(), self.judging.travel[:even:step].copy()
        judging, states = self.judging._replace(angle=angle, travel=travel), self.states[:, :even:step].copy()
        sampling = Sampling(angle, angle.size, np.arange(angle.size), travel)
        judged = judge(
            judging, self.strip, states, states[SIDE], states[MOMENT], np.empty((0, 0)), False, self.judged.critical
        )
        return Turn(sampling, self.strip, judging, states, judged)


@dataclass(frozen=True)
class Situation:
    """A scene with its strip; what is derived from them is found when it is first asked for."""

    driven: Driven
    dimensions: Dimensions
    known: dict[str, float] = field(default_factory=dict, repr=False, compare=False)
    """Influences that others need."""

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
    def stiffness(self) -> float:
        """EI [N m^2]."""
        return self.scene.material.elastic_modulus * self.dimensions.b * self.dimensions.h**3 / 12.0

    @property
    def compliance(self) -> float:
        """g = EI/(kGA) [m^2]."""
        return self.stiffness / shear_stiffness(self.scene, self.dimensions)

    @cached_property
    def in_plane(self) -> float:
        """P_cr [N] of bending in the crank's plane, rigid in shear."""
        length = self.scene.mechanism.rod_length
        return self.stiffness * (math.exp(log_critical_parameter(self.dimensions.l, length)[0]) / length) ** 2

    @property
    def critical(self) -> float:
        """P_cr [N] about the weaker axis, rigid in shear."""
        return self.in_plane * min(1.0, (self.dimensions.b / self.dimensions.h) ** 2)

    @cached_property
    def critical_with_shear(self) -> float:
        """P_cr [N] about the weaker axis, bending in the crank's plane with shear."""
        length = self.scene.mechanism.rod_length
        return min(self.critical, -self.stiffness * critical_coupling(self.dimensions.l, length, self.compliance))

    @cached_property
    def gas_and_inertia(self) -> Array:
        """The axial force [N] without friction at the sampled angles."""
        return axial_forces(self.driven.drive, self.driven.sampling(_EVEN).angle)

    @property
    def compression(self) -> float:
        """The greatest compression [N] without friction."""
        return max(-float(self.gas_and_inertia.min()), 0.0)

    @cached_property
    def strip(self) -> Strip:
        """The strip with every effect in closed form: coupling, shear, friction that acts back."""
        piston = self.scene.piston
        return Strip(
            stiffness=self.stiffness,
            length=self.dimensions.l,
            rod_length=self.scene.mechanism.rod_length,
            couples=1.0,
            compliance=self.compliance,
            friction=4.0 / math.pi * piston.friction_coefficient,
            lever=6.0 / piston.skirt_length,
            offset=piston.clamp_offset,
            buckled=-2.0 * self.critical,
        )

    @cached_property
    def turn(self) -> Turn:
        """The turn with every effect in closed form."""
        return self._resolved(self.driven.drive, self.strip)

    @cached_property
    def upright(self) -> Turn | None:
        """The turn, or where the strip buckles in it one without friction, or without inertia too: what corrections of
        the shape are judged by. None where it buckles under the gas alone."""
        if self.stands:
            return self.turn
        rubless = self.strip._replace(friction=0.0)
        for drive in (self.driven.drive, drive_of(self.scene, 0.0)):
            turn = self._resolved(drive, rubless)
            if turn.judged.stands:
                return turn
        return None

    def _resolved(self, drive: Drive, strip: Strip) -> Turn:
        sharp, even = self.driven.sharp.size > 0, _EVEN
        while True:
            turn = self._turn(self.driven.sampling(even), drive, strip)
            if sharp or not turn.judged.stands or even >= _MOST_EVEN:
                return turn
            moment = turn.states[MOMENT, :even]
            bent = float(np.abs(moment[:-2] - 2.0 * moment[1:-1] + moment[2:]).max()) / float(np.abs(moment).max())
            if not bent > _BENT:
                return turn
            even *= 2 if bent <= 4.0 * _BENT else 4

    def _turn(self, sampling: Sampling, drive: Drive, strip: Strip) -> Turn:
        d, piston, material = self.dimensions, self.scene.piston, self.scene.material
        judging = Judging(
            sampling.angle,
            sampling.travel,
            6.0 / piston.skirt_length,
            piston.clamp_offset,
            4.0 / math.pi * piston.friction_coefficient,
            1.0 / (d.b * d.h),
            0.5 * material.elastic_modulus * d.h,
            *serensen(material).diagram(),
            self.in_plane,
        )
        return Turn(sampling, strip, judging, *sampled_turn(judging, drive, strip, self.critical_with_shear))

    @property
    def stands(self) -> bool:
        return self.turn.judged.stands > 0.0

    def change_without(self, drive: Drive, strip: Strip, critical: float) -> float:
        """The greatest relative change of the main results where the turn is that of this drive and strip."""
        return change_without(self.turn.judging, drive, strip, critical, self.turn.judged)

    @cached_property
    def motion(self) -> Motion | None:
        """What the strip's inertia adds to the upright turn."""
        return None if self.upright is None else motion_of(self, self.upright)

    def pace(self, force: Array) -> Array:
        """omega_1/omega of the strip under axial forces [N]: a parabola through three of them, squared."""
        least, most = float(force.min()), float(force.max())
        known = np.array([least, 0.5 * (least + most), most])
        squares = np.array([natural_frequency(self.scene, self.dimensions, f) for f in known.tolist()]) ** 2
        x = (force - known[1]) / max(0.5 * (most - least), 1e-12 * self.in_plane)
        bent, tilt = 0.5 * (squares[0] + squares[2]) - squares[1], 0.5 * (squares[2] - squares[0])
        return np.sqrt(np.maximum(squares[1] + x * (tilt + x * bent), 1e-6 * squares[1])) / self.scene.mechanism.speed


def motion_of(situation: Situation, turn: Turn) -> Motion:
    """The motion in a turn in which the strip stands."""
    sampling, states, strip = turn.sampling, turn.states, turn.strip
    even = sampling.even
    d, m, material = situation.dimensions, situation.scene.mechanism, situation.scene.material
    l = d.l
    inertia = material.density * d.b * d.h * m.angular_speed**2 * l**4 / situation.stiffness
    pace = situation.pace(states[FORCE])
    rows, rings, either, share = motion_rows(
        states, sampling.order, sampling.angle[sampling.order], pace, l * l / situation.stiffness, l,
        (m.rod_length - l) / l, inertia, even, collocation(NODES), strip.friction, strip.lever, strip.offset,
        situation.in_plane,
    )  # fmt: skip
    per_length = situation.stiffness / l
    return Motion(
        *(-per_length / l * rows[0], per_length * rows[1], rows[2:] / l),
        *(-per_length / l * rings[0], per_length * rings[1], rings[2:] / l),
        *(either, share, float(pace[:even].mean())),
    )
