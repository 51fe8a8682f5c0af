"""The active-peak model: the results of a strip from its governing crank angles and sections only.

The peaks are located once, at one strip (``solvers.rod.optimum.peaks``). For neighbouring strips each peak is the
vertex of a parabola through three angles and three sections (a stencil) around it. An evaluation on the core's physics,
with all derivatives, takes microseconds. It is exact at the strip whose peaks were located; the error grows with the
cube of the distance from that strip.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solvers.fatigue.kernels import utilisation_of
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.rod import rows
from solvers.rod.optimum.rows_at_samples import finite_log, peak_height, reaction_rows, set_buckled_rows
from solvers.rod.piston.skirt import contact_load
from solvers.rod.strip.beam_column import constants
from solvers.rod.strip.buckling import log_critical_parameter
from solvers.rod.strip.shape import bend_at

_STEP = 1e-6


class CorePeaks(NamedTuple):
    """Samples at the peaks of a strip on the core's physics, as arrays for the kernels. SI units.

    force, lateral                           axial force [N], lateral displacement [m] at the stencils of extreme stress
    eta                                      distance of sections from the head over l: the clamp, then stencils
    reaction_force, reaction_lateral         at the stencils of side force and contact pressure, or empty
    cycle_force, cycle_lateral, cycle_speed  at equal steps over the cycle, or empty; |piston speed| [m/s]
    lines, parabola                          fatigue criterion as in ``solvers.fatigue.kernels.Diagram``
    compression                              maximum over the cycle [N]
    guide                                    clamp offset, diameter, skirt length [m], friction coefficient
    modulus, rod_length                      [Pa], [m]
    """

    force: Array
    lateral: Array
    eta: Array
    reaction_force: Array
    reaction_lateral: Array
    cycle_force: Array
    cycle_lateral: Array
    cycle_speed: Array
    lines: Array
    parabola: Array
    compression: float
    guide: Array
    modulus: float
    rod_length: float


@kernel
def sampled_rows(stress: Array, reactions: Array, lines: Array, parabola: Array, per_force: float, out: Array) -> None:
    """Set the rows of utilisation, maximum stress, side force, contact pressure and all their parts from samples.

    ``stress`` [Pa] has shape (2 fibres, sections, angles), ``reactions`` [N], those of ``peaks.Response``, (2, angles).
    Sections (except the first, the clamp) and angles are in stencils; ``per_force`` [1/m^2] is the pressure per force.
    """
    angles, groups = stress.shape[2], 1 + (stress.shape[1] - 1) // 3
    worst, greatest = 0.0, 0.0
    value, magnitude = np.empty(3), np.empty(3)
    for fibre in range(2):
        for g in range(groups):
            sections = 1 if g == 0 else 3
            for k in range(sections):
                j = 0 if g == 0 else 3 * g - 2 + k
                high, low = -np.inf, np.inf
                for i in range(0, angles, 3):
                    a, m, c = stress[fibre, j, i], stress[fibre, j, i + 1], stress[fibre, j, i + 2]
                    high, low = max(high, peak_height(a, m, c)), min(low, -peak_height(-a, -m, -c))
                magnitude[k] = max(high, -low)
                value[k] = utilisation_of(high, low, lines, parabola) if high > low else 0.0
            top = value[0] if g == 0 else peak_height(value[0], value[1], value[2])
            largest = magnitude[0] if g == 0 else peak_height(magnitude[0], magnitude[1], magnitude[2])
            worst, greatest = max(worst, top), max(greatest, largest)
            out[rows.FIRST_PART + 2 * g + fibre] = finite_log(top)
            out[rows.FIRST_PART + 2 * (groups + g) + fibre] = finite_log(largest)
    out[rows.UTILISATION], out[rows.STRESS] = finite_log(worst), finite_log(greatest)
    reaction_rows(reactions, per_force, rows.FIRST_PART + 4 * groups, out)


@kernel
def stresses_at(
    force: Array, lateral: Array, modulus: float, rod_length: float, b: float, h: float, l: float, eta: Array
) -> Array:
    """Stresses of both fibres [Pa], P/(b h) +- (E h/2) V'' s, at all sections and angles: (2, sections, angles)."""
    scale, out = 12.0 / (modulus * b * h * h * h), np.empty((2, eta.size, force.size))
    for i in range(force.size):
        q, _, clamp, shear, head = constants(force[i] * scale, l, rod_length, 0.0)
        direct, bending = force[i] / (b * h), 0.5 * modulus * h * lateral[i]
        for j in range(eta.size):
            bent = bending * bend_at(q, clamp, shear, head, l, (1.0 - eta[j]) * l)[0]
            out[0, j, i], out[1, j, i] = direct + bent, direct - bent
    return out


@kernel
def side_force_and_couple(
    force: float, lateral: float, modulus: float, rod_length: float, guide: Array, tau: float, l: float
) -> tuple[float, float]:
    """Side force |T| and couple 6 |M0 + T e|/Lp of the guide [N] at one angle."""
    stiffness = modulus / (12.0 * tau)
    _, _, clamp, shear, _ = constants(force / stiffness, l, rod_length, 0.0)
    deflected = abs(lateral) * stiffness
    return deflected * abs(shear), 6.0 / guide[2] * deflected * abs(clamp - guide[0] * shear)


@kernel
def guide_reactions_at(
    force: Array, lateral: Array, modulus: float, rod_length: float, guide: Array, tau: float, l: float
) -> Array:
    """Guide reactions |T| and |T| + 6 |M0 + T e|/Lp [N] at every angle, shape (2, angles)."""
    out = np.empty((2, force.size))
    for i in range(force.size):
        out[0, i], couple = side_force_and_couple(force[i], lateral[i], modulus, rod_length, guide, tau, l)
        out[1, i] = contact_load(out[0, i], couple)
    return out


@kernel
def rows_at(f: CorePeaks, b: float, h: float, l: float, out: Array) -> None:
    """All rows of a strip (``solvers.rod.rows``) on the core's physics.

    Side force, pressure and power are 0 if their samples are empty.
    """
    tau, L = 1.0 / (b * h * h * h), f.rod_length
    out[rows.TAU], out[rows.LENGTH], out[rows.THICKNESS] = math.log(tau), math.log(l), math.log(h)
    out[rows.SIDE] = out[rows.PRESSURE] = out[rows.POWER] = 0.0
    if f.compression > 0.0:
        ln_u, _ = log_critical_parameter(l, L)
        euler = 2.0 * ln_u + math.log(f.modulus / (12.0 * L * L * f.compression))
        out[rows.STABILITY], out[rows.SIDEWAYS] = math.log(tau) - euler, -math.log(h * b * b * b) - euler
    else:
        out[rows.STABILITY] = out[rows.SIDEWAYS] = rows.NEVER_COMPRESSED
    if out[rows.STABILITY] >= 0.0:
        set_buckled_rows(out)
        return
    stresses = stresses_at(f.force, f.lateral, f.modulus, L, b, h, l, f.eta)
    _, diameter, skirt, friction = f.guide
    reactions = guide_reactions_at(f.reaction_force, f.reaction_lateral, f.modulus, L, f.guide, tau, l)
    sampled_rows(stresses, reactions, f.lines, f.parabola, 4.0 / (math.pi * diameter * skirt), out)
    n = f.cycle_force.size
    if n > 0:
        power = 0.0
        for i in range(n):
            T, couple = side_force_and_couple(f.cycle_force[i], f.cycle_lateral[i], f.modulus, L, f.guide, tau, l)
            power += (0.5 * (couple + T * T / couple) if couple > T else T) * f.cycle_speed[i]
        out[rows.POWER] = finite_log(power / n * friction * 4.0 / math.pi)


@kernel
def row_jacobian(f: CorePeaks, x: Array, jacobian: Array) -> None:
    """Derivatives of ``rows_at`` with respect to x = ln(b, h, l), shape (rows, 3), by central differences."""
    up, down, moved = np.empty(jacobian.shape[0]), np.empty(jacobian.shape[0]), x.copy()
    moved[2] = min(moved[2], math.log(f.rod_length) - _STEP)
    for v in range(3):
        here = moved[v]
        moved[v] = here + _STEP
        rows_at(f, math.exp(moved[0]), math.exp(moved[1]), min(math.exp(moved[2]), f.rod_length), up)
        moved[v] = here - _STEP
        rows_at(f, math.exp(moved[0]), math.exp(moved[1]), min(math.exp(moved[2]), f.rod_length), down)
        moved[v] = here
        for r in range(jacobian.shape[0]):
            jacobian[r, v] = (up[r] - down[r]) / (2.0 * _STEP)
