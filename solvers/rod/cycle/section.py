"""Stress history of one section of the strip over a revolution, and the governing section.

At the section z, with kappa = psi' and the corrections' series added to it,

    sigma+- = N/(b h) +- (E h/2) kappa,     N = P, or P (1 - V'^2/2) + T V' in large displacement

Along the strip every station whose severity, or the parabola through it and its neighbours, may reach the maximum
starts a bracket, on both fibres: the clamp and the bulge within the span compete, and in optimal strips they are equal.
An iteration evaluates five sections of a bracket (``solvers.numerics.brackets``); at each the extrema over the
revolution are those of polynomials (``solvers.numerics.panels``), or with superposed ringing those of both
(``solvers.numerics.ripple_peaks``). Without ringing, ``rings`` is None, and kernels are compiled without it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue.kernels import GREATEST, utilisation_of
from solvers.numerics.brackets import MOST_ROUNDS, narrow, trial_points
from solvers.numerics.jit import kernel
from solvers.numerics.panels import Rule, greatest, largest
from solvers.numerics.ripple import Ripple, amplitude_bounds
from solvers.numerics.ripple_peaks import greatest_with_ripple
from solvers.rod.cycle.state import CLAMP, COUPLING, FORCE, HEAD, SHEAR, SOFTENING
from solvers.rod.strip.shape import bend

Array = NDArray[np.float64]

UPPER, LOWER, SUNK = range(3)
"""Layers: the fibre at +h/2, the one at -h/2, the deflection."""
FIBRES, DEFLECTION = (UPPER, LOWER + 1), (SUNK, SUNK + 1)
"""Ranges of layers: first, and one past the last."""
STATIONS, FEW_STATIONS = 25, 9
"""Number of initial stations, and for low accuracy."""

VALUE, ERROR, LAYER, SECTION, HIGH, LOW, MOVED, PEAK_COLUMNS = range(8)
"""Columns of a table of peaks: severity and its error, layer, section z [m], maximum and minimum over the revolution
there, and the uncertainty of amplitude and mean due to that of the section; and their number."""

MOST, OF_MOST, LEAST, OF_LEAST = range(4)
"""Columns of a table of extremes over the revolution: maximum and its error, minimum and its error."""

_EPS = float(np.finfo(float).eps)
_GREATEST = GREATEST.lines
_STEPS = np.arange(-3.0, 4.0)
_POWERS = np.vander(_STEPS, 5, increasing=True)
_QUARTIC = np.ascontiguousarray(np.linalg.pinv(_POWERS))
_MAX_SPACING, _MIN_SPACING = 2e-3, 1e-6
_NEWTON_STEPS = 20
NEARLY = 1e-6
"""Relative distance from the maximum within which a peak is fully refined."""


UTILISATION, STRENGTH, HIGH_STRESS, LOW_STRESS, PLACE, FIBRE, DEFLECTED, READINGS = range(8)
"""Results of a check along the strip: 1/n of fatigue, maximum |sigma| [Pa], the stresses [Pa] of the section [m] and
fibre that govern fatigue, maximum |V| [m]; and their number."""


class Field(NamedTuple):
    """A sampled revolution, evaluable along the strip. SI units; columns are angles, panel by panel.

    edges, rule        the panels
    states             (state.ROWS, n)
    side               T of the linear strip [N], (n,)
    bent, sunk         Legendre series over the strip of the corrections to V'' [1/m] and V [m], (terms, n)
    length, compliance free length [m], g = EI/(kGA) [m^2]
    direct, bending    1/(b h) and E h/2; ``direct`` 0 if the stress of a constant force is added by the criterion
    inclined           whether N is tangential to the deflected strip
    """

    edges: Array
    rule: Rule
    states: Array
    side: Array
    bent: Array
    sunk: Array
    length: float
    compliance: float
    direct: float
    bending: float
    inclined: bool


class Rippling(NamedTuple):
    """Ringing on top of a shape that is smooth between corners: a ripple with several parts, Legendre series over the
    strip of their V'' [1/m] and V [m] (terms, parts), and their T [N] and M0 [N m] (parts,). ``begins`` is the number
    of restarts per revolution."""

    ripple: Ripple
    bent: Array
    sunk: Array
    side: Array
    moment: Array
    begins: int


@kernel
def read_section(field: Field, z: float, out: Array) -> None:
    """Stresses [Pa] of both fibres and deflection [m] at a section, shape (3, n)."""
    states, n = field.states, field.states.shape[1]
    curvature, slope, sunk = out[0], out[1], out[2]
    bend(
        states[COUPLING], states[CLAMP], states[SHEAR], states[HEAD], field.length, z, curvature, slope, sunk
    )  # fmt: skip
    if field.inclined or field.compliance != 0.0:
        for i in range(n):
            sheared = field.compliance * states[SHEAR, i]
            slope[i] = slope[i] / states[SOFTENING, i] - sheared
            sunk[i] = sunk[i] / states[SOFTENING, i] - sheared * z
    zeta = 2.0 * z / field.length - 1.0
    _add_series(field.bent, zeta, curvature)
    _add_series(field.sunk, zeta, sunk)
    for i in range(n):
        tangent = states[FORCE, i]
        if field.inclined:
            tangent = tangent * (1.0 - 0.5 * slope[i] * slope[i]) + field.side[i] * slope[i]
        direct, bending = field.direct * tangent, field.bending * curvature[i]
        out[0, i], out[1, i] = direct + bending, direct - bending


@kernel
def _add_series(series: Array, x: float, out: Array) -> None:
    """Add a Legendre series (terms, n) at x by Bonnet's recursion."""
    before, here = 0.0, 1.0
    for k in range(series.shape[0]):
        for i in range(out.size):
            out[i] += here * series[k, i]
        before, here = here, ((2 * k + 1) * x * here - k * before) / (k + 1)


@kernel
def _parts_at(series: Array, x: float) -> Array:
    """Legendre series (terms, parts) at x in [-1, 1]: (parts,)."""
    terms = np.empty(series.shape[0])
    before, here = 0.0, 1.0
    for k in range(terms.size):
        terms[k] = here
        before, here = here, ((2 * k + 1) * x * here - k * before) / (k + 1)
    return np.dot(terms, series)


@kernel
def extremes_at(
    field: Field, rings: Rippling | None, z: float, first: int, last: int, tolerance: float, room: Array, out: Array
) -> None:
    """Maximum and minimum over the revolution of the layers ``first`` … ``last`` - 1 at a section.

    ``tolerance`` is relative to the maximum magnitude of the layer. ``room`` has shape (3, n), ``out`` (3, 4).
    """
    read_section(field, z, room)
    for layer in range(first, last):
        wanted = tolerance * largest(room[layer])
        for side in range(2):
            sign = 1.0 - 2.0 * side
            if rings is None:
                value, error, _ = greatest(field.edges, field.rule, room[layer], sign, wanted)
            else:
                parts = _parts_at(rings.sunk if layer == SUNK else rings.bent, 2.0 * z / field.length - 1.0)
                if layer != SUNK:
                    parts *= field.bending if layer == UPPER else -field.bending
                value, error, _ = greatest_with_ripple(
                    field.edges, field.rule, room[layer], sign, wanted, rings.ripple, parts,
                    amplitude_bounds(rings.ripple, parts),
                )  # fmt: skip
            out[layer, 2 * side], out[layer, 2 * side + 1] = sign * value, error


@kernel
def read_along(
    field: Field, rings: Rippling | None, mean: float, lines: Array, parabola: Array, tolerance: float,
    stations: int, out: Array,
) -> float:  # fmt: skip
    """Write fatigue, strength and deflection to ``out`` (READINGS,); returns the maximum relative error of these and of
    the amplitude, which is judged separately however large the mean (but not a small mean).

    ``lines`` and ``parabola`` are the fatigue diagram; ``mean`` [Pa] is a constant stress omitted from the field.
    """
    table, room = np.empty((stations, 3, 4)), np.empty((3, field.side.size))
    for j in range(stations):
        extremes_at(field, rings, field.length * j / (stations - 1), 0, 3, tolerance, room, table[j])
    error = 0.0
    for asked in range(3):
        diagram, curve = lines.copy(), parabola.copy()
        if asked > 0:
            diagram, curve = _GREATEST.copy(), np.zeros(3)
        if asked < 2:
            for side in range(diagram.shape[0]):
                for line in range(diagram.shape[1]):
                    diagram[side, line, 2] += mean * diagram[side, line, 1]
            curve[2] += mean
        layers = DEFLECTION if asked == 2 else FIBRES
        found = peaks(field, rings, room, table, layers[0], layers[1], diagram, curve, tolerance, asked == 0)
        best = 0
        for k in range(found.shape[0]):
            best = k if found[k, VALUE] > found[best, VALUE] else best
        value, missing = found[best, VALUE], found[best, ERROR]
        for k in range(found.shape[0]):
            # A lower peak matters only if its error lets it exceed the highest.
            missing = max(missing, found[k, VALUE] + found[k, ERROR] - value)
        error = max(error, missing / abs(value) if value != 0.0 else 0.0)
        if asked == 0:
            out[UTILISATION], out[PLACE], out[FIBRE] = value, found[best, SECTION], found[best, LAYER]
            out[HIGH_STRESS], out[LOW_STRESS] = mean + found[best, HIGH], mean + found[best, LOW]
            amplitude = 0.5 * (found[best, HIGH] - found[best, LOW])
            error = max(error, found[best, MOVED] / amplitude if amplitude != 0.0 else 0.0)
        else:
            out[STRENGTH if asked == 1 else DEFLECTED] = value
    return error


@kernel
def peaks(
    field: Field, rings: Rippling | None, room: Array, table: Array, first: int, last: int, lines: Array,
    parabola: Array, tolerance: float, located: bool,
) -> Array:  # fmt: skip
    """Local maxima along the strip of a severity of the layers ``first`` … ``last`` - 1, one per row (see ``VALUE`` …).

    ``table`` (stations, 3, 4) has the extrema at equally spaced stations from clamp to head. All peaks nearly as high
    as the maximum are refined to ``tolerance`` times that; with ``located`` the section of a smooth peak is found to
    the precision of the severity.
    """
    count = table.shape[0]
    severity = np.empty((last - first, count))
    top = 0.0
    for layer in range(first, last):
        for j in range(count):
            severity[layer - first, j] = utilisation_of(table[j, layer, MOST], table[j, layer, LEAST], lines, parabola)
            top = max(top, severity[layer - first, j])
    seen, found = np.empty((3, 4)), [np.empty(PEAK_COLUMNS) for _ in range(0)]
    place, value, points, heights = np.empty(3), np.empty(3), np.empty(5), np.empty(5)
    length = field.length
    step = length / (count - 1)
    for layer in range(first, last):
        row = severity[layer - first]
        sharpest = 0.0
        for j in range(1, count - 1):
            sharpest = max(sharpest, abs(row[j - 1] - 2.0 * row[j] + row[j + 1]))
        for j in range(count):
            before, here, after = row[abs(j - 1)], row[j], row[j + 1 if j < count - 1 else j - 1]
            # Upper estimate: no side of a concave peak, even with a kink, rises by more than the slope changes.
            inner = min(max(j, 1), count - 2)
            reach = here + abs(row[inner - 1] - 2.0 * row[inner] + row[inner + 1])
            level = 8.0 * _EPS * top
            if (j > 0 and here <= before + level) or here < after - level or reach < (1.0 - NEARLY) * top:
                continue
            low, high = max(j - 1, 0), min(j + 1, count - 1)
            place[0], place[1], place[2] = step * low, step * j, step * high
            value[0], value[1], value[2] = row[low], here, row[high]
            error = np.inf
            if low == j or high == j:
                # With four times the greatest curvature the slope keeps its sign: the peak is the end of the strip.
                error = 0.0 if here - after > 2.0 * sharpest else error
            for _ in range(MOST_ROUNDS if error > 0.0 else 0):
                trial_points(place, value, points)
                for m in range(5):
                    extremes_at(field, rings, points[m], layer, layer + 1, 0.01 * tolerance, room, seen)
                    heights[m] = utilisation_of(seen[layer, MOST], seen[layer, LEAST], lines, parabola)
                error = narrow(place, value, points, heights)
                top = max(top, value[1])
                if error <= tolerance * top or place[2] - place[0] <= 8.0 * _EPS * length:
                    break
                # Abandon a peak that cannot come that near.
                if value[1] + error < (1.0 - NEARLY) * top:
                    break
            if value[1] + error < (1.0 - NEARLY) * top:
                continue
            where, doubt = place[1], 0.0
            if located and 0.0 < where < length:
                where, doubt = _pinpoint(field, rings, layer, where, lines, parabola, tolerance, room, seen)
            found.append(
                _peak_row(field, rings, layer, where, doubt, value[1], error, lines, parabola, tolerance, room, seen)
            )
    out = np.empty((len(found), PEAK_COLUMNS))
    for k in range(len(found)):
        for column in range(PEAK_COLUMNS):
            out[k, column] = found[k][column]
    return out


@kernel
def _peak_row(
    field: Field, rings: Rippling | None, layer: int, z: float, doubt: float, value: float, error: float,
    lines: Array, parabola: Array, tolerance: float, room: Array, seen: Array,
) -> Array:  # fmt: skip
    """The row of one peak, with the effect of a section error ``doubt`` on amplitude and mean."""
    out = np.empty(PEAK_COLUMNS)
    half, middle = np.empty(3), np.empty(3)
    for k in range(3 if doubt > 0.0 else 1):
        section = min(max(z + (0.0, -doubt, doubt)[k], 0.0), field.length)
        extremes_at(field, rings, section, layer, layer + 1, 0.01 * tolerance, room, seen)
        high, low = seen[layer, MOST], seen[layer, LEAST]
        half[k], middle[k] = 0.5 * (high - low), 0.5 * (high + low)
        if k == 0:
            wrong = seen[layer, OF_MOST] + seen[layer, OF_LEAST]
            here = utilisation_of(high, low, lines, parabola)
            above = utilisation_of(high + seen[layer, OF_MOST], low - seen[layer, OF_LEAST], lines, parabola)
            out[VALUE], out[ERROR] = max(here, value), error + max(above - here, 0.0)
            out[LAYER], out[SECTION], out[HIGH], out[LOW], out[MOVED] = layer, section, high, low, wrong
    if doubt > 0.0:
        out[MOVED] += max(abs(half[1] - half[0]), abs(half[2] - half[0]), abs(middle[1] - middle[0]))
        out[MOVED] = max(out[MOVED], abs(middle[2] - middle[0]) + wrong)
    return out


@kernel
def _pinpoint(
    field: Field, rings: Rippling | None, layer: int, place: float, lines: Array, parabola: Array,
    tolerance: float, room: Array, seen: Array,
) -> tuple[float, float]:  # fmt: skip
    """The section of a smooth peak and its uncertainty.

    Maximisation determines the peak value with an error quadratic in that of the section, but amplitude and mean vary
    linearly with the section. The derivative of a polynomial through seven sections avoids this loss. If the polynomial
    misfits its own points the peak is a kink, and closer sections are tried.
    """
    length, values = field.length, np.empty(_STEPS.size)
    width = min(_MAX_SPACING * length, place / 3.0, (length - place) / 3.0)
    while width > _MIN_SPACING * length:
        greatest_value = 0.0
        for k in range(values.size):
            extremes_at(field, rings, place + width * _STEPS[k], layer, layer + 1, 1e-4 * tolerance, room, seen)
            values[k] = utilisation_of(seen[layer, MOST], seen[layer, LEAST], lines, parabola)
            greatest_value = max(greatest_value, values[k])
        # Minus the middle value, which would otherwise dominate the rounding of the fit.
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
        root, bend_here = _level(series), abs(series[2])
        if abs(root) <= 3.0 and bend_here > 0.0 and misfit <= 1e-4 * bend_here:
            return place + width * root, width * (misfit + 4.0 * _EPS) / bend_here
        width /= 4.0
    return place, max(width, 0.0)


@kernel
def _level(series: Array) -> float:
    """Stationary point of a polynomial of degree four, relative to the middle of seven points, by Newton's method;
    inf if none."""
    a, b, c, d = series[1], series[2], series[3], series[4]
    x = 0.0
    for _ in range(_NEWTON_STEPS):
        bend_here = 2.0 * b + x * (6.0 * c + x * 12.0 * d)
        if bend_here == 0.0:
            return np.inf
        step = (a + x * (2.0 * b + x * (3.0 * c + x * 4.0 * d))) / bend_here
        x -= step
        if not abs(x) <= 3.0:
            return np.inf
        if abs(step) <= 4.0 * _EPS:
            break
    return x
