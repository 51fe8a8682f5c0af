"""The compiled loop over checks of strips without corrections: one row of inputs in, one row of results out.

It takes the same steps as ``check`` with the same kernels. In plain bending the shape is the same at all angles,

    sigma+- = P/(b h) +- (E h/2) kappa(z) s(phi),    V = w(z) s(phi),    kappa linear in z,

so the greatest and the least stress, and every severity that is convex in them, are greatest at an end of the strip;
and the deflection is greatest where |w| is, at the greatest stroke. Where the axial force bends the strip the loop
leaves the turn that it sampled, to be read along the strip.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue.kernels import utilisation_of
from solvers.numerics.brackets import MOST_ROUNDS, narrow, trial_points
from solvers.numerics.jit import kernel
from solvers.numerics.panels import Rule
from solvers.rod.bulk.turn import couples_of, friction_power, greater, magnitude_of, sample, top_of
from solvers.rod.cycle.section import NEARLY, STATIONS
from solvers.rod.cycle.state import CLAMP, COUPLING, FORCE, HEAD, MOMENT, SHEAR, SIDE, STROKE, Strip, bend_state
from solvers.rod.load.axial_force import Drive
from solvers.rod.strip.buckling import FIRST_ROOT_LIMITS, first_root
from solvers.rod.strip.shape import bend
from solvers.rod.strip.shear import critical_coupling
from solvers.rod.vibration.natural_frequencies import Energies, frequency_under

Array = NDArray[np.float64]

COLUMNS = (
    "level", "sharpness", "phase", "back_pressure", "area", "mass", "crank_radius", "rod_length", "angular_speed",
    "elastic_modulus", "density", "shear_modulus", "b", "h", "l", "skirt_length", "clamp_offset",
    "friction_coefficient", "couples", "shears", "feedback", "contact", "accuracy",
)  # fmt: skip
"""Of a row of inputs, SI units; the last but one are 1.0 for effects that run, else 0.0. ``shear_modulus`` is k G."""

RESULTS = (
    "done", "critical_force", "pushed", "pulled", "natural_frequency", "utilisation", "strength", "high", "low",
    "section", "layer", "side", "moment", "deflection", "contact_load", "power", "error", "angles",
)  # fmt: skip
"""Of a row of results, SI units: ``pushed`` and ``pulled`` are the greatest compression and tension, ``strength`` the
greatest |stress|, ``high`` and ``low`` the stresses of the fibre and section that govern fatigue. NaN where there is
none. ``done`` is ``WHOLE`` where all is there, ``TURN_ALONE`` where stresses and deflection are left to be read from
the turn, ``LEFT`` where the single check must see to it all."""

LEFT, TURN_ALONE, WHOLE = 0.0, 1.0, 2.0

_SHARE = 0.1
_ROUNDING = 1e-14
_LAST_DIGITS, _EPS = 4.0 * float(np.finfo(float).eps), 8.0 * float(np.finfo(float).eps)
_CLEAR = 0.999
"""Of the critical force: a strip pushed further is left to the single check."""
_CONVEX = 1e-12
_ROUND = float(FIRST_ROOT_LIMITS[1])
_SLOW = 0.95
"""Width of the piston's reversal below which the mean friction power needs more corners than here."""


@kernel
def check_rows(
    rows: Array, lines: Array, parabolas: Array, breaks: Array, pieces: Array, rule: Rule, energies: Energies,
    fine: Array, coarse: Array, out: Array, counts: NDArray[np.intp], edges: Array, states: Array,
) -> None:  # fmt: skip
    """Check rows of inputs (items, COLUMNS) with one load's pieces; into ``out`` (items, RESULTS). ``lines`` and
    ``parabolas`` hold each row's fatigue diagram; ``counts`` of the first ``edges`` (items, most edges) are where its
    panels begin. Turns that are to be read along the strip are left in ``edges`` and in ``states`` (items, state.ROWS,
    most points), which may have no room at all: then they are left to the single check."""
    for i in range(rows.shape[0]):
        for k in range(out.shape[1]):
            out[i, k] = np.nan
        drive = Drive(
            rows[i, 0], rows[i, 1], rows[i, 2], breaks, pieces, rows[i, 3], rows[i, 4], rows[i, 5], rows[i, 6],
            rows[i, 7], rows[i, 8],
        )  # fmt: skip
        out[i, 0], where, table = _check_row(
            drive, rows[i], lines[i], parabolas[i], edges[i, : counts[i]], rule, energies, fine, coarse, out[i]
        )
        if out[i, 0] == TURN_ALONE and i >= states.shape[0]:
            out[i, 0] = LEFT
        if out[i, 0] == TURN_ALONE:
            for k in range(where.size):
                edges[i, k] = where[k]
            for k in range(table.shape[0]):
                for j in range(table.shape[1]):
                    states[i, k, j] = table[k, j]


@kernel
def _check_row(
    drive: Drive, row: Array, lines: Array, parabola: Array, begin: Array, rule: Rule, energies: Energies, fine: Array,
    coarse: Array, out: Array,
) -> tuple[float, Array, Array]:  # fmt: skip
    """One row: what is done of it, and its turn."""
    modulus, b, h, l, length = row[9], row[12], row[13], row[14], row[7]
    coefficient, accuracy = row[17], row[22]
    stiffness = modulus * b * h**3 / 12.0
    compliance = stiffness / (row[11] * b * h) if row[19] != 0.0 else 0.0
    x = min(first_root(l / length)[0], _ROUND)
    plain = modulus * (b * h * min(b, h) ** 2 / 12.0) * (x / l) ** 2
    critical = min(plain, -stiffness * critical_coupling(l, length, compliance)) if row[19] != 0.0 else plain
    friction = 4.0 / math.pi * coefficient if row[20] != 0.0 else 0.0
    strip = Strip(stiffness, l, length, row[18], compliance, friction, 6.0 / row[15], row[16], -2.0 * plain)
    tolerance = _SHARE * accuracy
    edges, states = sample(drive, strip, begin, rule, tolerance)
    if edges.size == 0:
        return LEFT, edges, states
    force = states[FORCE]
    pushed, of_pushed = top_of(edges, rule, force, -1.0, tolerance)
    pulled, of_pulled = top_of(edges, rule, force, 1.0, tolerance)
    ratio = drive.crank_radius / length
    steep = row[21] != 0.0 and math.sqrt((1.0 - ratio) * (1.0 + ratio)) <= _SLOW
    if pushed >= _CLEAR * critical or _is_level(force) or steep:
        return LEFT, edges, states
    error, straight = max(_relative(of_pushed, pushed), _relative(of_pulled, pulled)), False
    if row[18] == 0.0 and compliance == 0.0 and _is_convex(lines, parabola):
        straight = True
        error = max(error, _along_straight(edges, rule, states, strip, row, lines, parabola, tolerance, out))
    side, of_side = magnitude_of(edges, rule, states[SIDE], tolerance)
    moment, of_moment = magnitude_of(edges, rule, states[MOMENT], tolerance)
    error = max(error, _relative(of_side, side), _relative(of_moment, moment))
    if row[21] != 0.0:
        less, more = couples_of(strip, states), couples_of(strip, states)
        for i in range(less.size):
            less[i], more[i] = states[SIDE, i] - less[i], states[SIDE, i] + more[i]
        one, of_one = magnitude_of(edges, rule, more, tolerance)
        other, of_other = magnitude_of(edges, rule, less, tolerance)
        most, of_most = greater(one, of_one, other, of_other)
        power, of_power = friction_power(drive, strip, edges, rule, states, coefficient, fine, coarse)
        error = max(error, _relative(of_most, most), of_power)
        out[14], out[15] = most, power
    # A finer turn is the single check's.
    if not error <= accuracy:
        return LEFT, edges, states
    if pushed > 0.0:
        error = max(error, _LAST_DIGITS / (1.0 - pushed / critical))
    mean = 0.5 * (pulled - pushed)
    if critical + mean > 0.0:
        error = max(error, 0.5 * (of_pulled + of_pushed) / (critical + mean))
    out[1], out[2], out[3] = critical, pushed, pulled
    out[4] = frequency_under(energies, stiffness, row[10] * b * h, l, length, mean)
    out[11], out[12], out[16], out[17] = side, moment, max(error, _ROUNDING), force.size
    return WHOLE if straight else TURN_ALONE, edges, states


@kernel
def _is_level(force: Array) -> bool:
    same = True
    for i in range(force.size):
        same = same and force[i] == force[0]
    return same


@kernel
def _relative(error: float, value: float) -> float:
    return error / abs(value) if value != 0.0 else 0.0


@kernel
def _is_convex(lines: Array, parabola: Array) -> bool:
    """Whether the utilisation is convex in the greatest and falls, convex, with the least stress."""
    convex = parabola[0] == 0.0 and lines.shape[1] == 1
    for c in range(lines.shape[0]):
        convex = convex and abs(lines[c, 0, 1]) <= lines[c, 0, 0] * (1.0 + _CONVEX)
    return convex


@kernel
def _along_straight(
    edges: Array, rule: Rule, states: Array, strip: Strip, row: Array, lines: Array, parabola: Array, tolerance: float,
    out: Array,
) -> float:  # fmt: skip
    """Stresses and deflection in plain bending into ``out``; the greatest relative error."""
    n, l = states.shape[1], strip.length
    bent, turned, sunk, stress = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    direct, bending = 1.0 / (row[12] * row[13]), 0.5 * row[9] * row[13]
    best, most, of_best, of_most, amplitude_error = -1.0, 0.0, 0.0, 0.0, 0.0
    used, of_used = np.empty(4), np.empty(4)
    for k in range(4):
        layer, z = k // 2, k % 2 * l
        bend(states[COUPLING], states[CLAMP], states[SHEAR], states[HEAD], l, z, bent, turned, sunk)
        for i in range(n):
            stress[i] = direct * states[FORCE, i] + (1.0 - 2.0 * layer) * bending * bent[i]
        high, of_high = top_of(edges, rule, stress, 1.0, 0.01 * tolerance)
        low, of_low = top_of(edges, rule, stress, -1.0, 0.01 * tolerance)
        low = -low
        used[k] = utilisation_of(high, low, lines, parabola)
        of_used[k] = utilisation_of(high + of_high, low - of_low, lines, parabola) - used[k]
        if used[k] > best:
            best, of_best = used[k], of_used[k]
            out[5], out[7], out[8], out[9], out[10] = used[k], high, low, z, layer
            amplitude_error = _relative(of_high + of_low, 0.5 * (high - low))
        if high > most or -low > most:
            most, of_most = max(high, -low), max(of_high, of_low)
    for k in range(4):
        of_best = max(of_best, used[k] + of_used[k] - best)
    out[6] = most
    stroke, of_stroke = magnitude_of(edges, rule, states[STROKE], 0.01 * tolerance)
    deflection, of_deflection = _most_sunk(strip, stroke, tolerance)
    out[13] = deflection
    missed = max(_relative(of_best, best), _relative(of_most, most), amplitude_error)
    return max(missed, _relative(of_deflection, deflection), _relative(of_stroke, stroke))


@kernel
def _most_sunk(strip: Strip, stroke: float, tolerance: float) -> tuple[float, float]:
    """The greatest |V| [m] along a strip that no axial force bends, at a stroke [m], and what may be missing."""
    state, l = np.empty((10, 1)), strip.length
    bend_state(strip, 0.0, stroke, state, 0)
    q, clamp, shear, head = state[COUPLING], state[CLAMP], state[SHEAR], state[HEAD]
    bent, turned, sunk = np.empty(1), np.empty(1), np.empty(1)
    row, step, top = np.empty(STATIONS), l / (STATIONS - 1), 0.0
    for j in range(STATIONS):
        bend(q, clamp, shear, head, l, l * j / (STATIONS - 1), bent, turned, sunk)
        row[j] = abs(sunk[0])
        top = max(top, row[j])
    place, value, points, heights = np.empty(3), np.empty(3), np.empty(5), np.empty(5)
    found, missing = 0.0, 0.0
    for j in range(STATIONS):
        before, here, after = row[abs(j - 1)], row[j], row[j + 1 if j < STATIONS - 1 else j - 1]
        reach = here + 0.5 * abs(before - 2.0 * here + after)
        if (j > 0 and here <= before) or here < after or reach < (1.0 - NEARLY) * top:
            continue
        low, high = max(j - 1, 0), min(j + 1, STATIONS - 1)
        place[0], place[1], place[2] = step * low, step * j, step * high
        value[0], value[1], value[2] = row[low], here, row[high]
        error = np.inf
        for _ in range(MOST_ROUNDS):
            trial_points(place, value, points)
            for m in range(5):
                bend(q, clamp, shear, head, l, points[m], bent, turned, sunk)
                heights[m] = abs(sunk[0])
            error = narrow(place, value, points, heights)
            top = max(top, value[1])
            if error <= tolerance * top or place[2] - place[0] <= _EPS * l:
                break
        if value[1] > found:
            found, missing = value[1], error
    return found, missing
