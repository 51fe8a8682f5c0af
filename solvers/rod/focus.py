"""The crank angles and sections that govern a strip, and its results from them alone.

Where stresses peak is found once on a fine grid; from then on the peaks are followed by parabolas through three angles
and three sections beside each of them. That makes an evaluation of a strip, with all derivatives, a matter of
microseconds, and exact at the strip in focus: away from it the error grows with the cube of the distance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.rod.enclosures import clamp, critical_parameter, curvature_and_stiffness
from solvers.rod.haigh import severities, utilisation_of
from solvers.rod.rows import COUNT, LENGTH, POWER, PRESSURE, SIDE, STABILITY, TAU, THICKNESS, UTILISATION

Array = NDArray[np.float64]

ANGLE_STEP = 0.01
SECTION_STEP = 0.006
_TRUSTED = 1.0
FIXED_ROWS = COUNT
_STEP = 1e-6
_SECTIONS = 41
_FINE = 21
_ZOOM = 17
_SECTION_SPAN = 0.04
_BUCKLED = 40.0
_HUMP = 0.8


class Focus(NamedTuple):
    """What governs a strip, as arrays that kernels take. SI units.

    force, stroke        at the governing angles, in threes one ANGLE_STEP apart
    eta                  sections by distance from the head over l: the clamp first, then in threes (ends may repeat)
    react_force, react_stroke   at the peaks of side force and contact pressure, in threes one ANGLE_STEP apart
    cycle_force, cycle_stroke, cycle_speed   the whole cycle at equal steps, for power; speed [m/s]
    lines, parabola      the fatigue criterion as in ``relaxation.Relaxation``
    compression          the cycle's greatest [N]
    guide                clamp offset, diameter, skirt length [m], friction coefficient
    """

    force: Array
    stroke: Array
    eta: Array
    react_force: Array
    react_stroke: Array
    cycle_force: Array
    cycle_stroke: Array
    cycle_speed: Array
    lines: Array
    parabola: Array
    compression: float
    guide: Array
    modulus: float
    rod_length: float


@kernel
def peak(left: float, middle: float, right: float) -> float:
    """The height of the parabola through three samples if its vertex lies near them, else the greatest sample."""
    bend = 2.0 * middle - left - right
    slope = 0.5 * (right - left)
    if bend > 0.0 and abs(slope) <= _TRUSTED * bend:
        return middle + 0.5 * slope * slope / bend
    return max(middle, max(left, right))


@kernel
def reaction(force: float, stroke: float, f: Focus, l: float, scale: float) -> tuple[float, float]:
    """|T| and 6 |M0 + T e|/Lp [N] at one angle; ``scale`` is 1/EI."""
    _, stiffness, _ = clamp(force * scale, l, f.rod_length)
    k, s = stiffness / scale, abs(stroke)
    return s * abs(k), 6.0 / f.guide[2] * s * abs((f.rod_length + f.guide[0]) * k - force)


@kernel
def rows_at(f: Focus, b: float, h: float, l: float, reactions: bool, table: Array, out: Array) -> None:
    """Logarithms of all results: those of ``rows``, sideways stability, stress, then utilisations.

    out[UTILISATION] is the greatest; out[FIXED_ROWS], out[FIXED_ROWS + 1] are ln(compression/sideways critical force)
    and ln(greatest stress); from FIXED_ROWS + 2 on, two fibres for every group of sections. Stability is
    ln(compression/critical force); ``table`` is room of shape (angles, sections).
    """
    tau, L = 1.0 / (b * h * h * h), f.rod_length
    scale = 12.0 * tau / f.modulus
    groups = 1 + (f.eta.size - 1) // 3
    out[TAU], out[LENGTH], out[THICKNESS] = math.log(tau), math.log(l), math.log(h)
    out[SIDE] = out[PRESSURE] = out[POWER] = 0.0
    if f.compression > 0.0:
        ln_u, _ = critical_parameter(l, L)
        euler = 2.0 * ln_u + math.log(f.modulus / (12.0 * L * L * f.compression))
        out[STABILITY], out[FIXED_ROWS] = math.log(tau) - euler, -math.log(h * b * b * b) - euler
    else:
        out[STABILITY] = out[FIXED_ROWS] = -700.0
    if out[STABILITY] >= 0.0:
        for r in range(FIXED_ROWS + 1, out.size):
            out[r] = _BUCKLED
        out[UTILISATION] = out[SIDE] = out[PRESSURE] = out[POWER] = _BUCKLED
        return
    for i in range(f.force.size):
        curvature_and_stiffness(f.force[i] * scale, l, L, f.eta, table[i])
    worst, greatest = 0.0, 0.0
    value, strength = np.empty(3), np.empty(3)
    for fibre in range(2):
        sign = 1.0 - 2.0 * fibre
        bending = sign * 0.5 * f.modulus * h
        for g in range(groups):
            sections = 1 if g == 0 else 3
            for k in range(sections):
                j = 0 if g == 0 else 3 * g - 2 + k
                high, low = -np.inf, np.inf
                for i in range(0, f.force.size, 3):
                    a = f.force[i] / (b * h) + bending * f.stroke[i] * table[i, j]
                    m = f.force[i + 1] / (b * h) + bending * f.stroke[i + 1] * table[i + 1, j]
                    c = f.force[i + 2] / (b * h) + bending * f.stroke[i + 2] * table[i + 2, j]
                    high, low = max(high, peak(a, m, c)), min(low, -peak(-a, -m, -c))
                strength[k] = max(high, -low)
                value[k] = utilisation_of(high, low, f.lines, f.parabola) if high > low else 0.0
            top = value[0] if g == 0 else peak(value[0], value[1], value[2])
            worst = max(worst, top)
            most = strength[0] if g == 0 else peak(strength[0], strength[1], strength[2])
            greatest = max(greatest, most)
            out[FIXED_ROWS + 2 + 2 * g + fibre] = math.log(max(top, 1e-300))
    out[UTILISATION], out[FIXED_ROWS + 1] = math.log(max(worst, 1e-300)), math.log(max(greatest, 1e-300))
    if reactions:
        side, pressure, power = 0.0, 0.0, 0.0
        _, diameter, skirt, friction = f.guide
        n, peaks = f.cycle_force.size, f.react_force.size
        sides, pressures = np.empty(3), np.empty(3)
        for i in range(peaks):
            sides[i % 3], couple = reaction(f.react_force[i], f.react_stroke[i], f, l, scale)
            pressures[i % 3] = sides[i % 3] + couple
            if i % 3 == 2:
                side = max(side, peak(sides[0], sides[1], sides[2]))
                pressure = max(pressure, peak(pressures[0], pressures[1], pressures[2]))
        for i in range(n):
            T, couple = reaction(f.cycle_force[i], f.cycle_stroke[i], f, l, scale)
            power += (0.5 * (couple + T * T / couple) if couple > T else T) * f.cycle_speed[i]
        out[SIDE], out[PRESSURE] = (
            math.log(max(side, 1e-300)),
            math.log(max(pressure * 4.0 / (math.pi * diameter * skirt), 1e-300)),
        )
        out[POWER] = math.log(max(power / n * friction * 4.0 / math.pi, 1e-300))


@kernel
def rows_and_slopes(f: Focus, x: Array, reactions: bool, table: Array, out: Array, slopes: Array) -> None:
    """``rows_at`` the logarithms x of b, h, l, and its derivatives by them, shape (rows, 3), by central differences."""
    up, down, moved = np.empty(out.size), np.empty(out.size), x.copy()
    moved[2] = min(moved[2], math.log(f.rod_length) - _STEP)
    for v in range(3):
        here = moved[v]
        moved[v] = here + _STEP
        rows_at(f, math.exp(moved[0]), math.exp(moved[1]), min(math.exp(moved[2]), f.rod_length), reactions, table, up)
        moved[v] = here - _STEP
        rows_at(
            f, math.exp(moved[0]), math.exp(moved[1]), min(math.exp(moved[2]), f.rod_length), reactions, table, down
        )
        moved[v] = here
        for r in range(out.size):
            slopes[r, v] = (up[r] - down[r]) / (2.0 * _STEP)
    rows_at(f, math.exp(x[0]), math.exp(x[1]), min(math.exp(x[2]), f.rod_length), reactions, table, out)


@kernel
def stress_table(
    force: Array, stroke: Array, modulus: float, rod_length: float, b: float, h: float, l: float, eta: Array, out: Array
) -> None:
    """Both fibres' stresses [Pa] at all sections and angles, shape (2, sections, angles)."""
    scale = 12.0 / (modulus * b * h * h * h)
    room = np.empty(eta.size)
    for i in range(force.size):
        curvature_and_stiffness(force[i] * scale, l, rod_length, eta, room)
        direct, bending = force[i] / (b * h), 0.5 * modulus * h * stroke[i]
        for j in range(eta.size):
            out[0, j, i], out[1, j, i] = direct + bending * room[j], direct - bending * room[j]


class Cycle(Protocol):
    """What a focus has to know of a machine: its axial force [N] at any crank angles."""

    def axial_force(self, angle: Array) -> Array: ...


@dataclass(frozen=True)
class Machine:
    """A cycle sampled once, to be focused on any strip."""

    cycle: Cycle
    crank_radius: float
    rod_length: float
    modulus: float
    guide: Array
    lines: Array
    parabola: Array
    angle: Array
    force: Array
    stroke: Array
    speed: Array
    compression: float
    hardest: float

    def focus_at(self, b: float, h: float, l: float, stress: bool, reactions: bool) -> tuple[Focus, Array]:
        """The focus on a strip, and the middle angle of each of its threes.

        ``stress`` asks for the sections of greatest stress beside those of greatest utilisation, ``reactions`` for the
        angles at which side force and contact pressure peak.
        """
        eta = np.linspace(0.0, 1.0, _SECTIONS)[::-1].copy()
        table = np.empty((2, eta.size, self.angle.size))
        stress_table(self.force, self.stroke, self.modulus, self.rod_length, b, h, l, eta, table)
        high, low = table.max(axis=2), table.min(axis=2)
        severity = np.empty_like(high)
        severities(high, low, self.lines, self.parabola, severity)
        chosen = _apart(_inner_peaks(severity, eta))
        by_use = len(chosen)
        if stress:
            chosen += _apart(_inner_peaks(np.maximum(high, -low), eta))
        columns = [0] + [int(np.argmin(np.abs(eta - section))) for section in chosen]
        peaks = table[:, columns].reshape(-1, self.angle.size)
        index = np.unique(np.concatenate([peaks.argmax(axis=1), peaks.argmin(axis=1)]))
        middles = self._climb(index, b, h, l, np.array([1.0, *chosen]))
        stations = [1.0]
        for n, section in enumerate(chosen):
            place = self._zoom(section, middles, n >= by_use, b, h, l)
            middle = min(max(place, SECTION_STEP), 1.0 - SECTION_STEP)
            stations += [middle + SECTION_STEP, middle, middle - SECTION_STEP]
        triple = np.array([-ANGLE_STEP, 0.0, ANGLE_STEP])
        threes = (middles[:, None] + triple).ravel()
        peaks = (self.reaction_peaks(b, h, l)[:, None] + triple).ravel() if reactions else np.empty(0)
        focus = Focus(
            self.cycle.axial_force(threes), self.crank_radius * np.sin(threes), np.array(stations),
            self.cycle.axial_force(peaks), self.crank_radius * np.sin(peaks), self.force, self.stroke,
            self.speed, self.lines, self.parabola, self.compression, self.guide, self.modulus, self.rod_length,
        )  # fmt: skip
        return focus, middles

    def _zoom(self, section: float, angles: Array, by_stress: bool, b: float, h: float, l: float) -> float:
        """Where near ``section`` the worse fibre's utilisation, or stress, peaks, seen at the governing angles."""
        eta = np.clip(section + _SECTION_SPAN * np.linspace(1.0, -1.0, _ZOOM), 0.0, 1.0)
        table = np.empty((2, eta.size, angles.size))
        force, stroke = self.cycle.axial_force(angles), self.crank_radius * np.sin(angles)
        stress_table(force, stroke, self.modulus, self.rod_length, b, h, l, eta, table)
        severity = np.empty((2, eta.size))
        high, low = table.max(axis=2), table.min(axis=2)
        if by_stress:
            np.maximum(high, -low, out=severity)
        else:
            severities(high, low, self.lines, self.parabola, severity)
        row = severity[int(severity.max(axis=1).argmax())]
        j = int(row.argmax())
        if not 0 < j < eta.size - 1:
            return section
        bend = 2.0 * row[j] - row[j - 1] - row[j + 1]
        return float(eta[j] + (0.5 * (row[j + 1] - row[j - 1]) / bend if bend > 0 else 0.0) * (eta[1] - eta[0]))

    def reaction_peaks(self, b: float, h: float, l: float) -> Array:
        """The angles at which side force or contact pressure peak, of all peaks that may come to be the greatest."""
        span = 2.0 * np.pi / self.angle.size
        values = self._reactions(self.force, self.stroke, b, h, l)
        humps = (values >= np.roll(values, 1, axis=1)) & (values >= np.roll(values, -1, axis=1))
        row, at = np.nonzero(humps & (values >= _HUMP * values.max(axis=1, keepdims=True)))
        offsets = span * np.linspace(-1.25, 1.25, _FINE)
        around = self.angle[at][:, None] + offsets
        force, stroke = self.cycle.axial_force(around.ravel()), self.crank_radius * np.sin(around.ravel())
        values = self._reactions(force, stroke, b, h, l).reshape(2, at.size, _FINE)[row, np.arange(at.size)]
        j = np.clip(values.argmax(axis=1), 1, _FINE - 2)
        left, here, right = (values[np.arange(j.size), j + shift] for shift in (-1, 0, 1))
        bend = 2.0 * here - left - right
        shift = np.clip(0.5 * (right - left) / np.where(bend > 0, bend, np.inf), -1.0, 1.0)
        return np.unique(np.round(self.angle[at] + offsets[j] + shift * (offsets[1] - offsets[0]), 6))

    def _reactions(self, force: Array, stroke: Array, b: float, h: float, l: float) -> Array:
        """Side force and contact pressure (in N) at each angle, shape (2, angles)."""
        out = np.empty((2, force.size))
        side_and_pressure(force, stroke, self.modulus, self.rod_length, self.guide, b, h, l, out)
        return out

    def _climb(self, index: NDArray[np.int64], b: float, h: float, l: float, eta: Array) -> Array:
        """The angles of the stresses' extremes at the sections, near those of the samples at ``index``."""
        span = 2.0 * np.pi / self.angle.size
        start = self.angle[index]
        around = start[:, None] + span * np.linspace(-1.25, 1.25, _FINE)
        force, stroke = self.cycle.axial_force(around.ravel()), self.crank_radius * np.sin(around.ravel())
        table = np.empty((2, eta.size, around.size))
        stress_table(force, stroke, self.modulus, self.rod_length, b, h, l, eta, table)
        table = table.reshape(2 * eta.size, index.size, _FINE)
        step = 2.5 * span / (_FINE - 1)
        found = set()
        for sign in (1.0, -1.0):
            # A window that has the peak at its very end only says on which side it lies.
            peaks = (sign * table[:, :, 1:-1]).max(axis=2)
            best = peaks.argmax(axis=1)
            for row, which in enumerate(best):
                values = sign * table[row, which]
                at = 1 + int(values[1:-1].argmax())
                bend = 2.0 * values[at] - values[at - 1] - values[at + 1]
                shift = 0.5 * (values[at + 1] - values[at - 1]) / bend if bend > 0 else 0.0
                found.add(round(float(around[which, at] + step * min(max(shift, -1.0), 1.0)), 5))
        return np.array(sorted(found))


def _apart(sections: list[float]) -> list[float]:
    """Those of the sections that are not next to an earlier one."""
    out: list[float] = []
    for section in sections:
        if all(abs(section - other) > SECTION_STEP for other in out):
            out.append(section)
    return out


def _inner_peaks(values: Array, eta: Array) -> list[float]:
    """Where, away from the clamp, either fibre's value along the strip has its greatest peak."""
    out = []
    for row in values:
        inner = (row[1:-1] >= row[:-2]) & (row[1:-1] >= row[2:])
        at = np.flatnonzero(inner) + 1
        if at.size == 0:
            continue
        j = int(at[np.argmax(row[at])])
        bend = 2.0 * row[j] - row[j - 1] - row[j + 1]
        shift = 0.5 * (row[j + 1] - row[j - 1]) / bend if bend > 0 else 0.0
        out.append(float(eta[j] + shift * (eta[1] - eta[0])))
    return out or [0.5]


@kernel
def side_and_pressure(
    force: Array,
    stroke: Array,
    modulus: float,
    rod_length: float,
    guide: Array,
    b: float,
    h: float,
    l: float,
    out: Array,
) -> None:
    """|T| and |T| + 6 |M0 + T e|/Lp [N] at every angle: out of shape (2, angles)."""
    stiffness = modulus * b * h * h * h / 12.0
    for i in range(force.size):
        _, k, _ = clamp(force[i] / stiffness, l, rod_length)
        T = stiffness * k * stroke[i]
        out[0, i] = abs(T)
        out[1, i] = abs(T) + 6.0 / guide[2] * abs((rod_length + guide[0]) * T - force[i] * stroke[i])
