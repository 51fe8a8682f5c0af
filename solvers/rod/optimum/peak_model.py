"""A strip's results from the crank angles and sections that govern it alone.

Where stresses peak is found once (``solvers.rod.optimum.machine``); from then on the peaks are followed by parabolas
through three angles and three sections beside each of them. That makes an evaluation of a strip, with all derivatives,
a matter of microseconds, and exact at the strip in focus: away from it the error grows with the cube of the distance.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue.kernels import utilisation_of
from solvers.numerics.jit import kernel
from solvers.rod.optimum.constraints import (
    COUNT,
    LENGTH,
    NEVER_COMPRESSED,
    POWER,
    PRESSURE,
    SIDE,
    STABILITY,
    TAU,
    THICKNESS,
    UTILISATION,
)
from solvers.rod.optimum.proof.intervals import clamp, curvature_and_stiffness
from solvers.rod.strip.buckling import log_critical_parameter

Array = NDArray[np.float64]

ANGLE_STEP = 0.01
SECTION_STEP = 0.006
SIDEWAYS, STRESS, FIRST_GROUP = COUNT, COUNT + 1, COUNT + 2
"""Rows beyond those of ``rows``: sideways stability, greatest stress, from there on fibres by groups of sections."""
_TRUSTED = 1.0
_STEP = 1e-6
_BUCKLED = 40.0


class Focus(NamedTuple):
    """What governs a strip, as arrays that kernels take. SI units.

    force, stroke        at the governing angles, in threes one ANGLE_STEP apart
    eta                  sections by distance from the head over l: the clamp first, then in threes (ends may repeat)
    react_force, react_stroke   at the peaks of side force and contact pressure, in threes one ANGLE_STEP apart, or none
    cycle_force, cycle_stroke, cycle_speed   the whole cycle at equal steps, or none; speed [m/s]
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


def joined(new: tuple[Focus, Array], old: tuple[Focus, Array]) -> tuple[Focus, Array]:
    """A focus, with its middle angles, that sees what two of the same machine see; of neighbours the new one's."""
    (focus, middles), (earlier, angles) = new, old
    kept = np.flatnonzero(np.abs(angles[:, None] - middles).min(axis=1) > ANGLE_STEP)
    threes = (3 * kept[:, None] + np.arange(3)).ravel()
    centres = np.abs(earlier.eta[2::3, None] - focus.eta[2::3]).min(axis=1)
    sections = (1 + 3 * np.flatnonzero(centres > SECTION_STEP)[:, None] + np.arange(3)).ravel()
    both = focus._replace(
        force=np.append(focus.force, earlier.force[threes]),
        stroke=np.append(focus.stroke, earlier.stroke[threes]),
        eta=np.append(focus.eta, earlier.eta[sections]),
        react_force=np.append(focus.react_force, earlier.react_force),
        react_stroke=np.append(focus.react_stroke, earlier.react_stroke),
    )
    return both, np.append(middles, angles[kept])


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
def first_peak(f: Focus) -> int:
    """The first row beyond the groups' fibres: side force and contact pressure at each of their peaks follow."""
    return FIRST_GROUP + 2 * (1 + (f.eta.size - 1) // 3)


@kernel
def row_count(f: Focus) -> int:
    """Of all rows."""
    return first_peak(f) + 2 * (f.react_force.size // 3)


@kernel
def rows_at(f: Focus, b: float, h: float, l: float, table: Array, out: Array) -> None:
    """Logarithms of all results: those of ``rows``, sideways stability, stress, utilisations, reactions.

    out[UTILISATION], out[SIDE] and out[PRESSURE] are the greatest; out[SIDEWAYS], out[STRESS] are
    ln(compression/sideways critical force) and ln(greatest stress); from FIRST_GROUP on, two fibres for every group of
    sections; from ``first_peak`` on, side force and contact pressure for every peak of theirs. Stability is
    ln(compression/critical force); side force, pressure and power are 0 where the focus does not look at them.
    ``table`` is room of shape (angles, sections).
    """
    tau, L = 1.0 / (b * h * h * h), f.rod_length
    scale = 12.0 * tau / f.modulus
    groups = 1 + (f.eta.size - 1) // 3
    out[TAU], out[LENGTH], out[THICKNESS] = math.log(tau), math.log(l), math.log(h)
    out[SIDE] = out[PRESSURE] = out[POWER] = 0.0
    if f.compression > 0.0:
        ln_u, _ = log_critical_parameter(l, L)
        euler = 2.0 * ln_u + math.log(f.modulus / (12.0 * L * L * f.compression))
        out[STABILITY], out[SIDEWAYS] = math.log(tau) - euler, -math.log(h * b * b * b) - euler
    else:
        out[STABILITY] = out[SIDEWAYS] = NEVER_COMPRESSED
    if out[STABILITY] >= 0.0:
        for r in range(STRESS, out.size):
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
            out[FIRST_GROUP + 2 * g + fibre] = math.log(max(top, 1e-300))
    out[UTILISATION], out[STRESS] = math.log(max(worst, 1e-300)), math.log(max(greatest, 1e-300))
    _, diameter, skirt, friction = f.guide
    if f.react_force.size > 0:
        side, pressure, row = 0.0, 0.0, first_peak(f)
        per_force = 4.0 / (math.pi * diameter * skirt)
        sides, pressures = np.empty(3), np.empty(3)
        for i in range(f.react_force.size):
            sides[i % 3], couple = reaction(f.react_force[i], f.react_stroke[i], f, l, scale)
            pressures[i % 3] = sides[i % 3] + couple
            if i % 3 == 2:
                this_side = peak(sides[0], sides[1], sides[2])
                this_pressure = per_force * peak(pressures[0], pressures[1], pressures[2])
                side, pressure = max(side, this_side), max(pressure, this_pressure)
                out[row], out[row + 1] = math.log(max(this_side, 1e-300)), math.log(max(this_pressure, 1e-300))
                row += 2
        out[SIDE], out[PRESSURE] = math.log(max(side, 1e-300)), math.log(max(pressure, 1e-300))
    n = f.cycle_force.size
    if n > 0:
        power = 0.0
        for i in range(n):
            T, couple = reaction(f.cycle_force[i], f.cycle_stroke[i], f, l, scale)
            power += (0.5 * (couple + T * T / couple) if couple > T else T) * f.cycle_speed[i]
        out[POWER] = math.log(max(power / n * friction * 4.0 / math.pi, 1e-300))


@kernel
def rows_and_slopes(f: Focus, x: Array, table: Array, out: Array, slopes: Array) -> None:
    """``rows_at`` the logarithms x of b, h, l, and its derivatives by them, shape (rows, 3), by central differences."""
    up, down, moved = np.empty(out.size), np.empty(out.size), x.copy()
    moved[2] = min(moved[2], math.log(f.rod_length) - _STEP)
    for v in range(3):
        here = moved[v]
        moved[v] = here + _STEP
        rows_at(f, math.exp(moved[0]), math.exp(moved[1]), min(math.exp(moved[2]), f.rod_length), table, up)
        moved[v] = here - _STEP
        rows_at(f, math.exp(moved[0]), math.exp(moved[1]), min(math.exp(moved[2]), f.rod_length), table, down)
        moved[v] = here
        for r in range(out.size):
            slopes[r, v] = (up[r] - down[r]) / (2.0 * _STEP)
    rows_at(f, math.exp(x[0]), math.exp(x[1]), min(math.exp(x[2]), f.rod_length), table, out)


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
