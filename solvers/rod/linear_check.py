"""Compiled check of a strip without shape corrections.

Gas and inertia, beam-column, shear and friction feedback are part of the states (``state``); the strip's own inertia
and large displacement are corrections.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solvers.fatigue.kernels import Diagram
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.panels import Rule, greatest, largest, mean_of
from solvers.rod.cycle.composition import Cycle
from solvers.rod.cycle.friction_buckling import SHARE_ERROR, carried_share
from solvers.rod.cycle.guide_loads import GUIDE_RESULTS, Guide, friction_power, guide_results, relative
from solvers.rod.cycle.peaks_along_strip import FEW_STATIONS, STATIONS, STRIP_RESULTS, strip_results
from solvers.rod.cycle.sampling import ROUNDING, first_edges, rule_for, sample
from solvers.rod.cycle.section import Field
from solvers.rod.cycle.state import ANGLE, FORCE, MOMENT, SIDE, Strip, least_critical_force
from solvers.rod.load.axial_force import Drive
from solvers.rod.piston.friction import power_per_wall
from solvers.rod.vibration.natural_frequencies import (
    FEW_POLYNOMIALS,
    FEW_POLYNOMIALS_ERROR,
    POLYNOMIALS,
    Polynomials,
    all_polynomials,
    frequency_under,
)


class Results(NamedTuple):
    """Columns of a result row, SI units; NaN if undefined: beyond buckling all but forces, stability and frequency.

    is_stable        whether the strip does not buckle
    compression, tension  their maxima; if the strip buckles by friction only, ``compression`` is P_cr over the share of
                     the axial forces that the strip would carry (``cycle.friction_buckling``)
    natural_frequency  the first one, under the mean axial force of the revolution [Hz]
    max_stress       maximum |stress|
    high, low        stresses of the section and fibre that govern fatigue; ``layer`` is 0 at +h/2, 1 at -h/2
    contact_load     |T| + 6 |M0 + T e|/Lp
    error            the maximum relative error of all results
    angles           number of sampled crank angles, for sampling to ``tolerance``
    by_friction      whether the strip buckles, but would not without friction
    """

    is_stable: float
    critical_force: float
    compression: float
    tension: float
    natural_frequency: float
    utilisation: float
    max_stress: float
    high: float
    low: float
    section: float
    layer: float
    deflection: float
    side: float
    moment: float
    contact_load: float
    power: float
    error: float
    angles: float
    tolerance: float
    by_friction: float


_UNDEFINED = np.full(len(Results._fields), np.nan)
_STRIP, _GUIDE, _POWER, _ERROR, _ANGLES, _TOLERANCE, _BY_FRICTION = 5, 12, 15, 16, 17, 18, 19
"""Columns of a result row: the first of those along the strip and of the guide, and single ones."""

SAMPLING_FRACTION = 0.1
"""Sampling tolerance as a fraction of the accuracy."""
REFINEMENTS = 4
_LOW_ACCURACY, _FEW_STATIONS_ACCURACY = 1e-4, 1e-2
ROUNDING_OF_INPUTS = 4.0 * float(np.finfo(float).eps)


class Section(NamedTuple):
    """Properties of the strip's section and of its guide beyond those of ``Strip``: 1/(b h) [1/m^2], E h/2 [Pa m], rho
    b h [kg/m], and ``power_per_wall`` [m/s]."""

    direct: float
    bending: float
    line_mass: float
    per_wall: float


def check_linear(cycle: Cycle, diagram: Diagram, contact: bool, accuracy: float) -> Results:
    """Check a strip without its corrections; with corrections only forces, stability and frequency are found."""
    scene, d = cycle.scene, cycle.dimensions
    section = Section(
        direct=1.0 / (d.b * d.h),
        bending=0.5 * scene.material.elastic_modulus * d.h,
        line_mass=scene.material.density * d.b * d.h,
        per_wall=power_per_wall(scene),
    )
    sharp = np.ascontiguousarray(scene.load.sharp_angles(), dtype=float)
    out, rule, stations = _UNDEFINED.copy(), rule_for(scene.load, accuracy), stations_for(accuracy)
    has_shape = not cycle.composition.corrections
    _check(
        cycle.drive, cycle.strip, section, sharp, *diagram, rule, stations, contact, has_shape, accuracy,
        all_polynomials(), out,
    )  # fmt: skip
    return Results(*out.tolist())


def stations_for(accuracy: float) -> int:
    """Number of initial stations along the strip for an accuracy of the results."""
    return FEW_STATIONS if accuracy >= _FEW_STATIONS_ACCURACY else STATIONS


@kernel
def _check(
    drive: Drive, strip: Strip, section: Section, sharp: Array, lines: Array, parabola: Array, rule: Rule,
    stations: int, contact: bool, has_shape: bool, accuracy: float, modes: Polynomials, out: Array,
) -> None:  # fmt: skip
    """Kernel of ``check_linear``: write the results to ``out``."""
    stiffness, l, length, critical = strip.stiffness, strip.length, strip.rod_length, least_critical_force(strip)
    tolerance = SAMPLING_FRACTION * accuracy
    edges, states = sample(drive, strip, critical, first_edges(drive, strip, sharp), rule, tolerance)
    compression, tension, compression_error, tension_error = np.inf, 0.0, 0.0, 0.0
    if edges.size > 0:
        compression, tension, compression_error, tension_error = _forces(edges, rule, states[FORCE], tolerance)
    is_stable = compression < critical
    out[_BY_FRICTION] = 0.0
    if not is_stable:
        # A buckled strip has no shape and so no friction force; only the other forces are meaningful.
        unbent = Strip(stiffness, l, length, 0.0, 0.0, 0.0, strip.lever, strip.offset, strip.critical)
        edges, states = sample(drive, unbent, np.inf, first_edges(drive, unbent, sharp), rule, tolerance)
        compression, tension, compression_error, tension_error = _forces(edges, rule, states[FORCE], tolerance)
        if compression < critical:
            compression = critical / carried_share(drive, strip, critical, states[ANGLE])
            compression_error, out[_BY_FRICTION] = SHARE_ERROR * compression, 1.0
    error = max(relative(compression_error, compression), relative(tension_error, tension))
    mean, mean_error = mean_of(edges, rule, states[FORCE])
    out[0], out[1], out[2], out[3] = 1.0 if is_stable else 0.0, critical, compression, tension
    few = accuracy >= _LOW_ACCURACY
    polynomials = FEW_POLYNOMIALS if few else POLYNOMIALS
    out[4] = frequency_under(modes, stiffness, section.line_mass, l, length, mean, polynomials)
    if is_stable and has_shape:
        for _ in range(REFINEMENTS):
            found = _strip_and_guide(
                drive, strip, section, edges, rule, states, lines, parabola, stations, contact, tolerance, out
            )
            if found <= accuracy or tolerance <= ROUNDING:
                break
            # Small differences of large quantities need a finer discretisation.
            tolerance = max(0.5 * tolerance * accuracy / found, ROUNDING)
            edges, states = sample(drive, strip, critical, edges, rule, tolerance)
        error = max(error, found)
        if compression > 0.0:
            # Near buckling rounding errors of load and strip are amplified in the stresses.
            error = max(error, ROUNDING_OF_INPUTS / (1.0 - compression / critical))
    if critical + mean > 0.0:
        # The frequency is proportional to the square root of the critical force plus the mean force.
        series_error = FEW_POLYNOMIALS_ERROR * critical if few else 0.0
        error = max(error, (0.5 * mean_error + series_error) / (critical + mean))
    out[_ERROR], out[_ANGLES], out[_TOLERANCE] = max(error, ROUNDING), states.shape[1], tolerance


@kernel
def _forces(edges: Array, rule: Rule, force: Array, tolerance: float) -> tuple[float, float, float, float]:
    """Maximum compression and tension [N] over the revolution, and their errors."""
    target = tolerance * largest(force)
    compression, compression_error, _ = greatest(edges, rule, force, -1.0, target)
    tension, tension_error, _ = greatest(edges, rule, force, 1.0, target)
    return compression, tension, compression_error, tension_error


@kernel
def _strip_and_guide(
    drive: Drive, strip: Strip, section: Section, edges: Array, rule: Rule, states: Array, lines: Array,
    parabola: Array, stations: int, contact: bool, tolerance: float, out: Array,
) -> float:  # fmt: skip
    """Write all results of an unbuckled strip to ``out``; return the maximum relative error."""
    force, none, direct, mean = states[FORCE], np.empty((0, states.shape[1])), section.direct, 0.0
    if force.min() == force.max():
        # A large constant force would mask a small amplitude: the criterion adds its stress separately.
        direct, mean = 0.0, direct * force[0]
    field = Field(edges, rule, states, none, none, strip.length, strip.compliance, direct, section.bending, False)
    error = strip_results(field, None, mean, lines, parabola, tolerance, stations, out[_STRIP : _STRIP + STRIP_RESULTS])
    ratio, parts = drive.crank_radius / drive.rod_length, np.empty(0)
    guide = Guide(states[SIDE], states[MOMENT], strip.lever, strip.offset, section.per_wall, ratio)
    guide_out = out[_GUIDE : _GUIDE + GUIDE_RESULTS]
    error = max(error, guide_results(edges, rule, guide, None, parts, parts, contact, tolerance, guide_out))
    if contact:
        out[_POWER], power_error = friction_power(edges, rule, guide, tolerance)
        error = max(error, power_error)
    return error
