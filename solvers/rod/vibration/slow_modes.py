"""Slow modes by collocation in time, fast modes by a quasi-static series: the strip's motion over one element.

    M a'' + C a' + (1 + dP(phi) G) a = f(phi),   C diagonal in the modes

in coordinates of which the first m are the slow modes; the others span the fast modes and diagonalize their block of G,
so that their stiffness matrix 1 + dP gamma is diagonal at every angle. Without free vibration, the fast coordinates r
follow force and slow modes: with w = 1/(1 + dP gamma),

    r = w (f_r - dP G_sr' a_s - M_r r'' - C_r r')

The first iterate omits r'' and r', each further one takes them from the one before: a series in powers of (slow/fast
frequency)^2. It is asymptotic and is truncated where its terms cease to decrease. In each iteration the slow modes are
solved by Radau collocation, loaded by the fast ones. All columns of the solution (for unit initial states, and the
particular one for f) are computed at once.

Source: R. J. Guyan (1965); for the series, J. Kevorkian, J. D. Cole, Multiple Scale and Singular Perturbation Methods
(1996), section 4.3; for the collocation, ``solvers.numerics.radau``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.arrays import Array
from solvers.numerics.jit import fusing_kernel, kernel
from solvers.numerics.radau import Radau

_NARROW = 2.0
"""Phase of the slowest fast mode [rad] over an element below which it is narrow: rounding errors grow in derivatives of
its polynomials, most in the speeds at its ends."""


class Partition(NamedTuple):
    """The equation's matrices in the coordinates above, for m slow modes.

    masses          of the slow modes (m,), and their ``damping``, the diagonal of C (m,)
    slow_geometric  slow block of G (m, m)
    coupling        slow-fast block of G (m, fast)
    eigenvalues     gamma, the fast block of G (fast,)
    fast_masses     of the fast coordinates (fast, fast), and their ``fast_damping`` (fast, fast)
    outputs         V'' and V''' at the clamp per unit coordinate (2, m + fast)
    """

    masses: Array
    damping: Array
    slow_geometric: Array
    coupling: Array
    eigenvalues: Array
    fast_masses: Array
    fast_damping: Array
    outputs: Array


@fusing_kernel
def slow_motion(
    widths: Array, fluctuation: Array, forces: Array, partition: Partition, rule: Radau, tolerance: float,
    max_terms: int,
) -> tuple[Array, Array, Array, Array, float]:  # fmt: skip
    """Solve the equation on all elements, from ``fluctuation`` dP (elements, points) and ``forces`` f (elements,
    points, m + fast).

    Returns solutions (elements, points, 2 m + 1, m + fast), columns being those for unit initial states (a, sqrt(mu)
    a') and, last, the particular solution; final states of the slow modes (elements, 2 m + 1, 2 m); speeds of the fast
    coordinates at an element's two ends (elements, 2, 2 m + 1, fast); the series' last term in the outputs (elements,
    points, 2 m + 1, 2), at the ends of narrow elements including the ringing that its speed excites; and the largest
    ratio of its last term to the one before. The series ends where a term is below ``tolerance`` relative to the
    largest output of the first one, after ``max_terms`` terms, or before a term that is larger than its predecessor.

    Arrays on an element are ordered (modes, columns, points), so that every step is a product of small matrices or a
    single pass over contiguous memory.
    """
    count, p, m, fast = widths.size, fluctuation.shape[1], partition.masses.size, partition.eigenvalues.size
    columns, size = 2 * m + 1, m + fast
    wide, last_column = columns * p, (columns - 1) * p
    solutions, element_ends = np.empty((count, p, columns, size)), np.empty((count, columns, 2 * m))
    speeds, last_term = np.empty((count, 2, columns, fast)), np.empty((count, p, columns, 2))
    is_damped, largest_ratio = bool(np.any(partition.fast_damping != 0.0)), 0.0
    # w = 1/(1 + dP gamma), repeated for all columns; and the forces, which act in the last column only
    compliance, fast_load, slow_load = np.empty((fast, wide)), np.zeros((fast, wide)), np.zeros((m, wide))
    # x: slow modes, then fast coordinates; inertia: inertial and damping forces of the latter
    x, accepted, inertia = np.zeros((size, wide)), np.zeros((size, wide)), np.zeros((fast, wide))
    coupled = compliance.copy()
    slow, r, derivatives = x[:m], x[m:], np.empty((2 if is_damped else 1, fast, wide))
    # views for matrix products
    fast_rows, stacked = r.reshape(fast * columns, p), derivatives.reshape(derivatives.shape[0] * fast, wide)
    first_derivative = derivatives[derivatives.shape[0] - 1].reshape(fast * columns, p)
    second_derivative = derivatives[0].reshape(fast * columns, p)
    weights, coupling = np.empty((fast, derivatives.shape[0] * fast)), np.ascontiguousarray(partition.coupling.T)
    first_t, second_t = np.ascontiguousarray(rule.first.T), np.ascontiguousarray(rule.second.T)
    force, net_load, forced = np.empty((m, wide)), np.empty((columns, m * p)), np.empty((columns, m * p))
    homogeneous, response = np.empty((columns, m * p)), np.empty((m * p, m * p))
    previous, output, difference = np.zeros((2, wide)), np.empty((2, wide)), np.empty((2, wide))
    # ringing amplitudes excited by the last term's speeds at the two ends
    end_terms, end_slopes = np.zeros((2, columns, 2)), np.empty((fast * columns, 2))
    first_size, end_weights = np.zeros(2 * columns), np.empty((p, 2))
    accepted_rows = accepted[m:].reshape(fast * columns, p)
    for e in range(count):
        h, per_width, per_square = widths[e], 1.0 / widths[e], 1.0 / widths[e] ** 2
        phase = h / math.sqrt(np.trace(partition.fast_masses)) if fast > 0 else np.inf
        for k in range(fast):
            for i in range(p):
                compliance[k, i] = 1.0 / (1.0 + fluctuation[e, i] * partition.eigenvalues[k])
            for c in range(1, columns):
                for i in range(p):
                    compliance[k, c * p + i] = compliance[k, i]
            for i in range(p):
                fast_load[k, last_column + i] = forces[e, i, m + k]
            for j in range(fast):
                weights[k, j] = per_square * partition.fast_masses[k, j]
                if is_damped:
                    weights[k, fast + j] = per_width * partition.fast_damping[k, j]
        for a in range(m):
            for i in range(p):
                slow_load[a, last_column + i] = forces[e, i, a]
        _slow_response(h, fluctuation[e], compliance, partition, rule, homogeneous, response)
        inertia[:], previous[:], end_terms[:], previous_size, ratio = 0.0, 0.0, 0.0, np.inf, 0.0
        for term in range(max_terms):
            for k in range(fast):
                for j in range(wide):
                    r[k, j] = (fast_load[k, j] - inertia[k, j]) * compliance[k, j]
            np.dot(partition.coupling, r, force)
            for a in range(m):
                for c in range(columns):
                    for i in range(p):
                        net_load[c, a * p + i] = slow_load[a, c * p + i] - fluctuation[e, i] * force[a, c * p + i]
            np.dot(net_load, response, forced)
            for a in range(m):
                for c in range(columns):
                    for i in range(p):
                        slow[a, c * p + i] = homogeneous[c, a * p + i] + forced[c, a * p + i]
                        force[a, c * p + i] = fluctuation[e, i] * slow[a, c * p + i]
            np.dot(coupling, force, coupled)
            for k in range(fast):
                for j in range(wide):
                    r[k, j] -= coupled[k, j] * compliance[k, j]
            np.dot(partition.outputs, x, output)
            if phase < _NARROW:
                _end_amplitudes(output - previous, rule.first, phase, end_terms)
            size_now = 0.0
            for q in range(2):
                for c in range(columns):
                    change, largest = 0.0, 0.0
                    for j in range(c * p, (c + 1) * p):
                        change = max(change, abs(output[q, j] - previous[q, j]))
                        largest = max(largest, abs(output[q, j]))
                    if term == 0:
                        first_size[q * columns + c] = largest
                    change = max(change, abs(end_terms[0, c, q]), abs(end_terms[1, c, q]))
                    if first_size[q * columns + c] > 0.0:
                        size_now = max(size_now, change / first_size[q * columns + c])
            if term > 0:
                ratio = size_now / previous_size
            if ratio >= 1.0:
                break
            for q in range(2):
                for j in range(wide):
                    difference[q, j], previous[q, j] = output[q, j] - previous[q, j], output[q, j]
                for c in range(columns if phase < _NARROW else 0):
                    difference[q, c * p], difference[q, c * p + p - 1] = end_terms[0, c, q], end_terms[1, c, q]
            for k in range(size):
                for j in range(wide):
                    accepted[k, j] = x[k, j]
            if size_now <= tolerance or fast == 0:
                break
            previous_size = size_now
            np.dot(fast_rows, second_t, second_derivative)
            if is_damped:
                np.dot(fast_rows, first_t, first_derivative)
            np.dot(weights, stacked, inertia)
        largest_ratio = max(largest_ratio, ratio)
        for i in range(p):
            end_weights[i, 0], end_weights[i, 1] = per_width * rule.first[0, i], per_width * rule.first[p - 1, i]
            for c in range(columns):
                for k in range(size):
                    solutions[e, i, c, k] = accepted[k, c * p + i]
                for q in range(2):
                    last_term[e, i, c, q] = difference[q, c * p + i]
        np.dot(accepted_rows, end_weights, end_slopes)
        for c in range(columns):
            for k in range(fast):
                speeds[e, 0, c, k], speeds[e, 1, c, k] = end_slopes[k * columns + c, 0], end_slopes[k * columns + c, 1]
            for a in range(m):
                rate, initial_slope = 0.0, 0.0
                for i in range(p):
                    initial_slope += end_weights[i, 0] * accepted[a, c * p + i]
                for i in range(1, p):
                    rate += rule.end_slope[i - 1] * (accepted[a, c * p + i] - accepted[a, c * p])
                element_ends[e, c, a] = accepted[a, c * p + p - 1]
                element_ends[e, c, m + a] = math.sqrt(partition.masses[a]) / h * rate
                # The slope of Radau's polynomial is accurate at the end only: correct the one at the start.
                slope_error = initial_slope - (1.0 / math.sqrt(partition.masses[a]) if c == m + a else 0.0)
                for k in range(fast):
                    speeds[e, 0, c, k] += fluctuation[e, 0] * compliance[k, 0] * partition.coupling[a, k] * slope_error
    return solutions, element_ends, speeds, last_term, largest_ratio


@fusing_kernel
def _slow_response(
    h: float, fluctuation: Array, compliance: Array, partition: Partition, rule: Radau, homogeneous: Array,
    response: Array,
) -> None:  # fmt: skip
    """Response of the slow modes on an element of width h: ``homogeneous`` (columns, m points) for unit initial states,
    and ``response`` (m points, m points) to unit forces at the points, one row per force."""
    p, (m, fast) = fluctuation.size, partition.coupling.shape
    square, s, n, reduction = h * h, p - 1, (p - 1) * m, np.empty(p)
    matrix, solution = np.empty((n, n)), np.zeros((n, 2 * m + p * m))
    for b in range(m):
        for a in range(m):
            for i in range(p):
                reduction[i] = 0.0
            for k in range(fast):
                pair = partition.coupling[a, k] * partition.coupling[b, k]
                for i in range(p):
                    reduction[i] += pair * compliance[k, i]
            mu, damping = partition.masses[a], partition.damping[a]
            scale = 1.0 / (mu + square)
            for j in range(s):
                geometric = partition.slow_geometric[a, b] - fluctuation[j + 1] * reduction[j + 1]
                stiffness = fluctuation[j + 1] * geometric + (1.0 if a == b else 0.0)
                for i in range(s):
                    matrix[a * s + i, b * s + j] = square * scale * rule.double_integral[i, j] * stiffness
                    if a == b:
                        matrix[a * s + i, a * s + j] += damping * h * scale * rule.single_integral[i, j]
                        solution[a * s + i, 2 * m + a * p + j + 1] = square * scale * rule.double_integral[i, j]
    for a in range(m):
        mu, damping = partition.masses[a], partition.damping[a]
        scale = 1.0 / (mu + square)
        for i in range(s):
            matrix[a * s + i, a * s + i] += mu * scale
            solution[a * s + i, a] = (mu + damping * h * rule.points[i + 1]) * scale
            solution[a * s + i, m + a] = math.sqrt(mu) * scale * h * rule.points[i + 1]
    solution = np.linalg.solve(matrix, solution)
    homogeneous[:], response[:] = 0.0, 0.0
    for a in range(m):
        homogeneous[a, a * p] = 1.0
        for i in range(s):
            for c in range(2 * m):
                homogeneous[c, a * p + i + 1] = solution[a * s + i, c]
            for j in range(m * p):
                response[j, a * p + i + 1] = solution[a * s + i, 2 * m + j]


@kernel
def _end_amplitudes(term: Array, first: Array, phase: float, out: Array) -> None:
    """Ringing amplitudes that a term's speed would excite at an element's two ends (2, columns, 2), from the term in
    the outputs (2, columns points); ``phase`` is the advance of the slowest fast mode over the element. If it is small,
    what the two ends excite nearly cancels, hence the division by at least 1."""
    p = first.shape[0]
    for end in range(2):
        for c in range(out.shape[1]):
            for q in range(2):
                out[end, c, q] = 0.0
                for j in range(p):
                    out[end, c, q] += first[end * (p - 1), j] / max(phase, 1.0) * term[q, c * p + j]


@kernel
def accumulated_transfer(element_ends: Array, is_first: NDArray[np.bool_]) -> Array:
    """Affine maps to every element's initial and final state (elements, 2, 2 m + 1, 2 m), from the initial state of the
    last element up to it that ``is_first`` of a panel; rows as the columns of ``slow_motion``."""
    count, columns, size = element_ends.shape
    maps = np.zeros((count, 2, columns, size))
    for e in range(count):
        if is_first[e]:
            for a in range(size):
                maps[e, 0, a, a] = 1.0
        else:
            for c in range(columns):
                for a in range(size):
                    maps[e, 0, c, a] = maps[e - 1, 1, c, a]
        for c in range(columns):
            for b in range(size):
                total = element_ends[e, size, b] if c == size else 0.0
                for a in range(size):
                    total += maps[e, 0, c, a] * element_ends[e, a, b]
                maps[e, 1, c, b] = total
    return maps
