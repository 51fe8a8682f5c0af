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
from solvers.rod.cycle.field_results import field_results
from solvers.rod.cycle.friction_buckling import SHARE_ERROR, carried_share
from solvers.rod.cycle.guide_loads import Guide, friction_power, relative
from solvers.rod.cycle.peaks_along_strip import FEW_STATIONS, STATIONS
from solvers.rod.cycle.sampling import RESOLVED_ROWS, ROUNDING, first_edges, rule_for, sample
from solvers.rod.cycle.section import field_of
from solvers.rod.cycle.state import ANGLE, FORCE, MOMENT, SIDE, Strip, least_critical_force, with_models
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
_FREQUENCY, _FIELD, _POWER, _ERROR, _ANGLES, _TOLERANCE, _BY_FRICTION = map(
    Results._fields.index,
    ("natural_frequency", "utilisation", "power", "error", "angles", "tolerance", "by_friction"),
)
FIELD_COLUMNS = Results._fields[_FIELD:_POWER]
"""Those columns that ``field_results`` writes, in its order."""

SAMPLING_FRACTION, _FORCE_FRACTION = 0.1, 0.5
"""Sampling tolerances as fractions of the accuracy: of a shape, whose stresses are differences, and of forces alone."""
REFINEMENTS = 4
_LOW_ACCURACY, _FEW_STATIONS_ACCURACY = 1e-4, 1e-2
_ROUNDING_OF_INPUTS = 4.0 * float(np.finfo(float).eps)


def check_linear(cycle: Cycle, diagram: Diagram, contact: bool, accuracy: float) -> Results:
    """Check a strip without its corrections; with corrections only forces, stability and frequency are found."""
    scene = cycle.scene
    sharp = np.ascontiguousarray(scene.load.sharp_angles(), dtype=float)
    out, rule, stations = _UNDEFINED.copy(), rule_for(scene.load, accuracy), stations_for(accuracy)
    has_shape = not cycle.composition.corrections
    _check(
        cycle.drive, cycle.strip, power_per_wall(scene), sharp, *diagram, rule, stations, contact, has_shape, accuracy,
        all_polynomials(), out,
    )  # fmt: skip
    return Results(*out.tolist())


def stations_for(accuracy: float) -> int:
    """Number of initial stations along the strip for an accuracy of the results."""
    return FEW_STATIONS if accuracy >= _FEW_STATIONS_ACCURACY else STATIONS


@kernel
def _check(
    drive: Drive, strip: Strip, per_wall: float, sharp: Array, lines: Array, parabola: Array, rule: Rule,
    stations: int, contact: bool, has_shape: bool, accuracy: float, modes: Polynomials, out: Array,
) -> None:  # fmt: skip
    """Kernel of ``check_linear``: write the results to ``out``."""
    critical = least_critical_force(strip)
    # A shape with corrections is sampled together with them; here only its forces are needed.
    rows, tolerance = (RESOLVED_ROWS, SAMPLING_FRACTION * accuracy) if has_shape else (1, _FORCE_FRACTION * accuracy)
    edges, states = sample(drive, strip, critical, first_edges(drive, strip, sharp), rule, tolerance, rows)
    compression, tension, compression_error, tension_error = np.inf, 0.0, 0.0, 0.0
    if edges.size > 0:
        compression, tension, compression_error, tension_error = _forces(edges, rule, states[FORCE], tolerance)
    is_stable = compression < critical
    out[_BY_FRICTION] = 0.0
    if not is_stable:
        # A buckled strip has no shape and so no friction force; only the other forces are meaningful.
        unbent = with_models(strip, 0.0, 0.0, 0.0)
        edges, states = sample(drive, unbent, np.inf, first_edges(drive, unbent, sharp), rule, tolerance, RESOLVED_ROWS)
        compression, tension, compression_error, tension_error = _forces(edges, rule, states[FORCE], tolerance)
        if compression < critical:
            compression = critical / carried_share(drive, strip, critical, states[ANGLE])
            compression_error, out[_BY_FRICTION] = SHARE_ERROR * compression, 1.0
    error = max(relative(compression_error, compression), relative(tension_error, tension))
    mean, mean_error = mean_of(edges, rule, states[FORCE])
    out[0], out[1], out[2], out[3] = 1.0 if is_stable else 0.0, critical, compression, tension
    few = accuracy >= _LOW_ACCURACY
    polynomials = FEW_POLYNOMIALS if few else POLYNOMIALS
    out[_FREQUENCY] = frequency_under(
        modes, strip.stiffness, strip.line_mass, strip.length, strip.rod_length, mean, polynomials
    )
    if is_stable and has_shape:
        for _ in range(REFINEMENTS):
            none, ratio = np.empty((0, states.shape[1])), drive.crank_radius / drive.rod_length
            field = field_of(edges, rule, strip, states, none, none, False)
            guide = Guide(states[SIDE], states[MOMENT], strip.lever, strip.offset, per_wall, ratio)
            field_out = out[_FIELD:_POWER]
            found = field_results(field, None, guide, contact, lines, parabola, tolerance, stations, field_out)
            if contact:
                out[_POWER], power_error = friction_power(edges, rule, guide, tolerance)
                found = max(found, power_error)
            if found <= accuracy or tolerance <= ROUNDING:
                break
            # Small differences of large quantities need a finer discretisation.
            tolerance = max(0.5 * tolerance * accuracy / found, ROUNDING)
            edges, states = sample(drive, strip, critical, edges, rule, tolerance, rows)
        error = max(error, found)
    if is_stable and compression > 0.0:
        # Near buckling rounding errors of load and strip are amplified in the stresses.
        error = max(error, _ROUNDING_OF_INPUTS / (1.0 - compression / critical))
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
