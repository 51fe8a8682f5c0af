"""Main results of one sampled revolution: the quantities by which the influence of effects is judged.

    sigma+- = N/(b h) +- (E h/2) psi',   T,   M0,   |T| + 6 |M0 + T e|/Lp,   F |v|,   P,   P_cr,   omega_1

at equally spaced stations and given angles: extrema are those of the samples. Revolutions are compared at the same
samples, so that sampling errors largely cancel.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue.kernels import utilisation_of
from solvers.numerics.jit import kernel, reducing_kernel
from solvers.rod.cycle.state import (
    CLAMP,
    COUPLING,
    FORCE,
    HEAD,
    MOMENT,
    ROWS,
    SHEAR,
    SIDE,
    SOFTENING,
    Strip,
    fill_states,
)
from solvers.rod.load.axial_force import Drive, axial_force
from solvers.rod.piston.skirt import both_walls, contact_load
from solvers.rod.strip.shape import bend

Array = NDArray[np.float64]

STATIONS = 9

UTILISATION, STRESS, MOST_SIDE, MOST_MOMENT, MOST_CONTACT, POWER = range(6)
"""1/n of fatigue, maximum |sigma| [Pa], maximum |T| [N], |M0| [N m] and contact load |T| + 6 |M0 + T e|/Lp [N], and the
mean of F |dx/dphi| [N m]."""

RESULTS = 6

MASS, COUPLES, SHEARING, FRICTION = range(4)
"""Removable parts: the reciprocating mass, the axial force's contribution to bending, shear, and friction feedback."""

PARTS = 4


class Judging(NamedTuple):
    """Parameters of the results, SI units.

    angle, share     crank angles and their quadrature weights as fractions of a revolution, (n,)
    travel           |dx/dphi| [m] at the angles times their weights, (n,)
    lever, offset    6/Lp [1/m] of the skirt and the clamp's offset e [m]
    friction         (4/pi) mu
    direct, bending  1/(b h) [1/m^2] and E h/2 [Pa m]
    lines, parabola  the fatigue diagram (``solvers.fatigue.kernels``)
    in_plane         P_cr [N] of bending in the crank's plane, rigid in shear
    """

    angle: Array
    share: Array
    travel: Array
    lever: float
    offset: float
    friction: float
    direct: float
    bending: float
    lines: Array
    parabola: Array
    in_plane: float


class Judged(NamedTuple):
    """The results of one revolution.

    ``results`` (RESULTS,), and utilisation and stress amplitude [Pa] of every fibre and station in ``sections``
    (2, 2 stations); ``force`` P [N] at the angles, (n,); ``critical`` P_cr [N]. If the strip buckles, ``stands`` is 0
    and only forces exist: without friction, or P_cr as the maximum compression if it buckles by friction only.
    """

    results: Array
    sections: Array
    force: Array
    critical: float
    stands: float


@reducing_kernel
def _extremes(f: Array) -> tuple[float, float]:
    high, low = -np.inf, np.inf
    for i in range(f.size):
        high, low = max(high, f[i]), min(low, f[i])
    return high, low


class Added(NamedTuple):
    """What corrections add to T [N] and M0 [N m], (n,), and to V'' [1/m] as Legendre coefficients over the strip,
    (terms, n); ``inclined``: N is tangential to the deflected strip."""

    side: Array
    moment: Array
    series: Array
    inclined: bool


@kernel
def nothing_added(n: int) -> Added:
    """No corrections at n angles."""
    return Added(np.zeros(n), np.zeros(n), np.zeros((0, n)), False)


@kernel
def both_added(one: Added, other: Added) -> Added:
    """The sum of two corrections."""
    if one.series.shape[0] < other.series.shape[0]:
        one, other = other, one
    series = one.series.copy()
    for k in range(other.series.shape[0]):
        for i in range(series.shape[1]):
            series[k, i] += other.series[k, i]
    return Added(one.side + other.side, one.moment + other.moment, series, one.inclined or other.inclined)


@kernel
def judge(j: Judging, strip: Strip, states: Array, added: Added, critical: float) -> Judged:
    """The main results from a table of states (``cycle.state``) of an unbuckled strip, one column per angle."""
    n, series, inclined = states.shape[1], added.series, added.inclined
    side, moment = states[SIDE] + added.side, states[MOMENT] + added.moment
    results, sections, force = np.zeros(RESULTS), np.empty((2, 2 * STATIONS)), states[FORCE]
    for i in range(n):
        t, couple = abs(side[i]), j.lever * abs(moment[i] + side[i] * j.offset)
        results[MOST_SIDE], results[MOST_MOMENT] = max(results[MOST_SIDE], t), max(results[MOST_MOMENT], abs(moment[i]))
        results[MOST_CONTACT] = max(results[MOST_CONTACT], contact_load(t, couple))
        results[POWER] += j.friction * j.travel[i] * both_walls(t, couple)
    bent, turned, sunk, upper, lower = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    for m in range(STATIONS):
        z = strip.length * m / (STATIONS - 1)
        bend(states[COUPLING], states[CLAMP], states[SHEAR], states[HEAD], strip.length, z, bent, turned, sunk)
        before, here, x = 0.0, 1.0, 2.0 * m / (STATIONS - 1) - 1.0
        for k in range(series.shape[0]):
            for i in range(n):
                bent[i] += here * series[k, i]
            before, here = here, ((2 * k + 1) * x * here - k * before) / (k + 1)
        for i in range(n):
            tangent = force[i]
            if inclined:
                slope = turned[i] / states[SOFTENING, i] - strip.compliance * states[SHEAR, i]
                tangent = tangent * (1.0 - 0.5 * slope * slope) + side[i] * slope
            upper[i] = j.direct * tangent + j.bending * bent[i]
            lower[i] = j.direct * tangent - j.bending * bent[i]
        for fibre in range(2):
            high, low = _extremes(upper if fibre == 0 else lower)
            used = utilisation_of(high, low, j.lines, j.parabola)
            sections[0, fibre * STATIONS + m], sections[1, fibre * STATIONS + m] = used, 0.5 * (high - low)
            results[UTILISATION] = max(results[UTILISATION], used)
            results[STRESS] = max(results[STRESS], max(high, -low))
    return Judged(results, sections, force, critical, 1.0)


@kernel
def judge_turn(j: Judging, drive: Drive, strip: Strip, states: Array, critical: float) -> Judged:
    """The main results from a table of states without corrections."""
    if states[FORCE].min() > -critical:
        return judge(j, strip, states, nothing_added(states.shape[1]), critical)
    force = np.empty(j.angle.size)
    for i in range(force.size):
        force[i] = axial_force(drive, j.angle[i])
    if force.min() > -critical:
        force[force.argmin()] = -critical
    return Judged(np.zeros(RESULTS), np.zeros((2, 2 * STATIONS)), force, critical, 0.0)


@kernel
def has_part(drive: Drive, strip: Strip, part: int) -> bool:
    """Whether there is anything to remove."""
    return (drive.mass if part == MASS else strip.friction if part == FRICTION else 1.0) != 0.0


@kernel
def without_part(strip: Strip, part: int) -> Strip:
    """The strip without a part."""
    return Strip(
        strip.stiffness, strip.length, strip.rod_length, 0.0 if part == COUPLES else strip.couples,
        0.0 if part == SHEARING else strip.compliance, 0.0 if part == FRICTION else strip.friction, strip.lever,
        strip.offset, strip.buckled,
    )  # fmt: skip


@kernel
def changes_without(
    j: Judging, drive: Drive, still: Drive, strip: Strip, critical: float, rigid: float, exact: Judged
) -> Array:
    """Changes of the forces and of the shape without each part of the revolution, (PARTS, 2); ``still`` is the drive
    without inertia, ``rigid`` P_cr [N] without shear."""
    out, states = np.zeros((PARTS, 2)), np.empty((ROWS, j.angle.size))
    for part in range(PARTS):
        if not has_part(drive, strip, part):
            continue
        driven = still if part == MASS else drive
        most = rigid if part == SHEARING else critical
        left = without_part(strip, part)
        fill_states(driven, left, j.angle, states)
        found = judge_turn(j, driven, left, states, most)
        out[part, 0], out[part, 1] = change_of_forces(j, found, exact), change_of_shape(found, exact)
    return out


@kernel
def change_of_shape(found: Judged, exact: Judged) -> float:
    """Maximum relative difference of the bent strip's results; inf if only one of them stands."""
    if found.stands != exact.stands:
        return np.inf
    if exact.stands == 0.0:
        return 0.0
    worst = _change_of_amplitude(found.sections, exact.sections)
    for k in range(RESULTS):
        here, truth = found.results[k], exact.results[k]
        # A safety is the inverse of the utilisation.
        base = here if k in (UTILISATION, STRESS) else truth
        if here != truth:
            worst = max(worst, abs(here - truth) / base if base > 0.0 else np.inf)
    return worst


@kernel
def change_of_forces(j: Judging, found: Judged, exact: Judged) -> float:
    """Change of P_cr, of the extrema of the axial force, the stability, and the natural frequency under the mean force.

    An extremum lies between samples: the maximum difference at the neighbouring samples is used.
    """
    worst, n = abs(found.critical / exact.critical - 1.0), j.angle.size
    for sign in (1.0, -1.0):
        here, there = 0, 0
        for i in range(n):
            here = i if sign * exact.force[i] > sign * exact.force[here] else here
            there = i if sign * found.force[i] > sign * found.force[there] else there
        truth, differs = exact.force[here], abs(found.force[there] - exact.force[here])
        for i in range(here - 1, here + 2):
            differs = max(differs, abs(found.force[i % n] - exact.force[i % n]))
        if differs > 0.0:
            worst = max(worst, differs / abs(truth) if truth != 0.0 else np.inf)
        if sign < 0.0:
            if (truth < 0.0) != (found.force[there] < 0.0):
                worst = np.inf
            elif truth < 0.0:
                worst = max(worst, abs(truth / found.force[there] * (found.critical / exact.critical) - 1.0))
    mean, means = 0.0, 0.0
    for i in range(n):
        mean, means = mean + j.share[i] * exact.force[i], means + j.share[i] * found.force[i]
    stiff = max(j.in_plane + min(mean, means), 1e-3 * j.in_plane)
    return max(worst, 0.5 * abs(mean - means) / stiff)


@kernel
def _change_of_amplitude(found: Array, exact: Array) -> float:
    """Change of the amplitude at the section that governs fatigue.

    In optimal strips two sections govern equally, and a small change switches between them: the reported amplitude then
    jumps, like the section itself, although no section's stress changes much.
    """
    top, at = 0.0, 0
    for m in range(exact.shape[1]):
        if exact[0, m] > top:
            top, at = exact[0, m], m
    if top <= 0.0 or exact[1, at] == 0.0:
        return 0.0
    return abs(found[1, at] / exact[1, at] - 1.0)
