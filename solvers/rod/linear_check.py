"""Compiled check of strips without shape corrections: rows of inputs to rows of results.

Gas and inertia, beam-column, shear and friction feedback are part of the states (``state``); the strip's own inertia
and large displacement are corrections. Without coupling the strip's shape is proportional to the stroke,

    sigma+- = P/(b h) +- (E h/2) kappa(z) s,    kappa = (L - z)/det,    V = (L z^2/2 - z^3/6 + g z)/det s

(``strip.beam_column`` at q = 0). Then every severity that is convex in maximum and minimum stress is largest at the
clamp, the deflection at the head, and side force, clamp moment and contact load at the maximum stroke r.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue.kernels import utilisation_of
from solvers.numerics.jit import kernel
from solvers.numerics.panels import Rule, greatest, largest, mean_of
from solvers.rod.cycle.composition import Composition
from solvers.rod.cycle.friction_buckling import SHARE_ERROR, carried_share
from solvers.rod.cycle.guide_loads import (
    CLAMP_MOMENT,
    CONTACT_LOAD,
    GUIDE_RESULTS,
    SIDE_FORCE,
    Guide,
    couple_of,
    friction_power,
    guide_results,
    relative,
)
from solvers.rod.cycle.sampling import first_edges, sample
from solvers.rod.cycle.section import (
    FEW_STATIONS,
    HIGH_STRESS,
    LOW_STRESS,
    MAX_DEFLECTION,
    MAX_STRESS,
    STATIONS,
    STRIP_RESULTS,
    UTILISATION,
    WORST_FIBRE,
    WORST_SECTION,
    Field,
    strip_results,
)
from solvers.rod.cycle.state import ANGLE, CLAMP, FORCE, MOMENT, SIDE, Strip
from solvers.rod.load.axial_force import Drive
from solvers.rod.scene import Dimensions, Load, Scene
from solvers.rod.strip.beam_column import constants
from solvers.rod.strip.buckling import FIRST_ROOT_LIMITS, first_root
from solvers.rod.strip.shear import critical_coupling
from solvers.rod.strip.stiffness import SHEAR_FACTOR
from solvers.rod.vibration.natural_frequencies import (
    FEW_POLYNOMIALS,
    FEW_POLYNOMIALS_ERROR,
    POLYNOMIALS,
    Polynomials,
    all_polynomials,
    frequency_under,
)

Array = NDArray[np.float64]

INPUTS = (
    "level", "sharpness", "phase", "back_pressure", "area", "mass", "crank_radius", "rod_length", "angular_speed",
    "elastic_modulus", "density", "shear_modulus", "b", "h", "l", "skirt_length", "clamp_offset",
    "friction_coefficient", "couples", "shears", "feedback", "contact", "reads", "accuracy",
)  # fmt: skip
"""Columns of an input row, SI units; ``shear_modulus`` is k G. ``couples`` to ``contact`` are 1.0 for active effects,
else 0.0; ``reads`` is 0.0 if only forces, stability and frequency are requested."""


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


_STRIP, _GUIDE, _POWER, _ERROR, _ANGLES, _TOLERANCE, _BY_FRICTION = 5, 12, 15, 16, 17, 18, 19
"""Columns of a result row: the first of those along the strip and of the guide, and single ones."""

SAMPLING_FRACTION = 0.1
"""Sampling tolerance as a fraction of the accuracy."""
ROUNDING = 1e-14
REFINEMENTS = 4
_LOW_ACCURACY = 1e-4
ROUNDING_OF_INPUTS = 4.0 * float(np.finfo(float).eps)
_CONVEXITY_TOLERANCE = 1e-12
_MAX_FIRST_ROOT = float(FIRST_ROOT_LIMITS[1])


def inputs_of(
    scene: Scene, d: Dimensions, composition: Composition, contact: bool, accuracy: float
) -> tuple[float, ...]:
    """Input row of a check; corrections are ignored, as the row is valid only without them."""
    m, p, material, load = scene.mechanism, scene.piston, scene.material, scene.load
    curve, beam = load.curve(), composition.beam
    return (
        curve.level, curve.sharpness, curve.phase, load.reference_pressure(), p.area,
        composition.moving_mass(scene), m.crank_radius, m.rod_length, m.angular_speed,
        material.elastic_modulus, material.density, SHEAR_FACTOR * material.shear_modulus, d.b, d.h, d.l,
        p.skirt_length, p.clamp_offset, p.friction_coefficient, beam.couples, beam.shears, composition.feedback,
        contact, not composition.corrections, accuracy,
    )  # fmt: skip


def check_linear(
    load: Load, inputs: Array, lines: Array, parabolas: Array, rule: Rule, stations: int, results: Array
) -> None:
    """Evaluate checks with the same load pieces, or with smooth loads: write ``results`` (items, results) from
    ``inputs`` (items, INPUTS) and each item's fatigue diagram (items, …)."""
    curve, sharp = load.curve(), np.ascontiguousarray(load.sharp_angles(), dtype=float)
    _check_rows(inputs, lines, parabolas, curve.breaks, curve.pieces, sharp, rule, stations, all_polynomials(), results)


def stations_for(accuracy: float) -> int:
    """Number of initial stations along the strip for an accuracy of the results."""
    return FEW_STATIONS if accuracy >= _LOW_ACCURACY else STATIONS


@kernel
def _check_rows(
    rows: Array, lines: Array, parabolas: Array, breaks: Array, pieces: Array, sharp: Array, rule: Rule, stations: int,
    modes: Polynomials, out: Array,
) -> None:  # fmt: skip
    for i in range(rows.shape[0]):
        row = rows[i]
        drive = Drive(row[0], row[1], row[2], breaks, pieces, row[3], row[4], row[5], row[6], row[7], row[8])
        out[i] = np.nan
        _check_row(drive, row, lines[i], parabolas[i], sharp, rule, stations, modes, out[i])


@kernel
def _check_row(
    drive: Drive, row: Array, lines: Array, parabola: Array, sharp: Array, rule: Rule, stations: int,
    modes: Polynomials, out: Array,
) -> None:  # fmt: skip
    modulus, b, h, l, length, accuracy = row[9], row[12], row[13], row[14], row[7], row[23]
    stiffness, friction = modulus * b * h**3 / 12.0, 4.0 / math.pi * row[17] if row[20] != 0.0 else 0.0
    compliance = stiffness / (row[11] * b * h) if row[19] != 0.0 else 0.0
    rigid = modulus * (b * h * min(b, h) ** 2 / 12.0) * (min(first_root(l / length)[0], _MAX_FIRST_ROOT) / l) ** 2
    critical = min(rigid, -stiffness * critical_coupling(l, length, compliance)) if row[19] != 0.0 else rigid
    lever, offset = 6.0 / row[15], row[16]
    strip = Strip(stiffness, l, length, row[18], compliance, friction, lever, offset, -2.0 * rigid)
    tolerance = SAMPLING_FRACTION * accuracy
    edges, states = sample(drive, strip, first_edges(drive, strip, sharp), rule, tolerance)
    compression, tension, compression_error, tension_error = np.inf, 0.0, 0.0, 0.0
    if edges.size > 0:
        compression, tension, compression_error, tension_error = _forces(edges, rule, states[FORCE], tolerance)
    is_stable = compression < critical
    out[_BY_FRICTION] = 0.0
    if not is_stable:
        # A buckled strip has no shape and so no friction force; only the other forces are meaningful.
        uncoupled = Strip(stiffness, l, length, 0.0, 0.0, 0.0, lever, offset, -2.0 * rigid)
        edges, states = sample(drive, uncoupled, first_edges(drive, uncoupled, sharp), rule, tolerance)
        compression, tension, compression_error, tension_error = _forces(edges, rule, states[FORCE], tolerance)
        if compression < critical:
            compression = critical / carried_share(drive, strip, critical, states[ANGLE])
            compression_error, out[_BY_FRICTION] = SHARE_ERROR * compression, 1.0
    error = max(relative(compression_error, compression), relative(tension_error, tension))
    mean, mean_error = mean_of(edges, rule, states[FORCE])
    out[0], out[1], out[2], out[3] = 1.0 if is_stable else 0.0, critical, compression, tension
    few = accuracy >= 10.0 * FEW_POLYNOMIALS_ERROR
    polynomials = FEW_POLYNOMIALS if few else POLYNOMIALS
    out[4] = frequency_under(modes, stiffness, row[10] * b * h, l, length, mean, polynomials)
    if is_stable and row[22] != 0.0:
        for _ in range(REFINEMENTS):
            found = _strip_and_guide(drive, strip, row, edges, rule, states, lines, parabola, stations, tolerance, out)
            if found <= accuracy or tolerance <= ROUNDING:
                break
            # Small differences of large quantities need a finer discretisation.
            tolerance = max(0.5 * tolerance * accuracy / found, ROUNDING)
            edges, states = sample(drive, strip, edges, rule, tolerance)
        error = max(error, found)
        if compression > 0.0:
            # Near buckling rounding errors of load and strip are amplified in the stresses.
            error = max(error, ROUNDING_OF_INPUTS / (1.0 - compression / critical))
    if critical + mean > 0.0:
        # The frequency is proportional to the square root of the critical force plus the mean force.
        error = max(error, 0.5 * mean_error / (critical + mean) + (FEW_POLYNOMIALS_ERROR if few else 0.0))
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
    drive: Drive, strip: Strip, row: Array, edges: Array, rule: Rule, states: Array, lines: Array, parabola: Array,
    stations: int, tolerance: float, out: Array,
) -> float:  # fmt: skip
    """Write all results of an unbuckled strip to ``out``; return the maximum relative error."""
    direct, bending, contact = 1.0 / (row[12] * row[13]), 0.5 * row[9] * row[13], row[21] != 0.0
    force, none, strip_out = states[FORCE], np.empty((0, states.shape[1])), out[_STRIP : _STRIP + STRIP_RESULTS]
    constant, uncoupled, l = force.min() == force.max(), strip.couples == 0.0, strip.length
    # A shape proportional to the stroke is evaluated at the maximum stroke.
    _, softening, clamp, shear, _ = constants(0.0, l, strip.rod_length, strip.compliance)
    clamp, shear = clamp * drive.crank_radius, shear * drive.crank_radius
    if uncoupled and not constant and _is_convex(lines, parabola):
        error = _clamp_results(edges, rule, states, direct, bending, lines, parabola, tolerance, strip_out)
        strip_out[MAX_DEFLECTION] = abs((0.5 * clamp * l + shear * (l * l / 6.0 - strip.compliance)) * l)
    else:
        # A large constant force would mask a small amplitude: the criterion adds its stress separately.
        mean = direct * force[0] if constant else 0.0
        direct = 0.0 if constant else direct
        field = Field(edges, rule, states, states[SIDE], none, none, l, strip.compliance, direct, bending, False)
        error = strip_results(field, None, mean, lines, parabola, tolerance, stations, strip_out)
    speed = drive.crank_radius * drive.angular_speed
    guide = Guide(
        states[SIDE], states[MOMENT], strip.lever, strip.offset, row[17] * (4.0 / math.pi) * speed,
        drive.crank_radius / drive.rod_length,
    )  # fmt: skip
    parts, guide_out = np.empty(0), out[_GUIDE : _GUIDE + GUIDE_RESULTS]
    if uncoupled:
        side, moment = -strip.stiffness * softening * shear, strip.stiffness * clamp
        guide_out[SIDE_FORCE], guide_out[CLAMP_MOMENT] = abs(side), abs(moment)
        if contact:
            guide_out[CONTACT_LOAD] = abs(side) + abs(couple_of(side, moment, strip.lever, strip.offset))
    else:
        error = max(error, guide_results(edges, rule, guide, None, parts, parts, contact, tolerance, guide_out))
    if contact:
        out[_POWER], power_error = friction_power(edges, rule, guide, tolerance)
        error = max(error, power_error)
    return error


@kernel
def _is_convex(lines: Array, parabola: Array) -> bool:
    """Whether the utilisation is convex in both extreme stresses, and decreasing in the minimum."""
    convex = parabola[0] == 0.0 and lines.shape[1] == 1
    for c in range(lines.shape[0]):
        convex = convex and abs(lines[c, 0, 1]) <= lines[c, 0, 0] * (1.0 + _CONVEXITY_TOLERANCE)
    return convex


@kernel
def _clamp_results(
    edges: Array, rule: Rule, states: Array, direct: float, bending: float, lines: Array, parabola: Array,
    tolerance: float, out: Array,
) -> float:  # fmt: skip
    """Write the results along the strip of a shape proportional to the stroke, whose worst section is the clamp, to
    ``out`` (STRIP_RESULTS,); return the maximum relative error."""
    utilisation, max_stress, utilisation_error, stress_error, amplitude_error = -1.0, 0.0, 0.0, 0.0, 0.0
    upper_estimate = 0.0
    stress = np.empty(states.shape[1])
    for layer in range(2):
        signed_bending = (1.0 - 2.0 * layer) * bending
        for i in range(stress.size):
            stress[i] = direct * states[FORCE, i] + signed_bending * states[CLAMP, i]
        low, high, low_error, high_error = _forces(edges, rule, stress, 0.01 * tolerance)
        low = -low
        fibre_utilisation = utilisation_of(high, low, lines, parabola)
        fibre_error = utilisation_of(high + high_error, low - low_error, lines, parabola) - fibre_utilisation
        upper_estimate = max(upper_estimate, fibre_utilisation + fibre_error)
        if fibre_utilisation > utilisation:
            utilisation, utilisation_error = fibre_utilisation, fibre_error
            out[UTILISATION], out[HIGH_STRESS], out[LOW_STRESS], out[WORST_SECTION] = fibre_utilisation, high, low, 0.0
            out[WORST_FIBRE] = layer
            amplitude_error = relative(high_error + low_error, 0.5 * (high - low))
        if high > max_stress or -low > max_stress:
            max_stress, stress_error = max(high, -low), max(high_error, low_error)
    out[MAX_STRESS] = max_stress
    utilisation_error = max(utilisation_error, upper_estimate - utilisation)
    return max(relative(utilisation_error, utilisation), relative(stress_error, max_stress), amplitude_error)
