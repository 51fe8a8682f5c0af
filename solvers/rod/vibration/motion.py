"""The strip's periodic motion at a given resolution, with estimates of its errors (see ``revolution`` for the
method)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.periodic import TURN
from solvers.numerics.radau import Radau, interpolation_weights, radau
from solvers.numerics.ripple import Ripple, no_ripple, parts_at
from solvers.rod.cycle.state import FORCE, MOMENT, SIDE, Strip
from solvers.rod.vibration.equation import SOFTEST, StripEquation, quasi_static
from solvers.rod.vibration.excitation import MANY, RULE, Excitation, Smoothness, split
from solvers.rod.vibration.natural_frequencies import StripBasis
from solvers.rod.vibration.omitted import choose_ringing, error_of_means, omission_errors
from solvers.rod.vibration.revolution import Revolution, assemble, periodic_solution
from solvers.rod.vibration.ringing import (
    estimate_ringing,
    free_modes,
    periodic_amplification,
    phases_of,
    ringing_of,
)

MOST_RINGING = 16
"""Largest number of ringing modes."""

NARROW = 3.0
"""Phase advance of a mode over an element [rad] below which a series in derivatives loses digits."""
_DAMPED_MARGIN = 2.0
"""Safety factor on the error estimate of the polynomials along the strip with modal damping, where their coefficients
decrease only algebraically."""
_ROUNDING = 1e-15
EXPONENT = 1.5
"""Safety factor on the exponent of ``excited_ringing``."""
_RULE_FOR_MANY = radau(5)
"""Rule for the phases and shapes of ringing modes on many narrow elements: they vary with the force only, and six
points have always been enough."""
_DECAY, _DECAY_BEHIND_JUMPS = 4.0, 2.0
"""Exponents with which ringing amplitudes in V''' decrease with the mode number, behind corners and behind jumps of the
force."""
_NO_FREE_STATES = np.empty((0, 0, 0))


@dataclass(frozen=True)
class Errors:
    """Estimated errors of a motion, as fractions of the greatest V'' or V''' at the clamp, whichever is affected more.

    series        truncation of the series of the fast modes
    space         truncation of the polynomials along the strip
    omitted       modes whose ringing is omitted: in greatest values and, ``mean_omitted``, in means over the revolution
    phase         phase errors of the ringing modes
    excited       ringing excited by the smooth force between corners
    time          discretization in time, of every element (elements,), and, ``mean_time``, its mean over the revolution
    rounding      rounding errors, amplified by the periodicity condition
    """

    series: float
    space: float
    omitted: float
    mean_omitted: float
    phase: float
    excited: float
    time: Array
    mean_time: float
    rounding: float

    @property
    def elements(self) -> float:
        """Discretization error of all elements: independent errors, added in squares."""
        return float(np.sqrt(np.sum(self.time**2)))

    @property
    def total(self) -> float:
        return self.series + self.space + self.rounding + self.omitted + self._oscillating

    @property
    def _oscillating(self) -> float:
        """Errors that oscillate at the frequency of the slowest mode or faster."""
        return self.phase + self.excited + self.elements

    def of_mean(self, remainder: float) -> float:
        """Error of a mean over the revolution, in which the fraction ``remainder`` of oscillating errors remains."""
        steady = self.series + self.space + self.rounding + self.mean_time + self.mean_omitted
        return steady + remainder * self._oscillating


@dataclass(frozen=True)
class Motion:
    """The dynamic part d of the motion, i.e. its difference from the quasi-static shape.

    samples            amplitudes of the basis (elements, points, basis), on ``edges`` at the points of ``rule``
    ringing            free vibration of fast modes, in closed form
    amplification      of an error made in one revolution by the periodicity condition, 1/sigma_min(I - M)
    slow               number of slow modes
    highest_frequency  of the last slow mode [1/rad]
    phase_tolerances   admissible phase errors of the ringing modes per element [rad], (ringing,)
    """

    strip: Strip
    basis: StripBasis
    edges: Array
    samples: Array
    ringing: Ripple
    errors: Errors
    amplification: float
    slow: int
    highest_frequency: float
    phase_tolerances: Array
    rule: Radau = RULE

    @property
    def without_ringing(self) -> Motion:
        """This motion without its ringing: discontinuous at corners."""
        return replace(self, ringing=no_ripple(self.samples.shape[2], self.rule))

    def at(self, angle: Array) -> Array:
        """d in amplitudes of the basis at the angles: (basis, angles)."""
        return amplitudes(self.edges, self.samples, self.rule, self.ringing, angle)


def motion(equation: StripEquation, excitation: Excitation, slow: int, step: float, tolerance: float) -> Motion:
    """Compute the periodic motion with a number of ``slow`` modes, on elements over which the phase of the fastest of
    them advances by at most ``step`` [rad]. Series and ringing are truncated according to ``tolerance``."""
    m, modes, corners = slow, equation.masses.size, excitation.corners.size > 0
    edges, frequency = _elements(equation, excitation, m, step)
    states = excitation.states_on(edges, RULE)
    revolution = assemble(
        equation, RULE, *quasi_static(equation, states), edges, excitation.panels(edges), m, tolerance
    )
    initial, _, amplification = periodic_solution(revolution, _NO_FREE_STATES, _NO_FREE_STATES)

    ringing, mode_amplification, phase_tolerances = no_ripple(modes, RULE), np.ones(modes - m), np.empty(0)
    omitted = mean_omitted = phase_error = 0.0
    excited_smoothly = excited_ringing(equation, excitation, m + 1) if m < modes else 0.0
    if m < modes and not corners:
        excited_smoothly *= periodic_amplification(equation, phases_of(equation, RULE, edges, states, m), m)[0]
    if corners:
        static = np.abs(states[[MOMENT, SIDE]]).max(axis=1) / equation.strip.stiffness
        coarse_edges = excitation.edges
        ringing_rule = _RULE_FOR_MANY if coarse_edges.size > MANY else RULE
        coarse_states, panels = excitation.states_on(coarse_edges, ringing_rule), excitation.panels(coarse_edges)
        forces = excitation.states[FORCE, panels * RULE.points.size]
        mode_amplification, ringing_shares, excited = estimate_ringing(
            equation, revolution, initial, ringing_rule, coarse_edges, panels, coarse_states, forces, static
        )
        decay = _DECAY_BEHIND_JUMPS if excitation.jumps.size else _DECAY
        count, omitted = choose_ringing(ringing_shares.max(axis=(0, 1)), m, decay, MOST_RINGING, tolerance)
        mean_omitted = error_of_means(equation, ringing_shares, m, decay, count) if omitted else 0.0
        if count:
            sensitivity = np.maximum(excited * mode_amplification**2, 1e-300)[:count]
            phase_tolerances = np.minimum(1e-1 * tolerance / sensitivity / revolution.widths.size, 1e-3)
            free = free_modes(equation, ringing_rule, coarse_edges, panels, coarse_states, m, phase_tolerances)
            initial, complex_amplitudes, amplification = periodic_solution(revolution, free.start, free.end)
            ringing = ringing_of(free, equation.modes, complex_amplitudes, ringing_rule)
            share = np.max(np.abs(equation.clamp[:, m : m + count]) / static[:, None], axis=0)
            largest = np.abs(complex_amplitudes).max(axis=0)
            phase_error = float(largest * share @ free.phase_errors) * max(amplification, 1.0)

    samples, series, space, time = evaluate(revolution, equation, RULE, states, initial, mode_amplification, corners)
    if omitted > 0.5 * tolerance and excitation.corners.size < MANY:
        omitted, mean_omitted = omission_errors(
            equation, excitation, RULE, edges, states, samples, ringing_shares, static, m, decay, count
        )
    errors = Errors(
        series=series,
        space=space,
        omitted=omitted,
        mean_omitted=mean_omitted,
        phase=phase_error,
        excited=excited_smoothly,
        time=time,
        mean_time=float(time @ revolution.widths) / TURN,
        rounding=_ROUNDING * amplification,
    )
    return Motion(
        equation.strip, equation.basis, edges, samples, ringing, errors, amplification, m, frequency, phase_tolerances
    )


def _elements(equation: StripEquation, excitation: Excitation, slow: int, step: float) -> tuple[Array, float]:
    """Edges of elements over which the phase of the fastest slow mode advances by at most ``step`` [rad], and the
    highest natural frequency of that mode [1/rad]."""
    if not slow:
        return excitation.edges, 0.0
    frequency = equation.frequency_of(slow, equation.strip.couples * excitation.smoothness.greatest - equation.mean)
    return split(excitation.edges, step / frequency), float(frequency.max())


def neighbouring_motion(
    found: Motion, found_excitation: Excitation, excitation: Excitation, loss: float, tolerance: float
) -> Motion:
    """The motion of a neighbouring strip at the resolution of one that was ``found`` with ``found_excitation``: the
    same numbers of modes, on elements that move with the corners (``Excitation.neighbour``). Its errors are assumed to
    be the same."""
    m = found.slow
    equation = StripEquation.of(excitation.strip, excitation.inertia, excitation.mean, found.basis.polynomials, loss)
    edges = np.interp(found.edges, found_excitation.anchors, excitation.anchors)
    states = excitation.states_on(edges, RULE)
    revolution = assemble(
        equation, RULE, *quasi_static(equation, states), edges, found_excitation.panels(found.edges), m, tolerance
    )
    ringing, free_start, free_end = found.ringing, _NO_FREE_STATES, _NO_FREE_STATES
    if found.phase_tolerances.size:
        ringing_rule, panels = radau(ringing.points.size - 1), found_excitation.panels(found_excitation.edges)
        coarse_edges, coarse_states = excitation.edges, excitation.states_on(excitation.edges, ringing_rule)
        free = free_modes(equation, ringing_rule, coarse_edges, panels, coarse_states, m, found.phase_tolerances)
        free_start, free_end = free.start, free.end
    initial, complex_amplitudes, amplification = periodic_solution(revolution, free_start, free_end)
    if found.phase_tolerances.size:
        ringing = ringing_of(free, equation.modes, complex_amplitudes, ringing_rule)
    return replace(
        found, strip=excitation.strip, basis=equation.basis, edges=edges, ringing=ringing, amplification=amplification,
        samples=superpose(revolution, equation, initial)[0],
    )  # fmt: skip


def excited_ringing(equation: StripEquation, excitation: Excitation, n: int) -> float:
    """Ringing of mode number n excited between corners, relative to a corner's and before it is amplified by the
    periodicity condition: about exp(-omega y) with y the distance of analyticity (``excitation``), with a safety factor
    on the exponent."""
    analytic, _, _ = least_phases(equation, excitation.edges, excitation.smoothness)
    return math.exp(-analytic[n - 1] / EXPONENT)


@kernel
def least_phases(equation: StripEquation, edges: Array, force: Smoothness) -> tuple[Array, Array, Array]:
    """Least phase advances [rad] of every mode, uncoupled, under the greatest compression of each element: within the
    distance of analyticity from the real axis; over the element's width; and, if the latter is less than ``NARROW``,
    over the scale on which the excitation changes, the square root of its greatest value over its second derivative."""
    n = equation.masses.size
    analytic, narrow, changing = np.full(n, np.inf), np.full(n, np.inf), np.full(n, np.inf)
    for k in range(n):
        for e in range(force.least.size):
            fluctuation = equation.strip.couples * force.least[e] - equation.mean
            stiffness = max(1.0 + fluctuation * equation.geometric[k, k], SOFTEST)
            frequency = math.sqrt(stiffness / equation.masses[k])
            analytic[k] = min(analytic[k], frequency * force.analytic[e])
            phase = frequency * (edges[e + 1] - edges[e])
            narrow[k] = min(narrow[k], phase)
            if phase < NARROW:
                changing[k] = min(changing[k], frequency / math.sqrt(max(force.curvature[e], 1e-300)))
    return analytic, narrow, changing


@kernel
def superpose(revolution: Revolution, equation: StripEquation, initial: Array) -> tuple[Array, Array, Array, Array]:
    """Superpose the element solutions for the panels' initial states (panels, 2 m).

    Returns d in amplitudes of the basis (elements, points, basis); the total motion in the modes (elements, points,
    modes); the fast modes' speeds sqrt(mu) a' at an element's two ends (2 elements, fast); and the elements' initial
    states, and 1, (elements, 2 m + 1).
    """
    m, n, count, p = revolution.slow, equation.masses.size, revolution.widths.size, revolution.static.shape[1]
    fast, columns = n - m, 2 * m + 1
    element_initial, panel = np.zeros((count, columns)), -1
    coordinates, speeds = np.zeros((count * p, n)), np.zeros((count * 2, fast))
    for e in range(count):
        if panel + 1 < revolution.first.size and revolution.first[panel + 1] == e:
            panel += 1
        element_initial[e, 2 * m] = 1.0
        for c in range(columns):
            factor = initial[panel, c] if c < 2 * m else 1.0
            for a in range(2 * m):
                element_initial[e, a] += factor * revolution.transfer[e, c, a]
        for c in range(columns):
            factor = element_initial[e, c]
            for i in range(p):
                for a in range(n):
                    coordinates[e * p + i, a] += factor * revolution.solutions[e, i, c, a]
            for end in range(2):
                for k in range(fast):
                    speeds[2 * e + end, k] += factor * revolution.speeds[e, end, c, k]
    if fast > 0:
        fast_amplitudes = np.dot(np.ascontiguousarray(coordinates[:, m:]), revolution.fast_vectors.T)
        fast_speeds = np.dot(speeds, revolution.fast_vectors.T)
        for i in range(count * p):
            for k in range(fast):
                coordinates[i, m + k] = fast_amplitudes[i, k]
        for i in range(2 * count):
            for k in range(fast):
                speeds[i, k] = fast_speeds[i, k] * math.sqrt(equation.masses[m + k])
    total = coordinates.reshape(count, p, n)
    samples = np.dot((total - revolution.static).reshape(count * p, n), equation.modes.T)
    return samples.reshape(count, p, n), total, speeds, element_initial


@kernel
def evaluate(
    revolution: Revolution, equation: StripEquation, rule: Radau, states: Array, initial: Array,
    mode_amplification: Array, corners: bool,
) -> tuple[Array, float, float, Array]:  # fmt: skip
    """The result d of ``superpose``, the errors of the series and of the polynomials along the strip (``Errors``), and
    the time error of every element, from the panels' initial states (panels, 2 m) and the amplification of every fast
    mode's ringing by the periodicity condition."""
    m, n, p, count = revolution.slow, equation.masses.size, rule.points.size, revolution.widths.size
    fast, columns = n - m, 2 * m + 1
    samples, total, speeds, element_initial = superpose(revolution, equation, initial)
    d, output, greatest = total - revolution.static, np.zeros((count, p, 2)), np.full(2, 1e-300)
    for e in range(count):
        for i in range(p):
            for q in range(2):
                for a in range(n):
                    output[e, i, q] += equation.clamp[q, a] * d[e, i, a]
                static = states[MOMENT if q == 0 else SIDE, e * p + i] * (1.0 - 2.0 * q) / equation.strip.stiffness
                greatest[q] = max(greatest[q], abs(static + output[e, i, q]))
    # An error next to a corner excites ringing.
    amplification = np.ones(count)
    for k in range(revolution.first.size if corners and fast > 0 else 0):
        amplification[revolution.first[k]] = mode_amplification[0]
        amplification[revolution.last[k]] = mode_amplification[0]
    time, largest_term, coefficients = np.zeros(count), 0.0, np.zeros((2, rule.tail.shape[0]))
    for e in range(count):
        coefficients[:] = 0.0
        for q in range(2):
            for t in range(rule.tail.shape[0]):
                for i in range(p):
                    coefficients[q, t] += rule.tail[t, i] * output[e, i, q]
            time[e] = max(time[e], _truncation_error(coefficients[q]) / greatest[q])
            for i in range(p):
                term = 0.0
                for c in range(columns):
                    term += element_initial[e, c] * revolution.last_term[e, i, c, q]
                factor = amplification[e] if i == 0 or i == p - 1 else 1.0
                largest_term = max(largest_term, abs(term) / greatest[q] * factor)
    # Jumps of the fast modes between neighbouring elements. At the jump beside a corner they are the ringing itself:
    # the error there is taken from the nearest other element ends, and amplified.
    margin = np.ones((count, fast))
    for k in range(revolution.first.size if corners else 0):
        for a in range(fast):
            margin[revolution.last[k], a] = 0.0
            margin[revolution.first[k], a] *= mode_amplification[a]
    for k in range(revolution.first.size if corners else 0):
        for a in range(fast):
            margin[revolution.last[k] - 1, a] *= mode_amplification[a]
    for e in range(count):
        following = (e + 1) % count
        for k in range(fast):
            share = max(abs(equation.clamp[0, m + k]) / greatest[0], abs(equation.clamp[1, m + k]) / greatest[1])
            jump = math.hypot(
                total[following, 0, m + k] - total[e, p - 1, m + k], speeds[2 * following, k] - speeds[2 * e + 1, k]
            )
            time[e] += margin[e, k] * jump * share
    ratio, space = revolution.ratio, _space_error(equation, samples.reshape(count * p, n), greatest)
    return samples, largest_term * (ratio / (1.0 - ratio) if ratio < 0.5 else 1.0), space, time


@kernel
def _space_error(equation: StripEquation, samples: Array, greatest: Array) -> float:
    """Truncation error of the polynomials along the strip, from amplitudes of the basis (points, basis)."""
    n, space, terms = samples.shape[1], 0.0, np.empty(4)
    largest = np.zeros(n)
    for i in range(samples.shape[0]):
        for a in range(n):
            largest[a] = max(largest[a], abs(samples[i, a]))
    for q in range(2):
        for t in range(4):
            terms[t] = equation.last_terms[q, t] * largest[max(n - 4 + t, 0)]
        space = max(space, _truncation_error(terms) / greatest[q])
    return space * (_DAMPED_MARGIN if equation.loss != 0.0 else 1.0)


@kernel
def _truncation_error(terms: Array) -> float:
    """Truncation error of a series from its last four terms, by the ratio of successive pairs; the terms to come may
    decrease more slowly than these, as where damping begins to count."""
    earlier, later = max(abs(terms[0]), abs(terms[1])), max(abs(terms[2]), abs(terms[3]))
    ratio = min(max(later / max(earlier, 1e-300), 0.1), 0.9)
    return 2.0 * later * ratio / (1.0 - ratio)


@kernel
def amplitudes(edges: Array, samples: Array, rule: Radau, ringing: Ripple, angle: Array) -> Array:
    """Amplitudes (basis, angles) of polynomials (elements, points, basis) on elements over the revolution, plus
    ringing, at the angles."""
    p, basis = samples.shape[1], samples.shape[2]
    out, share, row = parts_at(ringing, angle), np.empty(p), np.empty(basis)
    for i in range(angle.size):
        turns = (angle[i] - edges[0]) / TURN
        place = edges[0] + (turns - np.floor(turns)) * TURN
        e = min(max(np.searchsorted(edges, place, side="right"), 1), edges.size - 1) - 1
        interpolation_weights(rule.points, rule.weights, (place - edges[e]) / (edges[e + 1] - edges[e]), share)
        row[:] = 0.0
        for k in range(p):
            for b in range(basis):
                row[b] += share[k] * samples[e, k, b]
        for b in range(basis):
            out[b, i] += row[b]
    return out
