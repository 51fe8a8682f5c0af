"""The periodic motion under a load with many corners in adiabatic modes: a tenth of the time of ``motion``, with an
error of about a hundredth of the vibration.

In the strip's modes w_n under the instantaneous force (``adiabatic_modes``), d = sum_n w_n q_n, each coordinate is an
oscillator of its own,

    q_n'' + eta omega_0n q_n' + omega_n^2(phi) q_n = w_n . (s f0 - M c'') - sum_m w_n M (2 w_m' q_m' + w_m'' q_m)

with omega_0n the frequency under the mean force, and M, c, s, f0 of ``equation``. The last sum couples the modes by
their rate of change; only the part of the first mode in the others is kept. The first mode is solved by Radau
collocation on every element. The others follow quasi-statically what drives them, linear on an element, and ring behind
its ends, where that jumps in value or slope, with a phase of the integral of omega_n and an amplitude proportional to
omega_n^(-1/2) (WKB).

Validity: elements over which the first mode turns by no more than about three radians, and which are not so narrow that
derivatives lose all digits; no jumps of the force itself.

Source: for the coupling, M. Born, V. Fock (1928); for the collocation, ``solvers.numerics.radau``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solvers.numerics.arrays import Array, Complex
from solvers.numerics.jit import fusing_kernel, kernel
from solvers.numerics.radau import Radau
from solvers.numerics.ripple import Ripple, ripple_of
from solvers.rod.cycle.state import LATERAL, MOMENT, SIDE
from solvers.rod.vibration.adiabatic_modes import adiabatic_modes
from solvers.rod.vibration.equation import StripEquation, quasi_static
from solvers.rod.vibration.excitation import Excitation
from solvers.rod.vibration.motion import Errors, Motion

_ERROR = 0.01
"""Assumed error as a share of the vibration: 2.5e-3 in the median of 48 strips, 1.8e-2 at the 90th percentile."""
_OMITTED, _MOST_RINGING = 0.2, 4
"""Share of the error that modes may cause whose ringing is omitted; largest number of ringing modes."""


def adiabatic_motion(
    equation: StripEquation, excitation: Excitation, edges: Array, tolerance: float, resolved: Motion | None = None
) -> Motion:
    """The motion on elements between ``edges``, which include those of the excitation. As many modes ring as change V''
    or V''' by more than the tolerance, or than a part of the error; or as in the motion of a neighbouring strip that is
    ``resolved``, whose errors are assumed."""
    rule, states = excitation.rule, excitation.states_on(edges, excitation.rule)
    fluctuation, static, _ = quasi_static(equation, states)
    shape = edges.size - 1, rule.points.size
    known = fluctuation.reshape(shape), static.reshape(*shape, -1), states[LATERAL].reshape(shape)
    if resolved is None:
        found = coordinates_of(equation, rule, edges, *known, equation.masses.size - 1)
        ringing, errors = _resolution(equation, found, states, tolerance)
    else:
        ringing, errors = resolved.ringing.modes, resolved.errors
        found = coordinates_of(equation, rule, edges, *known, ringing)
    return Motion(
        equation.strip, equation.basis, edges, _samples(equation, found),
        _ripple(equation, rule, edges, found, ringing), errors, amplification=1.0, slow=1,
        highest_frequency=float(found.frequency[:, :, 0].max()), phase_tolerances=np.empty(0), rule=rule,
    )  # fmt: skip


def _resolution(equation: StripEquation, found: Coordinates, states: Array, tolerance: float) -> tuple[int, Errors]:
    """The number of modes that ring, and the errors without the others."""
    greatest = np.abs(states[[MOMENT, SIDE]]).max(axis=1) / equation.strip.stiffness
    shares, size = _shares(equation, found, greatest)
    omitted = np.append(np.cumsum(shares[:0:-1])[::-1], 0.0)
    ringing = min(int(np.argmax(omitted <= max(tolerance, _OMITTED * _ERROR * size))), _MOST_RINGING)
    errors = Errors(
        series=_ERROR * size, space=0.0, omitted=float(omitted[ringing]), mean_omitted=0.0, phase=0.0, excited=0.0,
        time=np.zeros(found.ringing.shape[0]), mean_time=0.0, rounding=0.0,
    )  # fmt: skip
    return ringing, errors


class Coordinates(NamedTuple):
    """Adiabatic coordinates on all elements.

    frequency   omega_n at the points (elements, points, n)
    modes       columns w_n at the points (elements, points, n, n)
    smooth      q_n without ringing (elements, points, n)
    phase       of the ringing from an element's start (elements, points, modes), with the damping as its real part
    ringing     its amplitude omega_n^(1/2) q_n at the starts of elements (elements, modes)

    The modes that ring are those behind the first.
    """

    frequency: Array
    modes: Array
    smooth: Array
    phase: Complex
    ringing: Complex


@fusing_kernel
def coordinates_of(
    equation: StripEquation, rule: Radau, edges: Array, fluctuation: Array, static: Array, lateral: Array, ringing: int
) -> Coordinates:
    """Solve all oscillators from F (elements, points), c (elements, points, n) and s (elements, points); ``ringing``
    modes ring."""
    count, p, n = static.shape
    frequencies, shapes = adiabatic_modes(equation, fluctuation.ravel())
    frequency, modes, load = frequencies.reshape(count, p, n), shapes.reshape(count, p, n, n), np.zeros((count, p, n))
    slopes, smooth = np.zeros((count, 2, n)), np.zeros((count, p, n))
    phase, amplitude = np.zeros((count, p, ringing), np.complex128), np.zeros((count, ringing), np.complex128)
    first, second, driving = np.empty((p, n)), np.empty((p, n)), np.empty(n)
    decay = 0.5 * equation.loss / np.sqrt(equation.masses)
    for e in range(count):
        h = edges[e + 1] - edges[e]
        np.dot(rule.first, static[e], first)
        np.dot(rule.second, static[e], second)
        for i in range(p):
            for a in range(n):
                driving[a] = lateral[e, i] * equation.inertial_load[a] - equation.masses[a] * second[i, a] / (h * h)
            for a in range(n):
                for k in range(n):
                    load[e, i, k] += modes[e, i, a, k] * driving[a]
        for end in range(2):
            i = 0 if end == 0 else p - 1
            for a in range(n):
                for k in range(n):
                    slopes[e, end, k] += modes[e, i, a, k] * equation.masses[a] * first[i, a] / h
        for i in range(p):
            for r in range(ringing):
                angle = 0.0
                for j in range(p):
                    angle += rule.integral[i, j] * frequency[e, j, r + 1]
                phase[e, i, r] = h * (1j * angle - decay[r + 1] * rule.points[i])
    ends = _collocated(decay[0], rule, edges, frequency, load, slopes, smooth)
    _drive_others(equation, rule, edges, fluctuation, frequency, modes, ends, load)
    for e in range(count):
        for k in range(1, n):
            start, end = load[e, 0, k] / frequency[e, 0, k] ** 2, load[e, p - 1, k] / frequency[e, p - 1, k] ** 2
            for i in range(p):
                smooth[e, i, k] = start + rule.points[i] * (end - start)
    for r in range(ringing):
        own = r + 1
        _ringing(edges, frequency[:, 0, own], smooth[:, :, own], slopes[:, :, own], phase[:, -1, r], amplitude[:, r])
    return Coordinates(frequency, modes, smooth, phase, amplitude)


@fusing_kernel
def _collocated(
    decay: float, rule: Radau, edges: Array, frequency: Array, load: Array, slopes: Array, smooth: Array
) -> Array:
    """Write the first coordinate to ``smooth``; return its values and slopes at the two ends of elements (elements, 2,
    2). With u = exp(decay phi) q the equation has no damping. At the ends of elements c' may jump, and q' by the
    opposite."""
    count, p = frequency.shape[:2]
    s = p - 1
    matrix, columns = np.empty((s, s)), np.empty((s, 3))
    stages, maps, ends = np.empty((count, 3, s)), np.empty((count, 3, 2)), np.empty((count, 2, 2))
    growth, square = np.empty(s), np.empty(s)
    for e in range(count):
        h = edges[e + 1] - edges[e]
        for i in range(s):
            growth[i] = math.exp(decay * h * rule.points[i + 1])
            square[i] = frequency[e, i + 1, 0] ** 2 - decay * decay
        for i in range(s):
            columns[i, 0], columns[i, 1], columns[i, 2] = 1.0, h * rule.points[i + 1], 0.0
            for j in range(s):
                integral = h * h * rule.double_integral[i, j]
                matrix[i, j] = integral * square[j] + (1.0 if i == j else 0.0)
                columns[i, 2] += integral * growth[j] * load[e, j + 1, 0]
        _eliminate(matrix, columns)
        following = e + 1 if e + 1 < count else 0
        for c in range(3):
            slope = 1.0 if c == 1 else 0.0
            for j in range(s):
                acceleration = (growth[j] * load[e, j + 1, 0] if c == 2 else 0.0) - square[j] * columns[j, c]
                slope += h * rule.single_integral[s - 1, j] * acceleration
                stages[e, c, j] = columns[j, c] / growth[j]
            maps[e, c, 0], maps[e, c, 1] = columns[s - 1, c] / growth[s - 1], slope / growth[s - 1]
        maps[e, 2, 1] += slopes[e, 1, 0] - slopes[following, 0, 0]
    value, slope = _periodic_state(maps)
    for e in range(count):
        smooth[e, 0, 0] = value
        for i in range(s):
            smooth[e, i + 1, 0] = value * stages[e, 0, i] + slope * stages[e, 1, i] + stages[e, 2, i]
        ends[e, 0, 0], ends[e, 0, 1] = value, slope - decay * value
        value, slope = (
            value * maps[e, 0, 0] + slope * maps[e, 1, 0] + maps[e, 2, 0],
            value * maps[e, 0, 1] + slope * maps[e, 1, 1] + maps[e, 2, 1],
        )
        following = e + 1 if e + 1 < count else 0
        ends[e, 1, 0] = value
        ends[e, 1, 1] = slope - decay * value - slopes[e, 1, 0] + slopes[following, 0, 0]
    return ends


@fusing_kernel
def _eliminate(matrix: Array, columns: Array) -> None:
    """Overwrite the columns by the solutions, without pivoting: the matrix is the identity plus integrals over an
    element of less than half a period."""
    n, m = columns.shape
    for k in range(n):
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            for j in range(k + 1, n):
                matrix[i, j] -= factor * matrix[k, j]
            for c in range(m):
                columns[i, c] -= factor * columns[k, c]
    for k in range(n - 1, -1, -1):
        for c in range(m):
            for j in range(k + 1, n):
                columns[k, c] -= matrix[k, j] * columns[j, c]
            columns[k, c] /= matrix[k, k]


@kernel
def _periodic_state(maps: Array) -> tuple[float, float]:
    """Value and slope at the start that recur after all affine maps (elements, 3, 2), constant terms last."""
    total, before = np.zeros((3, 2)), np.zeros((3, 2))
    total[0, 0], total[1, 1] = 1.0, 1.0
    for e in range(maps.shape[0]):
        before[:] = total
        for c in range(3):
            for i in range(2):
                total[c, i] = before[c, 0] * maps[e, 0, i] + before[c, 1] * maps[e, 1, i]
                total[c, i] += maps[e, 2, i] if c == 2 else 0.0
    determinant = (1.0 - total[0, 0]) * (1.0 - total[1, 1]) - total[0, 1] * total[1, 0]
    value = (total[2, 0] * (1.0 - total[1, 1]) + total[2, 1] * total[1, 0]) / determinant
    slope = (total[2, 1] * (1.0 - total[0, 0]) + total[2, 0] * total[0, 1]) / determinant
    return value, slope


@fusing_kernel
def _drive_others(
    equation: StripEquation, rule: Radau, edges: Array, fluctuation: Array, frequency: Array, modes: Array, ends: Array,
    load: Array,
) -> None:  # fmt: skip
    """Add to the ``load`` of the other modes at the ends of elements what the first one's rate of change contributes:
    w_k M w_1' = F' w_k G w_1/(omega_1^2 - omega_k^2), and F'' instead of F' for w_1''."""
    (count, p, n), turned = frequency.shape, np.empty(frequency.shape[2])
    for e in range(count):
        h = edges[e + 1] - edges[e]
        for end in range(2):
            i, slope, curvature = (0 if end == 0 else p - 1), 0.0, 0.0
            for j in range(p):
                slope += rule.first[i, j] * fluctuation[e, j] / h
                curvature += rule.second[i, j] * fluctuation[e, j] / (h * h)
            for a in range(n):
                turned[a] = 0.0
                for b in range(n):
                    turned[a] += equation.geometric[a, b] * modes[e, i, b, 0]
            driving = 2.0 * slope * ends[e, end, 1] + curvature * ends[e, end, 0]
            for k in range(1, n):
                coupling = 0.0
                for a in range(n):
                    coupling += modes[e, i, a, k] * turned[a]
                load[e, i, k] -= coupling * driving / (frequency[e, i, 0] ** 2 - frequency[e, i, k] ** 2)


@fusing_kernel
def _ringing(
    edges: Array, frequency: Array, smooth: Array, slopes: Array, advance: Complex, amplitude: Complex
) -> None:
    """Write the ringing of one coordinate at the starts of elements to ``amplitude``.

    What jumps there of the coordinate without ringing (elements, points), and of its slope including that of c
    (elements, 2), continues as ringing, which from one start to the next is multiplied by exp(``advance``).
    """
    count, last = smooth.shape[0], smooth.shape[1] - 1
    total, growth, previous = 0.0j, 1.0 + 0.0j, count - 1
    for sweep in range(2):
        for e in range(count):
            jump = smooth[previous, last] - smooth[e, 0]
            bend = (smooth[previous, last] - smooth[previous, 0]) / (edges[previous + 1] - edges[previous])
            bend += slopes[previous, 1] - (smooth[e, last] - smooth[e, 0]) / (edges[e + 1] - edges[e]) - slopes[e, 0]
            total += (jump - 1j * bend / frequency[e]) * math.sqrt(frequency[e])
            amplitude[e] = total
            factor = np.exp(advance[e])
            total, growth, previous = total * factor, growth * factor, e
        if sweep == 0:
            total = total / (1.0 - growth)


@kernel
def _samples(equation: StripEquation, found: Coordinates) -> Array:
    """d without ringing in amplitudes of the basis (elements, points, basis)."""
    count, p, n = found.smooth.shape
    modal = np.zeros((count * p, n))
    for e in range(count):
        for i in range(p):
            for a in range(n):
                for k in range(n):
                    modal[e * p + i, a] += found.modes[e, i, a, k] * found.smooth[e, i, k]
    return np.dot(modal, equation.modes.T).reshape(count, p, equation.modes.shape[0])


@kernel
def _ripple(equation: StripEquation, rule: Radau, edges: Array, found: Coordinates, ringing: int) -> Ripple:
    """The ringing of the modes behind the first, as many as ``ringing``, in amplitudes of the basis."""
    count, p, n = found.smooth.shape
    start, phase = np.empty((count, ringing), np.complex128), np.empty((count, ringing, p), np.complex128)
    real, shape = np.empty((count * ringing * p, n)), np.zeros((count, ringing, p, 2, equation.modes.shape[0]))
    for e in range(count):
        for r in range(ringing):
            start[e, r] = found.ringing[e, r]
            for i in range(p):
                phase[e, r, i] = found.phase[e, i, r]
                size = 1.0 / math.sqrt(found.frequency[e, i, r + 1])
                for a in range(n):
                    real[(e * ringing + r) * p + i, a] = size * found.modes[e, i, a, r + 1]
    shape[:, :, :, 0] = np.dot(real, equation.modes.T).reshape(count, ringing, p, equation.modes.shape[0])
    return ripple_of(edges, start, phase, shape, rule)


@kernel
def _shares(equation: StripEquation, found: Coordinates, greatest: Array) -> tuple[Array, float]:
    """Largest ringing of every mode (n,), all of which but the first ring, and largest d without ringing, as fractions
    of the ``greatest`` V'' and V''' at the clamp, whichever is affected more."""
    count, p, n = found.smooth.shape
    shares, size = np.zeros(n), 0.0
    for e in range(count):
        for i in range(p):
            for q in range(2):
                total = 0.0
                for k in range(n):
                    output = 0.0
                    for a in range(n):
                        output += equation.clamp[q, a] * found.modes[e, i, a, k]
                    total += output * found.smooth[e, i, k]
                    if i == 0 and k > 0:
                        amplitude = abs(found.ringing[e, k - 1]) / math.sqrt(found.frequency[e, 0, k])
                        shares[k] = max(shares[k], abs(output) * amplitude / greatest[q])
                size = max(size, abs(total) / greatest[q])
    return shares, size
