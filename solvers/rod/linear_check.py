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
from solvers.rod.cycle.guide_loads import (
    CLAMP_MOMENT,
    CONTACT_LOAD,
    GUIDE_READINGS,
    SIDE_FORCE,
    Guide,
    couple_of,
    friction_power,
    read_guide,
    relative,
)
from solvers.rod.cycle.sampling import first_edges, sample
from solvers.rod.cycle.section import (
    DEFLECTED,
    FEW_STATIONS,
    FIBRE,
    HIGH_STRESS,
    LOW_STRESS,
    PLACE,
    READINGS,
    STATIONS,
    STRENGTH,
    UTILISATION,
    Field,
    read_along,
)
from solvers.rod.cycle.state import CLAMP, FORCE, MOMENT, SIDE, Strip
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

    stands           whether the strip does not buckle
    pushed, pulled   maximum compression and tension; ``pushed`` is P_cr if the strip buckles by friction only
    natural_frequency  the first one, under the mean axial force of the revolution [Hz]
    strength         maximum |stress|
    high, low        stresses of the section and fibre that govern fatigue; ``layer`` is 0 at +h/2, 1 at -h/2
    contact_load     |T| + 6 |M0 + T e|/Lp
    error            the maximum relative error of all results
    angles           number of sampled crank angles, for sampling to ``tolerance``
    """

    stands: float
    critical_force: float
    pushed: float
    pulled: float
    natural_frequency: float
    utilisation: float
    strength: float
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


_ALONG, _GUIDE, _POWER, _ERROR, _ANGLES, _TOLERANCE = 5, 12, 15, 16, 17, 18
"""Columns of a result row: the first of those along the strip and of the guide, and single ones."""

SHARE = 0.1
"""Sampling tolerance as a fraction of the accuracy."""
ROUNDING = 1e-14
REFINEMENTS = 4
_LOW_ACCURACY = 1e-4
LAST_DIGITS = 4.0 * float(np.finfo(float).eps)
_CONVEX = 1e-12
_ROUND = float(FIRST_ROOT_LIMITS[1])


def inputs_of(
    scene: Scene, d: Dimensions, composition: Composition, contact: bool, accuracy: float
) -> tuple[float, ...]:
    """The input row of a check; corrections are ignored, the row being valid only without them."""
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
    """Evaluate checks with the same load pieces, or with smooth loads: ``results`` (items, results) from ``inputs``
    (items, INPUTS) and the fatigue diagrams of each (items, …)."""
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
    plain = modulus * (b * h * min(b, h) ** 2 / 12.0) * (min(first_root(l / length)[0], _ROUND) / l) ** 2
    critical = min(plain, -stiffness * critical_coupling(l, length, compliance)) if row[19] != 0.0 else plain
    lever, offset = 6.0 / row[15], row[16]
    strip = Strip(stiffness, l, length, row[18], compliance, friction, lever, offset, -2.0 * plain)
    tolerance = SHARE * accuracy
    edges, states = sample(drive, strip, first_edges(drive, strip, sharp), rule, tolerance)
    pushed, pulled, of_pushed, of_pulled = np.inf, 0.0, 0.0, 0.0
    if edges.size > 0:
        pushed, pulled, of_pushed, of_pulled = _forces(edges, rule, states[FORCE], tolerance)
    stands = pushed < critical
    if not stands:
        # A buckled strip has no shape to determine friction; only the force is meaningful.
        bare = Strip(stiffness, l, length, 0.0, 0.0, 0.0, lever, offset, -2.0 * plain)
        edges, states = sample(drive, bare, first_edges(drive, bare, sharp), rule, tolerance)
        pushed, pulled, of_pushed, of_pulled = _forces(edges, rule, states[FORCE], tolerance)
        if pushed < critical:
            pushed, of_pushed = critical, 0.0
    error = max(relative(of_pushed, pushed), relative(of_pulled, pulled))
    mean, of_mean = mean_of(edges, rule, states[FORCE])
    out[0], out[1], out[2], out[3] = 1.0 if stands else 0.0, critical, pushed, pulled
    few = accuracy >= 10.0 * FEW_POLYNOMIALS_ERROR
    polynomials = FEW_POLYNOMIALS if few else POLYNOMIALS
    out[4] = frequency_under(modes, stiffness, row[10] * b * h, l, length, mean, polynomials)
    if stands and row[22] != 0.0:
        for _ in range(REFINEMENTS):
            found = _read(drive, strip, row, edges, rule, states, lines, parabola, stations, tolerance, out)
            if found <= accuracy or tolerance <= ROUNDING:
                break
            # Small differences of large quantities need a finer discretisation than the rest.
            tolerance = max(0.5 * tolerance * accuracy / found, ROUNDING)
            edges, states = sample(drive, strip, edges, rule, tolerance)
        error = max(error, found)
        if pushed > 0.0:
            # Near buckling the rounding of load and strip is amplified in the stresses.
            error = max(error, LAST_DIGITS / (1.0 - pushed / critical))
    if critical + mean > 0.0:
        # The frequency is proportional to the square root of the critical force plus the mean force.
        error = max(error, 0.5 * of_mean / (critical + mean) + (FEW_POLYNOMIALS_ERROR if few else 0.0))
    out[_ERROR], out[_ANGLES], out[_TOLERANCE] = max(error, ROUNDING), states.shape[1], tolerance


@kernel
def _forces(edges: Array, rule: Rule, force: Array, tolerance: float) -> tuple[float, float, float, float]:
    """Maximum compression and tension [N] over the revolution, and their errors."""
    wanted = tolerance * largest(force)
    pushed, of_pushed, _ = greatest(edges, rule, force, -1.0, wanted)
    pulled, of_pulled, _ = greatest(edges, rule, force, 1.0, wanted)
    return pushed, pulled, of_pushed, of_pulled


@kernel
def _read(
    drive: Drive, strip: Strip, row: Array, edges: Array, rule: Rule, states: Array, lines: Array, parabola: Array,
    stations: int, tolerance: float, out: Array,
) -> float:  # fmt: skip
    """Write all results of an unbuckled strip to ``out``; returns the maximum relative error."""
    direct, bending, contact = 1.0 / (row[12] * row[13]), 0.5 * row[9] * row[13], row[21] != 0.0
    force, none, along = states[FORCE], np.empty((0, states.shape[1])), out[_ALONG : _ALONG + READINGS]
    level, straight, l = force.min() == force.max(), strip.couples == 0.0, strip.length
    # Of a shape proportional to the stroke, at its maximum.
    _, softening, clamp, shear, _ = constants(0.0, l, strip.rod_length, strip.compliance)
    clamp, shear = clamp * drive.crank_radius, shear * drive.crank_radius
    if straight and not level and _is_convex(lines, parabola):
        error = _along_straight(edges, rule, states, direct, bending, lines, parabola, tolerance, along)
        along[DEFLECTED] = abs((0.5 * clamp * l + shear * (l * l / 6.0 - strip.compliance)) * l)
    else:
        # A large constant force would mask a small amplitude: the criterion adds its stress separately.
        mean = direct * force[0] if level else 0.0
        field = Field(
            edges, rule, states, states[SIDE], none, none, l, strip.compliance, 0.0 if level else direct, bending, False
        )
        error = read_along(field, None, mean, lines, parabola, tolerance, stations, along)
    speed = drive.crank_radius * drive.angular_speed
    guide = Guide(
        states[SIDE], states[MOMENT], strip.lever, strip.offset, row[17] * (4.0 / math.pi) * speed,
        drive.crank_radius / drive.rod_length,
    )  # fmt: skip
    parts, told = np.empty(0), out[_GUIDE : _GUIDE + GUIDE_READINGS]
    if straight:
        side, moment = -strip.stiffness * softening * shear, strip.stiffness * clamp
        told[SIDE_FORCE], told[CLAMP_MOMENT] = abs(side), abs(moment)
        if contact:
            told[CONTACT_LOAD] = abs(side) + abs(couple_of(side, moment, strip.lever, strip.offset))
    else:
        error = max(error, read_guide(edges, rule, guide, None, parts, parts, contact, tolerance, told))
    if contact:
        out[_POWER], missed = friction_power(edges, rule, guide, tolerance)
        error = max(error, missed)
    return error


@kernel
def _is_convex(lines: Array, parabola: Array) -> bool:
    """Whether the utilisation is convex in both extreme stresses, and decreasing in the minimum."""
    convex = parabola[0] == 0.0 and lines.shape[1] == 1
    for c in range(lines.shape[0]):
        convex = convex and abs(lines[c, 0, 1]) <= lines[c, 0, 0] * (1.0 + _CONVEX)
    return convex


@kernel
def _along_straight(
    edges: Array, rule: Rule, states: Array, direct: float, bending: float, lines: Array, parabola: Array,
    tolerance: float, out: Array,
) -> float:  # fmt: skip
    """Write the clamp stresses of a shape proportional to the stroke to ``out`` (READINGS,); returns the maximum
    relative error."""
    best, most, of_best, of_most, amplitude_error, other = -1.0, 0.0, 0.0, 0.0, 0.0, 0.0
    stress = np.empty(states.shape[1])
    for layer in range(2):
        bends = (1.0 - 2.0 * layer) * bending
        for i in range(stress.size):
            stress[i] = direct * states[FORCE, i] + bends * states[CLAMP, i]
        low, high, of_low, of_high = _forces(edges, rule, stress, 0.01 * tolerance)
        low = -low
        used = utilisation_of(high, low, lines, parabola)
        of_used = utilisation_of(high + of_high, low - of_low, lines, parabola) - used
        other = max(other, used + of_used)
        if used > best:
            best, of_best = used, of_used
            out[UTILISATION], out[HIGH_STRESS], out[LOW_STRESS], out[PLACE], out[FIBRE] = used, high, low, 0.0, layer
            amplitude_error = relative(of_high + of_low, 0.5 * (high - low))
        if high > most or -low > most:
            most, of_most = max(high, -low), max(of_high, of_low)
    out[STRENGTH] = most
    return max(relative(max(of_best, other - best), best), relative(of_most, most), amplitude_error)
