"""The full model of a strip as the search sees it: peaks, rows near them, and the exact check.

Everything that a design asks of effects beyond the core's physics goes through ``FullModel``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from solvers.effects import EffectSelection
from solvers.fatigue import FatigueCriterion
from solvers.numerics import periodic
from solvers.outcome import Outcome
from solvers.rod import rows
from solvers.rod.check import RodCheck, check
from solvers.rod.cycle.composition import Array, Composition, Cycle
from solvers.rod.optimum.peak_model import buckled_rows
from solvers.rod.optimum.peaks import Peaks, Wanted, compression_peaks, peaks_of
from solvers.rod.optimum.smooth_parts import Parts, vertex
from solvers.rod.piston.friction import power_at
from solvers.rod.piston.skirt import pressure_per_load
from solvers.rod.rows import Layout
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.strip import buckling, shear
from solvers.rod.strip.stiffness import bending_stiffness, shear_stiffness
from solvers.rod.vibration.steady_response import RodInertia

_WHOLE = periodic.grid(256)
"""Angles of the mean of friction power: what they miss, strips near each other miss alike, and exact checks tell."""
_STEP, _COARSE_STEP = 1e-6, 1e-5
"""Of differences in ln b, ln h, ln l: one-sided of closed forms, central where time meshes change between strips."""
_KEPT = 4
_LEAST = 1e-300

Watch = Callable[[], None]


def no_watch() -> None:
    """No limit on the time."""


@dataclass
class FullModel:
    """The physics chosen for a scene, its criterion, what is looked at, and the accuracy of all that.

    ``effects`` are those that run, settled. ``strips`` counts the strips evaluated by rows, ``checks`` the exact ones.
    ``watch`` is called before each and may raise OutOfTime.
    """

    scene: Scene
    composition: Composition
    criterion: FatigueCriterion
    effects: EffectSelection
    effect_tolerance: float
    accuracy: float
    wanted: Wanted
    watch: Watch = no_watch
    strips: int = 0
    checks: int = 0
    _strips: dict[Dimensions, FullStrip] = field(default_factory=dict)
    _checks: dict[Dimensions, Outcome[RodCheck]] = field(default_factory=dict)

    @property
    def ripples(self) -> bool:
        """Whether results ripple from strip to strip: the strip's inertia rings undamped, and time meshes change."""
        return any(isinstance(part, RodInertia) for part in self.composition.corrections)

    def strip(self, d: Dimensions) -> FullStrip:
        """One strip at any angles and sections; the last few are kept."""
        if d not in self._strips:
            self.watch()
            self.strips += 1
            while len(self._strips) >= _KEPT:
                del self._strips[next(iter(self._strips))]
            self._strips[d] = FullStrip(Cycle(self.scene, d, self.composition, 0.1 * self.accuracy))
        return self._strips[d]

    def check(self, d: Dimensions) -> Outcome[RodCheck]:
        """The exact check of a strip."""
        if d not in self._checks:
            self.watch()
            self.checks += 1
            settled = self.effects, self.effect_tolerance, self.accuracy, self.criterion
            self._checks[d] = check(self.scene, d, *settled)
        return self._checks[d]

    def checked(self) -> Iterable[Outcome[RodCheck]]:
        """All checks so far."""
        return self._checks.values()

    def peaks(self, d: Dimensions) -> Peaks:
        """Where a strip's results peak; it must not buckle."""
        strip = self.strip(d)
        pushed = compression_peaks(strip.cycle.axial_force)
        return peaks_of(strip, self.criterion.diagram(), self.wanted)._replace(pushed=pushed)

    def following(self, peaks: Peaks, d: Dimensions) -> FullRows:
        """The rows of strips near this one, which has these peaks, maybe with those of others."""
        stresses = self.strip(d).stresses(peaks.threes(), peaks.stations())
        parts = Parts.near_the_worst(stresses, peaks.angles, self.criterion.diagram())
        return FullRows(self, peaks, parts, d)


@dataclass(frozen=True)
class FullStrip:
    """One strip of the full model: a ``peaks.Response``."""

    cycle: Cycle

    @property
    def dimensions(self) -> Dimensions:
        return self.cycle.dimensions

    def stresses(self, angle: Array, eta: Array) -> Array:
        d, shape = self.dimensions, self.cycle.at(angle).shape
        z = (1.0 - eta) * d.l
        direct = shape.axial_force(z) / (d.b * d.h)
        bending = 0.5 * self.cycle.scene.material.elastic_modulus * d.h * shape.curvature(z)
        return np.array([direct + bending, direct - bending])

    def reactions(self, angle: Array) -> Array:
        piston, shape = self.cycle.scene.piston, self.cycle.at(angle).shape
        side, moment = shape.side_force(), shape.clamp_moment()
        couple = 6.0 * np.abs(moment + side * piston.clamp_offset) / piston.skirt_length
        return np.array([np.abs(side), np.abs(side) + couple])

    def friction_power(self) -> float:
        """The mean over equal steps of the turn [W]."""
        now = self.cycle.at(_WHOLE)
        power = power_at(self.cycle.scene, _WHOLE, now.shape.side_force(), now.shape.clamp_moment())
        return float(np.mean(power))

    @cached_property
    def critical(self) -> tuple[float, float]:
        """Critical forces in the crank's plane, with shear where that runs, and out of it [N]."""
        d, scene, length = self.dimensions, self.cycle.scene, self.cycle.scene.mechanism.rod_length
        stiffness, plain = bending_stiffness(scene, d), float(buckling.critical_coupling(d.l, length))
        inside = plain
        if self.cycle.composition.beam.shears:
            inside = shear.critical_coupling(d.l, length, stiffness / shear_stiffness(scene, d))
        return -stiffness * inside, -stiffness * plain * (d.b / d.h) ** 2


@dataclass(frozen=True)
class FullRows:
    """All rows of strips near one whose peaks are known, as functions of x = ln(b, h, l)."""

    model: FullModel
    peaks: Peaks
    parts: Parts
    home: Dimensions

    @property
    def layout(self) -> Layout:
        parts = self.parts
        return Layout(parts.utilisations.shape[1], parts.stresses.shape[1], self.peaks.reactions.size)

    def values(self, x: Array) -> Array:
        """All rows, shape (rows,)."""
        out = np.zeros(self.layout.size)
        scene, diagram = self.model.scene, self.model.criterion.diagram()
        strip = self.model.strip(self._dimensions(x))
        d, piston = strip.dimensions, scene.piston
        out[rows.TAU], out[rows.LENGTH] = -math.log(d.b * d.h**3), math.log(d.l)
        out[rows.THICKNESS] = math.log(d.h)
        pushed = float(np.max(vertex(*-strip.cycle.axial_force(self.peaks.pushed_threes()).reshape(-1, 3).T)))
        out[[rows.STABILITY, rows.SIDEWAYS]] = (
            np.log(pushed / np.array(strip.critical)) if pushed > 0.0 else rows.NEVER_COMPRESSED
        )
        if out[rows.STABILITY] >= 0.0:
            buckled_rows(out)
            return out
        stresses = strip.stresses(self.peaks.threes(), self.peaks.stations())
        used, strained = self.parts.values(stresses, diagram)
        self._put(out, rows.UTILISATION, used)
        self._put(out, rows.STRESS, strained)
        if self.peaks.reactions.size:
            side, contact = (vertex(*row.reshape(-1, 3).T) for row in strip.reactions(self.peaks.reaction_threes()))
            self._put(out, rows.SIDE, side)
            self._put(out, rows.PRESSURE, contact * pressure_per_load(piston.diameter, piston.skirt_length))
        if self.model.wanted.power:
            out[rows.POWER] = math.log(max(strip.friction_power(), _LEAST))
        if not np.all(np.isfinite(out)):
            buckled_rows(out)
        return out

    def _dimensions(self, x: Array) -> Dimensions:
        """The strip of the logarithms x; the one that the rows are of has its sizes to the last place."""
        return self.home if np.array_equal(x, logarithms(self.home)) else dimensions_of(x, self.model.scene)

    def _put(self, out: Array, row: int, parts: Array) -> None:
        """A row and its parts."""
        logs = np.log(np.maximum(parts, _LEAST))
        out[self.layout.parts(row)], out[row] = logs, logs.max()

    def slopes(self, x: Array) -> Array:
        """Their derivatives by x, shape (rows, 3), by differences; to one side beside buckling and the rod's end."""
        here, out = self.values(x), np.empty((self.layout.size, 3))
        meshed = self.model.ripples
        step = _COARSE_STEP if meshed else _STEP
        for v, unit in enumerate(np.eye(3)):
            up, down = self._beside(x + step * unit), None
            if up is None or meshed:
                down = self._beside(x - step * unit)
            if up is None and down is None:
                up = down = here
            first, last = (here if down is None else down), (here if up is None else up)
            out[:, v] = (last - first) / (step * ((up is not None) + (down is not None)))
        return out

    def _beside(self, x: Array) -> Array | None:
        """The rows at x; None where there is no such strip."""
        if x[2] > math.log(self.model.scene.mechanism.rod_length):
            return None
        values = self.values(x)
        return None if values[rows.UTILISATION] == rows.BUCKLED else values


def logarithms(d: Dimensions) -> Array:
    """ln of b, h, l [m]."""
    return np.log([d.b, d.h, d.l])


def dimensions_of(x: Array, scene: Scene) -> Dimensions:
    """The strip of the logarithms x of b, h, l."""
    b, h, l = np.exp(x).tolist()
    return Dimensions(b, h, min(l, scene.mechanism.rod_length))
