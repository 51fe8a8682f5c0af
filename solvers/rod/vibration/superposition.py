"""The motion from the element solutions (``revolution``) and the initial states of the panels, with its errors in time
and along the strip."""

from __future__ import annotations

import math

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.radau import Radau
from solvers.rod.cycle.state import MOMENT, SIDE
from solvers.rod.vibration.equation import StripEquation
from solvers.rod.vibration.revolution import Revolution

_DAMPED_MARGIN = 2.0
"""Safety factor on the error estimate of the polynomials along the strip with modal damping, where their coefficients
decrease only algebraically."""


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
