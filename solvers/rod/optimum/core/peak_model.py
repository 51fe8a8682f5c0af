"""The active-peak model: a strip's results from the crank angles and sections that govern it alone.

Where stresses peak is found once (``solvers.rod.optimum.peaks``); from then on the peaks are followed by parabolas
through three angles and three sections beside each of them. That makes an evaluation of a strip of the core's physics,
with all derivatives, a matter of microseconds, and exact where the peaks were found: away from there the error grows
with the cube of the distance.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue.kernels import utilisation_of
from solvers.numerics.jit import kernel
from solvers.rod.optimum.core.bending import clamp, curvature
from solvers.rod.rows import (
    BUCKLED,
    FIRST_PART,
    LENGTH,
    NEVER_COMPRESSED,
    POWER,
    PRESSURE,
    SIDE,
    SIDEWAYS,
    STABILITY,
    STRESS,
    TAU,
    THICKNESS,
    UTILISATION,
)
from solvers.rod.strip.buckling import log_critical_parameter

Array = NDArray[np.float64]

_TRUSTED = 1.0
_STEP = 1e-6
_LEAST = 1e-300


class CorePeaks(NamedTuple):
    """What governs a strip of the core's physics, as arrays that kernels take. SI units.

    force, stroke        at the governing angles, in threes one ANGLE_STEP apart
    eta                  sections by distance from the head over l: the clamp first, then in threes (ends may repeat)
    react_force, react_stroke   at the peaks of side force and contact pressure, in threes one ANGLE_STEP apart, or none
    cycle_force, cycle_stroke, cycle_speed   the whole cycle at equal steps, or none; speed [m/s]
    lines, parabola      the fatigue criterion as in ``solvers.fatigue.kernels.Diagram``
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
def log(value: float) -> float:
    """ln, finite for 0."""
    return math.log(max(value, _LEAST))


@kernel
def buckled_rows(out: Array) -> None:
    """The rows that mean nothing for a buckled strip."""
    for r in range(STRESS, out.size):
        out[r] = BUCKLED
    out[UTILISATION] = out[SIDE] = out[PRESSURE] = out[POWER] = BUCKLED


@kernel
def reaction_rows(reactions: Array, per_force: float, row: int, out: Array) -> None:
    """Side force and contact pressure, and their parts from ``row`` on, from reactions [N] at angles in threes,
    (2, angles)."""
    side, pressure = 0.0, 0.0
    for i in range(0, reactions.shape[1], 3):
        this_side = peak(reactions[0, i], reactions[0, i + 1], reactions[0, i + 2])
        this_pressure = per_force * peak(reactions[1, i], reactions[1, i + 1], reactions[1, i + 2])
        side, pressure = max(side, this_side), max(pressure, this_pressure)
        out[row], out[row + 1] = log(this_side), log(this_pressure)
        row += 2
    if reactions.shape[1] > 0:
        out[SIDE], out[PRESSURE] = log(side), log(pressure)


@kernel
def sampled_rows(stress: Array, reactions: Array, lines: Array, parabola: Array, per_force: float, out: Array) -> None:
    """Utilisation, greatest stress, side force, contact pressure and all parts, from samples at the peaks.

    ``stress`` [Pa] has shape (2 fibres, sections, angles), ``reactions`` as of ``peaks.Response`` (2, angles), sections
    (but for the first) and angles in threes; ``per_force`` [1/m^2] makes a pressure of the second reaction.
    """
    angles, groups = stress.shape[2], 1 + (stress.shape[1] - 1) // 3
    worst, greatest = 0.0, 0.0
    value, strength = np.empty(3), np.empty(3)
    for fibre in range(2):
        for g in range(groups):
            sections = 1 if g == 0 else 3
            for k in range(sections):
                j = 0 if g == 0 else 3 * g - 2 + k
                high, low = -np.inf, np.inf
                for i in range(0, angles, 3):
                    a, m, c = stress[fibre, j, i], stress[fibre, j, i + 1], stress[fibre, j, i + 2]
                    high, low = max(high, peak(a, m, c)), min(low, -peak(-a, -m, -c))
                strength[k] = max(high, -low)
                value[k] = utilisation_of(high, low, lines, parabola) if high > low else 0.0
            top = value[0] if g == 0 else peak(value[0], value[1], value[2])
            most = strength[0] if g == 0 else peak(strength[0], strength[1], strength[2])
            worst, greatest = max(worst, top), max(greatest, most)
            out[FIRST_PART + 2 * g + fibre], out[FIRST_PART + 2 * (groups + g) + fibre] = log(top), log(most)
    out[UTILISATION], out[STRESS] = log(worst), log(greatest)
    reaction_rows(reactions, per_force, FIRST_PART + 4 * groups, out)


@kernel
def stress_table(
    force: Array, stroke: Array, modulus: float, rod_length: float, b: float, h: float, l: float, eta: Array, out: Array
) -> None:
    """Both fibres' stresses [Pa] at all sections and angles, shape (2, sections, angles)."""
    scale = 12.0 / (modulus * b * h * h * h)
    room = np.empty(eta.size)
    for i in range(force.size):
        curvature(force[i] * scale, l, rod_length, eta, room)
        direct, bending = force[i] / (b * h), 0.5 * modulus * h * stroke[i]
        for j in range(eta.size):
            out[0, j, i], out[1, j, i] = direct + bending * room[j], direct - bending * room[j]


@kernel
def reaction(
    force: float, stroke: float, modulus: float, rod_length: float, guide: Array, tau: float, l: float
) -> tuple[float, float]:
    """|T| and 6 |M0 + T e|/Lp [N] at one angle."""
    stiffness = modulus / (12.0 * tau)
    C, _ = clamp(force / stiffness, l, rod_length)
    k, s = (stiffness * C + force) / rod_length, abs(stroke)
    return s * abs(k), 6.0 / guide[2] * s * abs((rod_length + guide[0]) * k - force)


@kernel
def side_and_pressure(
    force: Array, stroke: Array, modulus: float, rod_length: float, guide: Array, tau: float, l: float, out: Array
) -> None:
    """|T| and |T| + 6 |M0 + T e|/Lp [N] at every angle: out of shape (2, angles)."""
    for i in range(force.size):
        out[0, i], couple = reaction(force[i], stroke[i], modulus, rod_length, guide, tau, l)
        out[1, i] = out[0, i] + couple


@kernel
def rows_at(f: CorePeaks, b: float, h: float, l: float, room: Array, out: Array) -> None:
    """All rows of a strip (``solvers.rod.rows``) on the core's physics.

    Side force, pressure and power are 0 where they are not looked at. ``room`` has shape (2, sections, angles).
    """
    tau, L = 1.0 / (b * h * h * h), f.rod_length
    out[TAU], out[LENGTH], out[THICKNESS] = math.log(tau), math.log(l), math.log(h)
    out[SIDE] = out[PRESSURE] = out[POWER] = 0.0
    if f.compression > 0.0:
        ln_u, _ = log_critical_parameter(l, L)
        euler = 2.0 * ln_u + math.log(f.modulus / (12.0 * L * L * f.compression))
        out[STABILITY], out[SIDEWAYS] = math.log(tau) - euler, -math.log(h * b * b * b) - euler
    else:
        out[STABILITY] = out[SIDEWAYS] = NEVER_COMPRESSED
    if out[STABILITY] >= 0.0:
        buckled_rows(out)
        return
    stress_table(f.force, f.stroke, f.modulus, L, b, h, l, f.eta, room)
    _, diameter, skirt, friction = f.guide
    reactions = np.empty((2, f.react_force.size))
    side_and_pressure(f.react_force, f.react_stroke, f.modulus, L, f.guide, tau, l, reactions)
    sampled_rows(room, reactions, f.lines, f.parabola, 4.0 / (math.pi * diameter * skirt), out)
    n = f.cycle_force.size
    if n > 0:
        power = 0.0
        for i in range(n):
            T, couple = reaction(f.cycle_force[i], f.cycle_stroke[i], f.modulus, L, f.guide, tau, l)
            power += (0.5 * (couple + T * T / couple) if couple > T else T) * f.cycle_speed[i]
        out[POWER] = log(power / n * friction * 4.0 / math.pi)


@kernel
def row_slopes(f: CorePeaks, x: Array, room: Array, slopes: Array) -> None:
    """Derivatives of ``rows_at`` by the logarithms x of b, h, l, shape (rows, 3), by central differences."""
    up, down, moved = np.empty(slopes.shape[0]), np.empty(slopes.shape[0]), x.copy()
    moved[2] = min(moved[2], math.log(f.rod_length) - _STEP)
    for v in range(3):
        here = moved[v]
        moved[v] = here + _STEP
        rows_at(f, math.exp(moved[0]), math.exp(moved[1]), min(math.exp(moved[2]), f.rod_length), room, up)
        moved[v] = here - _STEP
        rows_at(f, math.exp(moved[0]), math.exp(moved[1]), min(math.exp(moved[2]), f.rod_length), room, down)
        moved[v] = here
        for r in range(slopes.shape[0]):
            slopes[r, v] = (up[r] - down[r]) / (2.0 * _STEP)
