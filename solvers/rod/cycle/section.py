"""Stress history of one section of the strip over a revolution, and the governing section.

At the section z, with kappa = psi' and the corrections' series added to it,

    sigma+- = N/(b h) +- (E h/2) kappa,     N = P, or P (1 - V'^2/2) + T V' in large displacement

On both fibres a bracket starts at every station whose severity, or the parabola through it and its neighbours, may
reach the maximum: the clamp and a section within the span compete, and in optimal strips they are equal.
An iteration evaluates five sections of a bracket (``solvers.numerics.brackets``); at each the extrema over the
revolution are those of polynomials (``solvers.numerics.panels``), or with superposed ringing those of both
(``solvers.numerics.ripple_peaks``). Without ringing, ``ringing`` is None, and kernels are compiled without it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solvers.fatigue.kernels import GREATEST, utilisation_of, with_mean
from solvers.numerics.arrays import Array
from solvers.numerics.brackets import MAX_ITERATIONS, shrink_bracket, trial_points
from solvers.numerics.jit import kernel
from solvers.numerics.panels import Rule, greatest, largest
from solvers.numerics.ripple import Ripple, amplitude_bounds
from solvers.numerics.ripple_peaks import greatest_with_ripple
from solvers.rod.cycle.bent_strip import linear_shape, tangential_force
from solvers.rod.cycle.state import FORCE, SIDE

UPPER, LOWER, DEFLECTION = range(3)
"""Layers: stress of the fibre at +h/2, of the fibre at -h/2, deflection."""
FIBRE_LAYERS, DEFLECTION_LAYERS = (UPPER, LOWER + 1), (DEFLECTION, DEFLECTION + 1)
"""Ranges of layers: first, and one past the last."""
STATIONS, FEW_STATIONS = 9, 5
"""Number of initial stations along the strip, and for low accuracy. With 7, one of 15,000 checks at 1e-6 missed a peak,
by 5e-5; with 5, none of 17,000 at 1e-2 did."""

VALUE, ERROR, LAYER, SECTION, HIGH, LOW, SECTION_EFFECT, PEAK_COLUMNS = range(8)
"""Columns of a table of peaks: severity and its error, layer, section z [m], maximum and minimum over the revolution
there, and the uncertainty of amplitude and mean due to that of the section; and their number."""

MAXIMUM, MAXIMUM_ERROR, MINIMUM, MINIMUM_ERROR = range(4)
"""Columns of a table of extremes over the revolution: maximum and its error, minimum and its error."""

_EPS = float(np.finfo(float).eps)
_GREATEST = GREATEST.lines
_STEPS = np.arange(-3.0, 4.0)
_POWERS = np.vander(_STEPS, 5, increasing=True)
_QUARTIC = np.ascontiguousarray(np.linalg.pinv(_POWERS))
_MAX_SPACING, _MIN_SPACING = 2e-3, 1e-6
_NEWTON_STEPS = 20
PEAK_TOLERANCE = 1e-6
"""Relative distance from the maximum within which a peak is fully refined."""


UTILISATION, MAX_STRESS, HIGH_STRESS, LOW_STRESS, WORST_SECTION, WORST_FIBRE, MAX_DEFLECTION, STRIP_RESULTS = range(8)
"""Results of a check along the strip: 1/n of fatigue, maximum |sigma| [Pa], the stresses [Pa] of the section [m] and
fibre that govern fatigue, maximum |V| [m]; and their number."""


class Field(NamedTuple):
    """A sampled revolution, evaluable along the strip. SI units; columns are angles, panel by panel.

    edges, rule        the panels
    states             (state.ROWS, n)
    curvature_series   Legendre series over the strip of the corrections to V'' [1/m], (terms, n)
    deflection_series  the same to V [m]
    length, compliance free length [m], g = EI/(kGA) [m^2]
    direct, bending    1/(b h) and E h/2; ``direct`` 0 if the stress of a constant force is added by the criterion
    inclined           whether N is tangential to the deflected strip
    """

    edges: Array
    rule: Rule
    states: Array
    curvature_series: Array
    deflection_series: Array
    length: float
    compliance: float
    direct: float
    bending: float
    inclined: bool


class RingingShape(NamedTuple):
    """Ringing superposed on a shape that is smooth between corners: a ripple with several parts, Legendre series over
    the strip of their V'' [1/m] and V [m] (terms, parts), and their T [N] and M0 [N m] (parts,). ``begins`` is the
    number of restarts per revolution."""

    ripple: Ripple
    curvature_series: Array
    deflection_series: Array
    side: Array
    moment: Array
    begins: int


@kernel
def section_layers(field: Field, z: float, out: Array) -> None:
    """Write stresses [Pa] of both fibres and deflection [m] at a section to ``out``, shape (3, n)."""
    states, n = field.states, field.states.shape[1]
    curvature, slope, deflection = out[0], out[1], out[2]
    linear_shape(states, field.length, field.compliance, z, curvature, slope, deflection)
    zeta = 2.0 * z / field.length - 1.0
    add_series(field.curvature_series, zeta, curvature)
    add_series(field.deflection_series, zeta, deflection)
    for i in range(n):
        tangential = states[FORCE, i]
        if field.inclined:
            tangential = tangential_force(tangential, states[SIDE, i], slope[i])
        direct, bending = field.direct * tangential, field.bending * curvature[i]
        out[0, i], out[1, i] = direct + bending, direct - bending


@kernel
def add_series(series: Array, x: float, out: Array) -> None:
    """Add a Legendre series (terms, n) at x by Bonnet's recursion."""
    previous, legendre = 0.0, 1.0
    for k in range(series.shape[0]):
        for i in range(out.size):
            out[i] += legendre * series[k, i]
        previous, legendre = legendre, ((2 * k + 1) * x * legendre - k * previous) / (k + 1)


@kernel
def _parts_at(series: Array, x: float) -> Array:
    """Values of Legendre series (terms, parts) at x in [-1, 1], (parts,)."""
    polynomials = np.empty(series.shape[0])
    previous, legendre = 0.0, 1.0
    for k in range(polynomials.size):
        polynomials[k] = legendre
        previous, legendre = legendre, ((2 * k + 1) * x * legendre - k * previous) / (k + 1)
    return np.dot(polynomials, series)


@kernel
def extremes_at(
    field: Field, ringing: RingingShape | None, z: float, first: int, last: int, tolerance: float, work: Array,
    out: Array,
) -> None:  # fmt: skip
    """Maximum and minimum over the revolution of the layers ``first`` … ``last`` - 1 at a section.

    ``tolerance`` is relative to the maximum magnitude of the layer. ``work`` has shape (3, n), ``out`` (3, 4).
    """
    section_layers(field, z, work)
    for layer in range(first, last):
        target = tolerance * largest(work[layer])
        for side in range(2):
            sign = 1.0 - 2.0 * side
            if ringing is None:
                value, error, _ = greatest(field.edges, field.rule, work[layer], sign, target)
            else:
                series = ringing.deflection_series if layer == DEFLECTION else ringing.curvature_series
                parts = _parts_at(series, 2.0 * z / field.length - 1.0)
                if layer != DEFLECTION:
                    parts *= field.bending if layer == UPPER else -field.bending
                value, error, _ = greatest_with_ripple(
                    field.edges, field.rule, work[layer], sign, target, ringing.ripple, parts,
                    amplitude_bounds(ringing.ripple, parts),
                )  # fmt: skip
            out[layer, 2 * side], out[layer, 2 * side + 1] = sign * value, error


@kernel
def strip_results(
    field: Field, ringing: RingingShape | None, mean: float, lines: Array, parabola: Array, tolerance: float,
    stations: int, out: Array,
) -> float:  # fmt: skip
    """Write fatigue, maximum stress and deflection to ``out`` (STRIP_RESULTS,); return the maximum relative error of
    these and of the amplitude, which is judged separately however large the mean (but not a small mean).

    ``lines`` and ``parabola`` are the fatigue diagram; ``mean`` [Pa] is a constant stress omitted from the field.
    """
    table, work = np.empty((stations, 3, 4)), np.empty((3, field.states.shape[1]))
    for j in range(stations):
        extremes_at(field, ringing, field.length * j / (stations - 1), 0, 3, tolerance, work, table[j])
    error = 0.0
    for result in range(3):
        diagram, curve = (lines, parabola) if result == 0 else (_GREATEST.copy(), np.zeros(3))
        if result < 2:
            diagram, curve = with_mean(diagram, curve, mean)
        layers = DEFLECTION_LAYERS if result == 2 else FIBRE_LAYERS
        rows = peaks(field, ringing, work, table, layers[0], layers[1], diagram, curve, tolerance, result == 0)
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
def peaks(
    field: Field, ringing: RingingShape | None, work: Array, table: Array, first: int, last: int, lines: Array,
    parabola: Array, tolerance: float, located: bool,
) -> Array:  # fmt: skip
    """Local maxima along the strip of a severity of the layers ``first`` … ``last`` - 1, one per row (see ``VALUE`` …).

    ``table`` (stations, 3, 4) has the extrema at equally spaced stations from clamp to head. All peaks within
    ``PEAK_TOLERANCE`` of the maximum are refined to ``tolerance`` times that; with ``located`` the section of a smooth
    peak is found to the precision of the severity.
    """
    count = table.shape[0]
    severity = np.empty((last - first, count))
    top = 0.0
    for layer in range(first, last):
        for j in range(count):
            maximum, minimum = table[j, layer, MAXIMUM], table[j, layer, MINIMUM]
            severity[layer - first, j] = utilisation_of(maximum, minimum, lines, parabola)
            top = max(top, severity[layer - first, j])
    extremes, rows = np.empty((3, 4)), [np.empty(PEAK_COLUMNS) for _ in range(0)]
    place, value, points, trials = np.empty(3), np.empty(3), np.empty(5), np.empty(5)
    length = field.length
    step = length / (count - 1)
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
            if (lower and hidden == 0) or bound < (1.0 - PEAK_TOLERANCE) * top:
                continue
            low, high = max(j - 1, 0), min(j + 1, count - 1)
            place[0], place[1], place[2] = step * low, step * j, step * high
            value[0], value[1], value[2] = row[low], here, row[high]
            error = np.inf
            if hidden != 0:
                trial_points(place, value, points)
                extremes_at(field, ringing, points[1], layer, layer + 1, 0.01 * tolerance, work, extremes)
                between = utilisation_of(extremes[layer, MAXIMUM], extremes[layer, MINIMUM], lines, parabola)
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
                    extremes_at(field, ringing, points[m], layer, layer + 1, 0.01 * tolerance, work, extremes)
                    trials[m] = utilisation_of(extremes[layer, MAXIMUM], extremes[layer, MINIMUM], lines, parabola)
                error = shrink_bracket(place, value, points, trials)
                top = max(top, value[1])
                if error <= tolerance * top or place[2] - place[0] <= 8.0 * _EPS * length:
                    break
                # Abandon a peak that cannot come near the maximum.
                if value[1] + error < (1.0 - PEAK_TOLERANCE) * top:
                    break
            if value[1] + error < (1.0 - PEAK_TOLERANCE) * top:
                continue
            z, z_error = place[1], 0.0
            if located and 0.0 < z < length:
                z, z_error = _locate_peak(field, ringing, layer, z, lines, parabola, tolerance, work, extremes)
            rows.append(
                _peak_row(
                    field, ringing, layer, z, z_error, value[1], error, lines, parabola, tolerance, work, extremes
                )
            )
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
def _peak_row(
    field: Field, ringing: RingingShape | None, layer: int, z: float, z_error: float, value: float, error: float,
    lines: Array, parabola: Array, tolerance: float, work: Array, extremes: Array,
) -> Array:  # fmt: skip
    """The row of one peak, with the effect of the error of its section on amplitude and mean."""
    out = np.empty(PEAK_COLUMNS)
    amplitude, midpoint = np.empty(3), np.empty(3)
    for k in range(3 if z_error > 0.0 else 1):
        section = min(max(z + (0.0, -z_error, z_error)[k], 0.0), field.length)
        extremes_at(field, ringing, section, layer, layer + 1, 0.01 * tolerance, work, extremes)
        high, low = extremes[layer, MAXIMUM], extremes[layer, MINIMUM]
        amplitude[k], midpoint[k] = 0.5 * (high - low), 0.5 * (high + low)
        if k == 0:
            extreme_error = extremes[layer, MAXIMUM_ERROR] + extremes[layer, MINIMUM_ERROR]
            severity = utilisation_of(high, low, lines, parabola)
            upper, lower = high + extremes[layer, MAXIMUM_ERROR], low - extremes[layer, MINIMUM_ERROR]
            upper_severity = utilisation_of(upper, lower, lines, parabola)
            out[VALUE], out[ERROR] = max(severity, value), error + max(upper_severity - severity, 0.0)
            out[LAYER], out[SECTION], out[HIGH], out[LOW] = layer, section, high, low
            out[SECTION_EFFECT] = extreme_error
    if z_error > 0.0:
        out[SECTION_EFFECT] += max(
            abs(amplitude[1] - amplitude[0]), abs(amplitude[2] - amplitude[0]), abs(midpoint[1] - midpoint[0])
        )
        out[SECTION_EFFECT] = max(out[SECTION_EFFECT], abs(midpoint[2] - midpoint[0]) + extreme_error)
    return out


@kernel
def _locate_peak(
    field: Field, ringing: RingingShape | None, layer: int, section: float, lines: Array, parabola: Array,
    tolerance: float, work: Array, extremes: Array,
) -> tuple[float, float]:  # fmt: skip
    """Return the section of a smooth peak and its uncertainty.

    The error of a maximised peak value is quadratic in that of the section, but amplitude and mean vary linearly with
    the section. The derivative of a polynomial through seven sections avoids this loss. If the polynomial misfits its
    own points the peak is a kink, and closer sections are tried.
    """
    length, values = field.length, np.empty(_STEPS.size)
    width = min(_MAX_SPACING * length, section / 3.0, (length - section) / 3.0)
    while width > _MIN_SPACING * length:
        greatest_value = 0.0
        for k in range(values.size):
            extremes_at(field, ringing, section + width * _STEPS[k], layer, layer + 1, 1e-4 * tolerance, work, extremes)
            values[k] = utilisation_of(extremes[layer, MAXIMUM], extremes[layer, MINIMUM], lines, parabola)
            greatest_value = max(greatest_value, values[k])
        # Subtract the middle value, which would otherwise dominate the rounding errors of the fit.
        middle, misfit = values[3], 0.0
        for k in range(values.size):
            values[k] = (values[k] - middle) / greatest_value
        series = np.zeros(5)
        for m in range(5):
            for k in range(values.size):
                series[m] += _QUARTIC[m, k] * values[k]
        for k in range(values.size):
            total = -values[k]
            for m in range(5):
                total += _POWERS[k, m] * series[m]
            misfit += total * total
        misfit = math.sqrt(misfit)
        root, curvature = _stationary_point(series), abs(series[2])
        if abs(root) <= 3.0 and curvature > 0.0 and misfit <= 1e-4 * curvature:
            return section + width * root, width * (misfit + 4.0 * _EPS) / curvature
        width /= 4.0
    return section, max(width, 0.0)


@kernel
def _stationary_point(series: Array) -> float:
    """Stationary point of a polynomial of degree four, relative to the middle of seven points, by Newton's method;
    inf if none."""
    a, b, c, d = series[1], series[2], series[3], series[4]
    x = 0.0
    for _ in range(_NEWTON_STEPS):
        curvature = 2.0 * b + x * (6.0 * c + x * 12.0 * d)
        if curvature == 0.0:
            return np.inf
        step = (a + x * (2.0 * b + x * (3.0 * c + x * 4.0 * d))) / curvature
        x -= step
        if not abs(x) <= 3.0:
            return np.inf
        if abs(step) <= 4.0 * _EPS:
            break
    return x
