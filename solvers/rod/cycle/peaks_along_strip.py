"""Greatest values along the strip: fatigue, stress, deflection.

On both fibres a bracket starts at every station whose severity, or the parabola through it and its neighbours, may
reach the maximum: the clamp and a section within the span compete, and in optimal strips they are equal.
An iteration evaluates five sections of a bracket (``solvers.numerics.brackets``).
"""

from __future__ import annotations

import numpy as np

from solvers.fatigue.kernels import GREATEST, utilisation_of, with_mean
from solvers.numerics.arrays import Array
from solvers.numerics.brackets import MAX_ITERATIONS, shrink_bracket, trial_points
from solvers.numerics.jit import kernel
from solvers.rod.cycle.peak_section import Severities, peak_section, severity_at
from solvers.rod.cycle.section import (
    DEFLECTION_LAYERS,
    FIBRE_LAYERS,
    MAXIMUM,
    MAXIMUM_ERROR,
    MINIMUM,
    MINIMUM_ERROR,
    Field,
    RingingShape,
    extremes_at,
)

STATIONS, FEW_STATIONS = 9, 5
"""Number of initial stations along the strip, and for low accuracy. With 7, one of 15,000 checks at 1e-6 missed a peak,
by 5e-5; with 5, none of 17,000 at 1e-2 did."""

VALUE, ERROR, LAYER, SECTION, HIGH, LOW, SECTION_EFFECT, PEAK_COLUMNS = range(8)
"""Columns of a table of peaks: severity and its error, layer, section z [m], maximum and minimum over the revolution
there, and the uncertainty of amplitude and mean due to that of the section; and their number."""

_EPS = float(np.finfo(float).eps)
_GREATEST = GREATEST.lines
_PEAK_TOLERANCE = 1e-6
"""Relative distance from the maximum within which a peak is fully refined."""
_FINER = 0.01
"""Tolerance of an extreme over the revolution as a share of that along the strip."""

UTILISATION, MAX_STRESS, HIGH_STRESS, LOW_STRESS, WORST_SECTION, WORST_FIBRE, MAX_DEFLECTION, STRIP_RESULTS = range(8)
"""Results of a check along the strip: 1/n of fatigue, maximum |sigma| [Pa], the stresses [Pa] of the section [m] and
fibre that govern fatigue, maximum |V| [m]; and their number."""


@kernel
def strip_results(
    field: Field, ringing: RingingShape | None, lines: Array, parabola: Array, tolerance: float, stations: int,
    out: Array,
) -> float:  # fmt: skip
    """Write fatigue, maximum stress and deflection to ``out`` (STRIP_RESULTS,); return the maximum relative error of
    these and of the amplitude, which is judged separately however large the mean (but not a small mean).

    ``lines`` and ``parabola`` are the fatigue diagram.
    """
    table, work, extremes = np.empty((stations, 3, 4)), np.empty((3, field.states.shape[1])), np.empty((3, 4))
    for j in range(stations):
        extremes_at(field, ringing, field.strip.length * j / (stations - 1), 0, 3, tolerance, work, table[j])
    error, mean = 0.0, field.constant
    for result in range(3):
        diagram, curve = (lines, parabola) if result == 0 else (_GREATEST.copy(), np.zeros(3))
        if result < 2:
            diagram, curve = with_mean(diagram, curve, mean)
        layers = DEFLECTION_LAYERS if result == 2 else FIBRE_LAYERS
        severities = Severities(field, ringing, diagram, curve, tolerance, work, extremes)
        rows = _peaks(severities, table, layers[0], layers[1], result == 0)
        best = 0
        for k in range(rows.shape[0]):
            best = k if rows[k, VALUE] > rows[best, VALUE] else best
        value, value_error = rows[best, VALUE], rows[best, ERROR]
        for k in range(rows.shape[0]):
            # A lower peak matters only if its error lets it exceed the highest.
            value_error = max(value_error, rows[k, VALUE] + rows[k, ERROR] - value)
        error = max(error, value_error / abs(value) if value != 0.0 else 0.0)
        if result == 0:
            out[UTILISATION], out[WORST_SECTION], out[WORST_FIBRE] = value, rows[best, SECTION], rows[best, LAYER]
            out[HIGH_STRESS], out[LOW_STRESS] = mean + rows[best, HIGH], mean + rows[best, LOW]
            amplitude = 0.5 * (rows[best, HIGH] - rows[best, LOW])
            error = max(error, rows[best, SECTION_EFFECT] / amplitude if amplitude != 0.0 else 0.0)
        else:
            out[MAX_STRESS if result == 1 else MAX_DEFLECTION] = value
    return error


@kernel
def _peaks(s: Severities, table: Array, first: int, last: int, located: bool) -> Array:
    """Local maxima along the strip of the severity of the layers ``first`` … ``last`` - 1, one per row (see ``VALUE``
    …).

    ``table`` (stations, 3, 4) has the extrema at equally spaced stations from clamp to head. All peaks within
    ``_PEAK_TOLERANCE`` of the maximum are refined to the severities' tolerance times that; with ``located`` the section
    of a smooth peak is found to the precision of the severity.
    """
    count = table.shape[0]
    severity = np.empty((last - first, count))
    top = 0.0
    for layer in range(first, last):
        for j in range(count):
            maximum, minimum = table[j, layer, MAXIMUM], table[j, layer, MINIMUM]
            severity[layer - first, j] = utilisation_of(maximum, minimum, s.lines, s.parabola)
            top = max(top, severity[layer - first, j])
    rows, length = [np.empty(PEAK_COLUMNS) for _ in range(0)], s.field.strip.length
    place, value, points, trials, step = np.empty(3), np.empty(3), np.empty(5), np.empty(5), length / (count - 1)
    for layer in range(first, last):
        row = severity[layer - first]
        curvature = 0.0
        for j in range(1, count - 1):
            curvature = max(curvature, abs(row[j - 1] - 2.0 * row[j] + row[j + 1]))
        for j in range(count):
            before, here, after = row[abs(j - 1)], row[j], row[j + 1 if j < count - 1 else j - 1]
            # Upper estimate: a concave peak, even with a kink, rises by no more than the slope changes.
            inner = min(max(j, 1), count - 2)
            bound = here + abs(row[inner - 1] - 2.0 * row[inner] + row[inner + 1])
            rounding = 8.0 * _EPS * top
            lower = (j > 0 and here <= before + rounding) or here < after - rounding
            hidden = _side_of_hidden_peak(row, j) if lower else 0
            if (lower and hidden == 0) or bound < (1.0 - _PEAK_TOLERANCE) * top:
                continue
            low, high = max(j - 1, 0), min(j + 1, count - 1)
            place[0], place[1], place[2] = step * low, step * j, step * high
            value[0], value[1], value[2] = row[low], here, row[high]
            error = np.inf
            if hidden != 0:
                trial_points(place, value, points)
                between = severity_at(s, layer, points[1], _FINER)
                if between <= max(here, row[j + hidden]):
                    continue
                other = 0 if hidden > 0 else 2
                place[other], value[other], place[1], value[1] = place[1], value[1], points[1], between
            elif low == j or high == j:
                # With four times the greatest curvature the slope keeps its sign: the peak is the end of the strip.
                error = 0.0 if here - after > 2.0 * curvature else error
            for _ in range(MAX_ITERATIONS if error > 0.0 else 0):
                trial_points(place, value, points)
                for m in range(5):
                    trials[m] = severity_at(s, layer, points[m], _FINER)
                error = shrink_bracket(place, value, points, trials)
                top = max(top, value[1])
                if error <= s.tolerance * top or place[2] - place[0] <= 8.0 * _EPS * length:
                    break
                # Abandon a peak that cannot come near the maximum.
                if value[1] + error < (1.0 - _PEAK_TOLERANCE) * top:
                    break
            if value[1] + error < (1.0 - _PEAK_TOLERANCE) * top:
                continue
            z, z_error = place[1], 0.0
            if located and 0.0 < z < length:
                z, z_error = peak_section(s, layer, z)
            rows.append(_peak_row(s, layer, z, z_error, value[1], error))
    out = np.empty((len(rows), PEAK_COLUMNS))
    for k in range(len(rows)):
        for column in range(PEAK_COLUMNS):
            out[k, column] = rows[k][column]
    return out


@kernel
def _side_of_hidden_peak(row: Array, j: int) -> int:
    """+1 or -1 if a peak is likely between the station and the next or previous one, although values rise beyond that,
    too; otherwise 0.

    The parabola through the station and its neighbours then has its vertex in that interval. A severity is the maximum
    of smooth functions, so it may fall and rise again between two stations.
    """
    if j == 0 or j == row.size - 1:
        return 0
    concavity, rise = 2.0 * row[j] - row[j - 1] - row[j + 1], row[j + 1] - row[j - 1]
    side = 1 if rise > 0.0 else -1
    beyond = j + 2 * side
    if 0 <= beyond < row.size and concavity < abs(rise) < 2.0 * concavity and row[beyond] > row[j + side]:
        return side
    return 0


@kernel
def _peak_row(s: Severities, layer: int, z: float, z_error: float, value: float, error: float) -> Array:
    """The row of one peak, with the effect of the error of its section on amplitude and mean."""
    out, extremes = np.empty(PEAK_COLUMNS), s.extremes
    amplitude, midpoint = np.empty(3), np.empty(3)
    for k in range(3 if z_error > 0.0 else 1):
        section = min(max(z + (0.0, -z_error, z_error)[k], 0.0), s.field.strip.length)
        severity = severity_at(s, layer, section, _FINER)
        high, low = extremes[layer, MAXIMUM], extremes[layer, MINIMUM]
        amplitude[k], midpoint[k] = 0.5 * (high - low), 0.5 * (high + low)
        if k == 0:
            extreme_error = extremes[layer, MAXIMUM_ERROR] + extremes[layer, MINIMUM_ERROR]
            upper, lower = high + extremes[layer, MAXIMUM_ERROR], low - extremes[layer, MINIMUM_ERROR]
            upper_severity = utilisation_of(upper, lower, s.lines, s.parabola)
            out[VALUE], out[ERROR] = max(severity, value), error + max(upper_severity - severity, 0.0)
            out[LAYER], out[SECTION], out[HIGH], out[LOW] = layer, section, high, low
            out[SECTION_EFFECT] = extreme_error
    if z_error > 0.0:
        out[SECTION_EFFECT] += max(
            abs(amplitude[1] - amplitude[0]), abs(amplitude[2] - amplitude[0]), abs(midpoint[1] - midpoint[0])
        )
        out[SECTION_EFFECT] = max(out[SECTION_EFFECT], abs(midpoint[2] - midpoint[0]) + extreme_error)
    return out
