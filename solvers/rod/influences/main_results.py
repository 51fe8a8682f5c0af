"""Main results of one sampled revolution: the quantities by which the influence of effects is judged.

    sigma+- = N/(b h) +- (E h/2) psi',   T,   M0,   |T| + 6 |M0 + T e|/Lp,   F |v|,   P,   P_cr,   omega_1

at equally spaced stations and given angles; extrema are those of the samples. Revolutions are compared at the same
samples, so that sampling errors largely cancel.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solvers.fatigue.kernels import utilisation_of
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.panels import extremes
from solvers.rod.cycle.bent_strip import tangential_force
from solvers.rod.cycle.friction_buckling import carried_share
from solvers.rod.cycle.section import add_series
from solvers.rod.cycle.state import (
    FORCE,
    MOMENT,
    ROWS,
    SHEAR,
    SIDE,
    SOFTENING,
    Strip,
    bend_states,
    fill_states,
    with_models,
)
from solvers.rod.load.axial_force import Drive, axial_force
from solvers.rod.piston.skirt import both_walls, contact_load, couple_of
from solvers.rod.strip.shear import slope_of

STATIONS = 9

UTILISATION, MAX_STRESS, MAX_SIDE_FORCE, MAX_CLAMP_MOMENT, MAX_CONTACT_LOAD, FRICTION_WORK, RESULTS = range(7)
"""1/n of fatigue, maximum |sigma| [Pa], maximum |T| [N], |M0| [N m] and contact load |T| + 6 |M0 + T e|/Lp [N], and the
mean of F |dx/dphi| [N m]; and their number."""

RECIPROCATING_MASS, AXIAL_COUPLING, SHEAR_FLEXIBILITY, FRICTION_FEEDBACK, PARTS = range(5)
"""Removable parts: the reciprocating mass, the axial force's contribution to bending, shear, and friction feedback; and
their number."""


class ResultParameters(NamedTuple):
    """Parameters of the results, SI units.

    angle, weight    crank angles and their quadrature weights as fractions of a revolution, (n,)
    travel           |dx/dphi| [m] at the angles times their weights, (n,)
    friction         (4/pi) mu
    lines, parabola  the fatigue diagram (``solvers.fatigue.kernels``)
    in_plane_critical  P_cr [N] of bending in the crank's plane, rigid in shear
    """

    angle: Array
    weight: Array
    travel: Array
    friction: float
    lines: Array
    parabola: Array
    in_plane_critical: float


class MainResults(NamedTuple):
    """The results of one revolution.

    ``results`` (RESULTS,), and utilisation and stress amplitude [Pa] of every fibre and station in ``sections``
    (2, 2 stations); ``force`` P [N] at the angles, (n,); ``critical`` P_cr [N]. If the strip buckles, ``is_stable`` is
    0 and only forces exist: without friction, or with the maximum compression of ``linear_check`` if it buckles by
    friction only.
    """

    results: Array
    sections: Array
    force: Array
    critical: float
    is_stable: float


class ShapeCorrection(NamedTuple):
    """Contribution of corrections to T [N] and M0 [N m], (n,), and to V'' [1/m] as Legendre coefficients over the
    strip, (terms, n); ``inclined``: N is tangential to the deflected strip."""

    side: Array
    moment: Array
    series: Array
    inclined: bool


@kernel
def no_correction(n: int) -> ShapeCorrection:
    """Return a correction of zero at n angles."""
    return ShapeCorrection(np.zeros(n), np.zeros(n), np.zeros((0, n)), False)


@kernel
def sum_of_corrections(one: ShapeCorrection, other: ShapeCorrection) -> ShapeCorrection:
    """Return the sum of two corrections."""
    if one.series.shape[0] < other.series.shape[0]:
        one, other = other, one
    series = one.series.copy()
    for k in range(other.series.shape[0]):
        for i in range(series.shape[1]):
            series[k, i] += other.series[k, i]
    return ShapeCorrection(one.side + other.side, one.moment + other.moment, series, one.inclined or other.inclined)


@kernel
def evaluate(
    parameters: ResultParameters, strip: Strip, states: Array, correction: ShapeCorrection, critical: float
) -> MainResults:
    """Return the main results from a table of states (``cycle.state``) of an unbuckled strip, one column per angle, and
    a correction."""
    n, series, inclined = states.shape[1], correction.series, correction.inclined
    side, moment = states[SIDE] + correction.side, states[MOMENT] + correction.moment
    results, sections, force = np.zeros(RESULTS), np.empty((2, 2 * STATIONS)), states[FORCE]
    for i in range(n):
        side_force, couple = abs(side[i]), abs(couple_of(side[i], moment[i], strip.lever, strip.offset))
        results[MAX_SIDE_FORCE] = max(results[MAX_SIDE_FORCE], side_force)
        results[MAX_CLAMP_MOMENT] = max(results[MAX_CLAMP_MOMENT], abs(moment[i]))
        results[MAX_CONTACT_LOAD] = max(results[MAX_CONTACT_LOAD], contact_load(side_force, couple))
        results[FRICTION_WORK] += parameters.friction * parameters.travel[i] * both_walls(side_force, couple)
    curvature, slope, deflection, upper, lower = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    for station in range(STATIONS):
        z = strip.length * station / (STATIONS - 1)
        bend_states(states, strip.length, z, curvature, slope, deflection)
        add_series(series, 2.0 * station / (STATIONS - 1) - 1.0, curvature)
        for i in range(n):
            tangential = force[i]
            if inclined:
                inclination = slope_of(slope[i], states[SOFTENING, i], strip.compliance, states[SHEAR, i])
                tangential = tangential_force(tangential, side[i], inclination)
            direct, bending = strip.direct * tangential, strip.bending * curvature[i]
            upper[i], lower[i] = direct + bending, direct - bending
        for fibre in range(2):
            high, low = extremes(upper if fibre == 0 else lower)
            utilisation = utilisation_of(high, low, parameters.lines, parameters.parabola)
            column = fibre * STATIONS + station
            sections[0, column], sections[1, column] = utilisation, 0.5 * (high - low)
            results[UTILISATION] = max(results[UTILISATION], utilisation)
            results[MAX_STRESS] = max(results[MAX_STRESS], max(high, -low))
    return MainResults(results, sections, force, critical, 1.0)


@kernel
def evaluate_linear(
    parameters: ResultParameters, drive: Drive, strip: Strip, states: Array, critical: float
) -> MainResults:
    """Return the main results from a table of states without corrections; the strip may buckle."""
    if extremes(states[FORCE])[1] > -critical:
        return evaluate(parameters, strip, states, no_correction(states.shape[1]), critical)
    force = np.empty(parameters.angle.size)
    for i in range(force.size):
        force[i] = axial_force(drive, parameters.angle[i])
    if extremes(force)[1] > -critical:
        force[force.argmin()] = -critical / carried_share(drive, strip, critical, np.sort(parameters.angle))
    return MainResults(np.zeros(RESULTS), np.zeros((2, 2 * STATIONS)), force, critical, 0.0)


@kernel
def has_part(drive: Drive, strip: Strip, part: int) -> bool:
    """Whether the revolution contains a part that could be removed."""
    return (drive.mass if part == RECIPROCATING_MASS else strip.friction if part == FRICTION_FEEDBACK else 1.0) != 0.0


@kernel
def without_part(strip: Strip, part: int) -> Strip:
    """Return the strip without a part."""
    couples, compliance = (part != AXIAL_COUPLING) * strip.couples, (part != SHEAR_FLEXIBILITY) * strip.compliance
    return with_models(strip, couples, compliance, (part != FRICTION_FEEDBACK) * strip.friction)


@kernel
def changes_without(
    parameters: ResultParameters, drive: Drive, massless_drive: Drive, strip: Strip, critical: float,
    critical_without_shear: float, exact: MainResults,
) -> Array:  # fmt: skip
    """Return the relative changes of the forces and of the shape without each part of the revolution, (PARTS, 2).
    ``massless_drive`` is the drive without inertia, ``critical_without_shear`` P_cr [N] without shear."""
    out, states = np.zeros((PARTS, 2)), np.empty((ROWS, parameters.angle.size))
    for part in range(PARTS):
        if not has_part(drive, strip, part):
            continue
        reduced_drive = massless_drive if part == RECIPROCATING_MASS else drive
        reduced_critical = critical_without_shear if part == SHEAR_FLEXIBILITY else critical
        reduced_strip = without_part(strip, part)
        fill_states(reduced_drive, reduced_strip, parameters.angle, states)
        reduced = evaluate_linear(parameters, reduced_drive, reduced_strip, states, reduced_critical)
        out[part, 0], out[part, 1] = change_of_forces(parameters, reduced, exact), change_of_shape(reduced, exact)
    return out


@kernel
def change_of_shape(found: MainResults, exact: MainResults) -> float:
    """Return the maximum relative difference of the bent strip's results; inf if only one of two strips is stable."""
    if found.is_stable != exact.is_stable:
        return np.inf
    if exact.is_stable == 0.0:
        return 0.0
    largest = _change_of_amplitude(found.sections, exact.sections)
    for k in range(RESULTS):
        value, exact_value = found.results[k], exact.results[k]
        # A safety is the inverse of the utilisation, so its change refers to the changed value.
        reference = value if k in (UTILISATION, MAX_STRESS) else exact_value
        if value != exact_value:
            largest = max(largest, abs(value - exact_value) / reference if reference > 0.0 else np.inf)
    return largest


@kernel
def change_of_forces(parameters: ResultParameters, found: MainResults, exact: MainResults) -> float:
    """Return the maximum relative change of P_cr, of the extrema of the axial force, of the stability safety, and of
    the natural frequency under the mean force.

    The true extrema lie between samples: the maximum difference at the neighbouring samples is used.
    """
    largest, n = abs(found.critical / exact.critical - 1.0), parameters.angle.size
    for sign in (1.0, -1.0):
        exact_at, found_at = 0, 0
        for i in range(n):
            exact_at = i if sign * exact.force[i] > sign * exact.force[exact_at] else exact_at
            found_at = i if sign * found.force[i] > sign * found.force[found_at] else found_at
        exact_value, difference = exact.force[exact_at], abs(found.force[found_at] - exact.force[exact_at])
        for i in range(exact_at - 1, exact_at + 2):
            difference = max(difference, abs(found.force[i % n] - exact.force[i % n]))
        if difference > 0.0:
            largest = max(largest, difference / abs(exact_value) if exact_value != 0.0 else np.inf)
        if sign < 0.0:
            if (exact_value < 0.0) != (found.force[found_at] < 0.0):
                largest = np.inf
            elif exact_value < 0.0:
                safety_ratio = exact_value / found.force[found_at] * (found.critical / exact.critical)
                largest = max(largest, abs(safety_ratio - 1.0))
    mean, found_mean = 0.0, 0.0
    for i in range(n):
        mean += parameters.weight[i] * exact.force[i]
        found_mean += parameters.weight[i] * found.force[i]
    critical = parameters.in_plane_critical
    stiffness = max(critical + min(mean, found_mean), 1e-3 * critical)
    return max(largest, 0.5 * abs(mean - found_mean) / stiffness)


@kernel
def _change_of_amplitude(found: Array, exact: Array) -> float:
    """Return the relative change of the stress amplitude at the section that governs fatigue.

    In optimal strips two sections govern equally, and a small change switches between them: the reported amplitude then
    jumps, like the section itself, although no section's stress changes much.
    """
    highest, at = 0.0, 0
    for m in range(exact.shape[1]):
        if exact[0, m] > highest:
            highest, at = exact[0, m], m
    if highest <= 0.0 or exact[1, at] == 0.0:
        return 0.0
    return abs(found[1, at] / exact[1, at] - 1.0)
