"""A scene with its strip as the influences of effects see it: turns sampled in closed form, with and without each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue import serensen
from solvers.fatigue.kernels import Diagram, diagram_of
from solvers.numerics.periodic import TURN, grid
from solvers.rod.cycle.state import FORCE, MOMENT, ROWS, SIDE, STROKE, Strip, constants, fill_states
from solvers.rod.effect_bounds.inertia import NODES, corner_ringing, first_iterate, own_motion, quasi_static, share_of
from solvers.rod.effect_bounds.main_results import MOMENT as MOST_MOMENT
from solvers.rod.effect_bounds.main_results import SIDE as MOST_SIDE
from solvers.rod.effect_bounds.main_results import Judged, Section, Skirt, change, judge
from solvers.rod.effect_bounds.ringing_bound import left_ringing, pieces_of
from solvers.rod.load.axial_force import Drive, drive_of
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.strip.buckling import log_critical_parameter
from solvers.rod.strip.elastica_kernels import collocation
from solvers.rod.strip.shear import shear_stiffness
from solvers.rod.vibration.natural_frequencies import natural_frequency

Array = NDArray[np.float64]

EVEN = 128
FASTEST = 40.0
_NO_SERIES = np.empty((0, 0))


@dataclass(frozen=True)
class Driven:
    """A scene's turn as every strip in it feels it, sampled once."""

    scene: Scene

    @cached_property
    def drive(self) -> Drive:
        """Gas load and all inertia."""
        return drive_of(self.scene, self.scene.piston.reciprocating_mass)

    @cached_property
    def sharp(self) -> Array:
        return self.scene.load.sharp_angles()

    @cached_property
    def angles(self) -> Array:
        """Even angles, then those where the load is sharp [rad]."""
        return _told_apart(grid(EVEN), self.sharp)

    @cached_property
    def speeds(self) -> Array:
        """|dx/dphi| [m] at the angles, times each one's share of the turn."""
        m, angle = self.scene.mechanism, np.mod(self.angles, TURN)
        order = np.argsort(angle)
        rising = angle[order]
        width = np.empty(angle.size)
        width[order] = 0.5 * (np.append(rising[1:], rising[0] + TURN) - np.append(rising[-1] - TURN, rising[:-1]))
        sine, ratio = np.sin(angle), m.crank_radius / m.rod_length
        lean = np.sqrt((1.0 - ratio * sine) * (1.0 + ratio * sine))
        return np.abs(m.crank_radius * sine * (1.0 + ratio * np.cos(angle) / lean)) * width / TURN

    @cached_property
    def order(self) -> NDArray[np.intp]:
        """Indices that put the angles in rising order."""
        return np.argsort(np.mod(self.angles, TURN))

    @cached_property
    def rising(self) -> Array:
        return np.mod(self.angles, TURN)[self.order]

    @cached_property
    def diagram(self) -> Diagram:
        return diagram_of(serensen(self.scene.material))


def _told_apart(even: Array, sharp: Array) -> Array:
    """Even angles, and behind them sharp ones and what divides the pieces between these, none twice."""
    if not sharp.size:
        return even
    ends = np.unique(np.mod(sharp, TURN))
    ends = np.append(ends, ends[0] + TURN)
    if ends.size <= 33:
        ends = (ends[:-1, None] + np.diff(ends)[:, None] * np.arange(4) / 4).ravel()
    more = np.mod(ends, TURN)
    gap = np.mod(more, TURN / EVEN)
    return np.concatenate([even, more[np.minimum(gap, TURN / EVEN - gap) > 1e-6]])


@dataclass(frozen=True)
class Situation:
    """A scene with its strip; turns are sampled when they are asked for."""

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
    def stiffness(self) -> float:
        """EI [N m^2]."""
        return self.scene.material.elastic_modulus * self.dimensions.b * self.dimensions.h**3 / 12.0

    @cached_property
    def critical(self) -> float:
        """P_cr [N] about the weaker axis, rigid in shear."""
        d = self.dimensions
        return self._critical_in_plane * min(1.0, (d.b / d.h) ** 2)

    @cached_property
    def _critical_in_plane(self) -> float:
        ln_u, _ = log_critical_parameter(self.dimensions.l, self.scene.mechanism.rod_length)
        return self.stiffness * (math.exp(ln_u) / self.scene.mechanism.rod_length) ** 2

    @cached_property
    def critical_with_shear(self) -> float:
        """P_cr [N] about the weaker axis, bending in the crank's plane with shear."""
        compliance = self._compliance
        rigid = -self._critical_in_plane / self.stiffness
        length = self.dimensions.l, self.scene.mechanism.rod_length

        def left(q: float) -> float:
            return 1.0 / constants(q, *length, compliance)[2]

        before, here = 0.95 * rigid / (1.0 - compliance * rigid), rigid / (1.0 - compliance * rigid)
        value = left(before)
        for _ in range(4):
            value_here = left(here)
            if value_here == value:
                break
            before, here, value = here, here - value_here * (here - before) / (value_here - value), value_here
        return min(self.critical, -here * self.stiffness)

    @property
    def _compliance(self) -> float:
        return self.stiffness / shear_stiffness(self.scene, self.dimensions)

    @cached_property
    def compression(self) -> float:
        """The greatest compression [N] of gas and inertia at the sampled angles."""
        from solvers.rod.load.axial_force import axial_forces

        return max(-float(axial_forces(self.driven.drive, self.driven.angles).min()), 0.0)

    def strip(self, couples: float = 1.0, shears: bool = True, rubs: bool = True) -> Strip:
        piston = self.scene.piston
        return Strip(
            stiffness=self.stiffness,
            length=self.dimensions.l,
            rod_length=self.scene.mechanism.rod_length,
            couples=couples,
            compliance=self._compliance if shears else 0.0,
            friction=4.0 / math.pi * piston.friction_coefficient if rubs else 0.0,
            lever=6.0 / piston.skirt_length,
            offset=piston.clamp_offset,
            buckled=-2.0 * self.critical,
        )

    def sampled(self, strip: Strip, drive: Drive | None = None) -> Array:
        states = np.empty((ROWS, self.driven.angles.size))
        fill_states(drive or self.driven.drive, strip, self.driven.angles, states)
        return states

    @cached_property
    def section(self) -> Section:
        d, e = self.dimensions, self.scene.material.elastic_modulus
        return Section(1.0 / (d.b * d.h), 0.5 * e * d.h, *self.driven.diagram)

    def judged(self, states: Array, strip: Strip) -> Judged:
        return self._judged(states, strip, states[SIDE], states[MOMENT], _NO_SERIES, False)

    def _judged(
        self, states: Array, strip: Strip, side: Array, moment: Array, series: Array, inclined: bool, count: int = 0
    ) -> Judged:
        piston = self.scene.piston
        skirt = Skirt(6.0 / piston.skirt_length, piston.clamp_offset)
        return judge(
            *(states, side, moment, series, inclined, self.dimensions.l, strip.compliance),
            *(skirt, self.section, self.driven.speeds[: states.shape[1]]),
        )

    @cached_property
    def full_strip(self) -> Strip:
        return self.strip()

    @cached_property
    def full(self) -> Array:
        return self.sampled(self.full_strip)

    @cached_property
    def full_judged(self) -> Judged:
        return self.judged(self.full, self.full_strip)

    @cached_property
    def stands(self) -> bool:
        return bool(self.full[FORCE].min() > -min(self.critical_with_shear, self.critical))

    def without(self, strip: Strip, drive: Drive | None = None, critical: float | None = None) -> float:
        """The change of the main results where the turn is that of another strip or drive."""
        if not self.stands:
            return math.inf
        critical = critical or self.critical_with_shear
        states = self.sampled(strip, drive)
        if states[FORCE].min() <= -critical:
            return math.inf
        return change(self.judged(states, strip), self.full_judged, self.critical_with_shear, critical)

    def large_displacement(self) -> float:
        if not self.stands:
            return math.inf
        states, strip, l = self.full, self.full_strip, self.dimensions.l
        per_force = l * l / self.stiffness
        force = states[FORCE] * per_force
        tables = collocation(nodes_for(float(force.min()), float(force.max())))
        head = self.scene.mechanism.rod_length - l
        series, side, clamp = third_orders_of(states, strip.stiffness, l, head, 1.0, strip.compliance, tables)
        found = self._judged(
            states, strip, states[SIDE] - side / per_force / 1.0, states[MOMENT] + clamp * self.stiffness / l,
            series / l, True,
        )  # fmt: skip
        return change(self.full_judged, found, 1.0, 1.0)

    @cached_property
    def pace(self) -> Array:
        """omega_1/omega of the strip under the force at every angle."""
        force = self.full[FORCE]
        known = np.array([force.min(), 0.5 * (force.min() + force.max()), force.max()])
        if known[2] - known[0] <= 1e-9 * self.critical:
            return np.full(force.size, self._pace_at(float(known[1])))
        squares = np.array([self._pace_at(f) ** 2 for f in known.tolist()])
        x = 2.0 * (force - known[1]) / (known[2] - known[0])
        bent, tilt = 0.5 * (squares[0] + squares[2]) - squares[1], 0.5 * (squares[2] - squares[0])
        return np.sqrt(np.maximum(squares[1] + x * (tilt + x * bent), 1e-6 * squares[1]))

    def _pace_at(self, force: float) -> float:
        return natural_frequency(self.scene, self.dimensions, force) / self.scene.mechanism.speed

    def rod_inertia(self, error=(0.0, 1.0)) -> float:
        if not self.stands:
            return math.inf
        strip, d, m = self.full_strip, self.dimensions, self.scene.mechanism
        l, tables = d.l, collocation(NODES)
        states = self.full.copy()
        states[STROKE] /= l
        per_force, head = l * l / self.stiffness, (m.rod_length - l) / l
        inertia = self.scene.material.density * d.b * d.h * m.angular_speed**2 * l**4 / self.stiffness
        rise = quasi_static(states, per_force, head, tables)
        iterate, shape, greatest = first_iterate(rise, states, per_force, head, inertia, EVEN, tables)
        share = share_of(rise, shape)
        order, pace = self.driven.order, self.pace
        smooth = not self.driven.sharp.size
        even = share[:EVEN]
        step = TURN / EVEN
        follows = -(np.roll(even, 1) - 2.0 * even + np.roll(even, -1)) / (step * pace[:EVEN]) ** 2
        fast = pace.min() > FASTEST
        signs = (1.0,)
        if smooth and fast:
            rings = np.full(EVEN, corner_ringing(self.full, EVEN, share, pace, strip.friction, strip.lever, strip.offset,
                self.critical, error[0]))
            if rings[0] > 0.02 * np.abs(follows).max(): signs=(1.0,-1.0)
        else:
            rings = np.empty(share.size)
            rings[order] = own_motion(self.driven.rising, share[order], pace[order], smooth, error[0])
            rings = rings[:EVEN] - follows
            if fast:
                rings = np.abs(rings)
                rings = np.max([np.roll(rings, k) for k in range(-2, 3)], axis=0)
                signs=(1.0,-1.0)
        self.__dict__["debug"] = rings, follows
        states = np.ascontiguousarray(self.full[:, :EVEN])
        base = self.judged(states, strip)
        out = 0.0
        for sign in signs:
            more = rings * sign * (np.sign(states[STROKE]) if fast else 1.0)
            motion = iterate + np.outer(iterate[:, greatest], more)
            found = self._judged(
                states, strip, states[SIDE] - motion[0] * self.stiffness / l**2, states[MOMENT] + motion[1] * self.stiffness / l,
                np.ascontiguousarray(motion[2:]) / l, False,
            )  # fmt: skip
            out = max(out, change(base, found, 1.0, 1.0))
        return out
