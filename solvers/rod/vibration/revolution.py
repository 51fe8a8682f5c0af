"""Assembly of the element solutions over one revolution, and its periodicity condition.

A panel is the interval between two successive corners of the force. Within it the solution is the sum of the slow
modes, integrated by collocation from arbitrary initial states; the fast modes, which follow them quasi-statically
(``slow_modes``); and, where it matters, the free vibration of fast modes that starts at the corner (``ringing``). A
panel's unknowns are the initial states of its slow modes and the real and imaginary parts of its ringing amplitudes.
They follow from the continuity of amplitudes and speeds at all corners, with the last panel followed by the first one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.arrays import Array, Complex
from solvers.numerics.jit import kernel
from solvers.numerics.radau import Radau
from solvers.rod.vibration.equation import StripEquation, damping_of
from solvers.rod.vibration.slow_modes import Partition, accumulated_transfer, slow_motion

_MAX_TERMS = 9
_LARGEST_TOLERANCE = 1e-4


class Revolution(NamedTuple):
    """Element solutions over a revolution before the periodicity condition is imposed: for unit initial states (a,
    sqrt(mu) a') of the m slow modes and, in the last column, the particular solution for zero initial states.

    widths          element widths [rad], (elements,)
    first, last     indices of the first and last element of every panel (panels,)
    static          quasi-static amplitudes (elements, points, modes)
    solutions       (elements, points, 2 m + 1, modes), in the coordinates of ``slow_modes``
    speeds          of the fast modes at the two ends of elements (elements, 2, 2 m + 1, fast), in these coordinates
    last_term       last term of the series of the fast modes, as seen in V'' and V''' at the clamp (``slow_modes``)
    ratio           largest ratio of its last term to the one before
    fast_vectors    maps the fast coordinates to fast modes (fast, fast)
    transfer        from a panel's initial state, and 1, to the element's, (elements, 2 m + 1, 2 m)
    start, end      states at the two ends of every panel (panels, 2 m + 1, 2 modes): amplitudes of the slow modes,
                    their speeds, then amplitude and speed of each fast mode in turn
    """

    slow: int
    widths: Array
    first: NDArray[np.int64]
    last: NDArray[np.int64]
    static: Array
    solutions: Array
    speeds: Array
    last_term: Array
    ratio: float
    fast_vectors: Array
    transfer: Array
    start: Array
    end: Array


@kernel
def assemble(
    equation: StripEquation, rule: Radau, fluctuation: Array, quasi_static: Array, forces: Array, edges: Array,
    first: NDArray[np.int64], slow: int, tolerance: float,
) -> Revolution:  # fmt: skip
    """Solve the equation on all elements between ``edges`` (elements + 1,) with ``slow`` slow modes.

    The first three arrays are the results of ``quasi_static`` at the rule's points; the third one is overwritten.
    Series of the fast modes end below ``tolerance``, relative to their first term.
    """
    m, n, p, count = slow, equation.masses.size, rule.points.size, edges.size - 1
    fast, columns, widths, panels = n - m, 2 * m + 1, np.diff(edges), first.size
    fluctuations, static = fluctuation.reshape(count, p), quasi_static.reshape(count, p, n)
    force = forces.reshape(count, p, n)
    damping = damping_of(equation)
    if equation.loss != 0.0:
        # Damping acts on d = a - c only: C c' moves to the right-hand side.
        for e in range(count):
            slope = np.dot(rule.first, static[e])
            for i in range(p):
                for k in range(n):
                    force[e, i, k] += damping[k] * slope[i, k] / widths[e]
    partition, fast_vectors = _partition(equation, damping, m)
    if fast > 0:
        projected = np.dot(np.ascontiguousarray(forces[:, m:]), fast_vectors)
        for i in range(count * p):
            for k in range(fast):
                forces[i, m + k] = projected[i, k]
    solutions, element_ends, speeds, last_term, ratio = slow_motion(
        widths, fluctuations, force, partition, rule, min(tolerance, _LARGEST_TOLERANCE), _MAX_TERMS
    )
    is_first, last = np.zeros(count, np.bool_), np.empty(panels, np.int64)
    for k in range(panels):
        is_first[first[k]], last[k] = True, (first[k + 1] if k + 1 < panels else count) - 1
    maps = accumulated_transfer(element_ends, is_first)
    transfer = np.ascontiguousarray(maps[:, 0])
    start, end = np.zeros((panels, columns, 2 * n)), np.zeros((panels, columns, 2 * n))
    padded = np.zeros((columns, columns))
    padded[columns - 1, columns - 1] = 1.0
    for k in range(panels):
        fast_start = _fast_states(solutions[first[k], 0], speeds[first[k], 0], fast_vectors, equation.masses)
        fast_end = _fast_states(solutions[last[k], p - 1], speeds[last[k], 1], fast_vectors, equation.masses)
        for c in range(columns):
            for a in range(2 * m):
                padded[c, a] = transfer[last[k], c, a]
        fast_end = np.dot(padded, fast_end)
        for c in range(columns):
            for a in range(2 * m):
                start[k, c, a], end[k, c, a] = 1.0 if c == a else 0.0, maps[last[k], 1, c, a]
            for a in range(2 * fast):
                start[k, c, 2 * m + a], end[k, c, 2 * m + a] = fast_start[c, a], fast_end[c, a]
    return Revolution(
        m, widths, first, last, static, solutions, speeds, last_term, ratio, fast_vectors, transfer, start, end
    )


@kernel
def _partition(equation: StripEquation, damping: Array, m: int) -> tuple[Partition, Array]:
    """The equation in coordinates of which the first m are modes and the others diagonalize the fast block of G; and
    the latter coordinates' vectors in modes (fast, fast)."""
    n, geometric = equation.masses.size, equation.geometric
    fast = n - m
    eigenvalues, fast_vectors = equation.eigenvalues, equation.eigenvectors
    if 0 < m < n:
        eigenvalues, vectors = np.linalg.eigh(np.ascontiguousarray(geometric[m:, m:]))
        fast_vectors = np.ascontiguousarray(vectors)
    elif m > 0:
        eigenvalues, fast_vectors = np.empty(0), np.empty((0, 0))
    fast_masses, fast_damping, coupling = np.zeros((fast, fast)), np.zeros((fast, fast)), np.zeros((m, fast))
    outputs = np.zeros((2, n))
    if fast > 0:
        mass_rows, damping_rows = np.empty((fast, fast)), np.empty((fast, fast))
        for j in range(fast):
            for k in range(fast):
                mass_rows[j, k] = equation.masses[m + j] * fast_vectors[j, k]
                damping_rows[j, k] = damping[m + j] * fast_vectors[j, k]
        np.dot(fast_vectors.T, mass_rows, fast_masses)
        if equation.loss != 0.0:
            np.dot(fast_vectors.T, damping_rows, fast_damping)
    for k in range(fast):
        for j in range(fast):
            for a in range(m):
                coupling[a, k] += geometric[a, m + j] * fast_vectors[j, k]
            for q in range(2):
                outputs[q, m + k] += equation.clamp[q, m + j] * fast_vectors[j, k]
    for q in range(2):
        for a in range(m):
            outputs[q, a] = equation.clamp[q, a]
    slow_geometric = np.ascontiguousarray(geometric[:m, :m])
    return Partition(
        equation.masses[:m], damping[:m], slow_geometric, coupling, eigenvalues, fast_masses, fast_damping, outputs
    ), fast_vectors


@kernel
def _fast_states(solutions: Array, speeds: Array, fast_vectors: Array, masses: Array) -> Array:
    """Amplitude and speed sqrt(mu) a' of each fast mode in turn (2 m + 1, 2 fast), from solutions and speeds in the
    coordinates of ``slow_modes`` at one point."""
    count, fast = speeds.shape
    m, out = masses.size - fast, np.zeros((count, 2 * fast))
    if fast > 0:
        amplitude = np.dot(np.ascontiguousarray(solutions[:, m:]), fast_vectors.T)
        speed = np.dot(speeds, fast_vectors.T)
        for c in range(count):
            for k in range(fast):
                out[c, 2 * k], out[c, 2 * k + 1] = amplitude[c, k], speed[c, k] * math.sqrt(masses[m + k])
    return out


@kernel
def periodic_solution(revolution: Revolution, free_start: Array, free_end: Array) -> tuple[Array, Complex, float]:
    """Initial states of the slow modes in every panel (panels, 2 m), complex amplitudes of the ringing at its start
    (panels, ringing), and the amplification of ``periodic_unknowns``.

    ``free_start`` and ``free_end`` (panels, 2 ringing, states) are the free motions' states at the panels' two ends for
    unit real and imaginary parts of the amplitudes.
    """
    m, panels, free = revolution.slow, revolution.first.size, free_start.shape[1]
    u = 2 * m + free
    start, end = np.empty((panels, u + 1, u)), np.empty((panels, u + 1, u))
    for k in range(panels):
        for c in range(u + 1):
            for a in range(u):
                if 2 * m <= c < u:
                    start[k, c, a], end[k, c, a] = free_start[k, c - 2 * m, a], free_end[k, c - 2 * m, a]
                else:
                    column = min(c, 2 * m)
                    start[k, c, a], end[k, c, a] = revolution.start[k, column, a], revolution.end[k, column, a]
    unknowns, amplification = periodic_unknowns(start, end)
    initial, ringing = np.empty((panels, 2 * m)), np.empty((panels, free // 2), np.complex128)
    for k in range(panels):
        for a in range(2 * m):
            initial[k, a] = unknowns[k, a]
        for r in range(free // 2):
            ringing[k, r] = unknowns[k, 2 * m + 2 * r] + 1j * unknowns[k, 2 * m + 2 * r + 1]
    return initial, ringing, amplification


@kernel
def periodic_unknowns(start: Array, end: Array) -> tuple[Array, float]:
    """Solve the periodicity condition (I - M) u = p for the unknowns of every panel (panels, unknowns).

    ``start`` and ``end`` (panels, unknowns + 1, unknowns) are the states at the panels' two ends for unit unknowns and,
    last, for zero unknowns; M is the monodromy matrix, p the state after one revolution from zero unknowns. Also
    returns 1/sigma_min(I - M), the largest amplification of an error made in one revolution: infinite, with zero
    unknowns, exactly at a resonance without damping.
    """
    count, u = start.shape[0], start.shape[2]
    unknowns = np.zeros((count, u))
    if u == 0:
        return unknowns, 1.0
    maps, revolution = _panel_maps(start, end)
    matrix = np.empty((u, u))
    for a in range(u):
        for b in range(u):
            matrix[a, b] = (1.0 if a == b else 0.0) - revolution[b, a]
    _, values, _ = np.linalg.svd(matrix)
    if not values[u - 1] > 0.0:
        return unknowns, np.inf
    unknowns[0] = np.linalg.solve(matrix, revolution[u])
    for k in range(count - 1):
        for a in range(u):
            value = maps[k, u, a]
            for b in range(u):
                value += unknowns[k, b] * maps[k, b, a]
            unknowns[k + 1, a] = value
    return unknowns, 1.0 / values[u - 1]


@kernel
def _panel_maps(start: Array, end: Array) -> tuple[Array, Array]:
    """Affine maps from every panel's unknowns to those of the next panel (panels, unknowns + 1, unknowns), constant
    terms last, and their composition over the revolution, from the states at the panels' ends."""
    count, u = start.shape[0], start.shape[2]
    maps, revolution, earlier = np.empty((count, u + 1, u)), np.zeros((u + 1, u)), np.empty((u + 1, u))
    matrix, product = np.empty((u, u)), np.empty((u, u + 1))
    for a in range(u):
        revolution[a, a] = 1.0
    for k in range(count):
        following = (k + 1) % count
        for a in range(u):
            for b in range(u):
                matrix[a, b] = start[following, b, a]
            for c in range(u + 1):
                product[a, c] = end[k, c, a]
            product[a, u] -= start[following, u, a]
        product = np.linalg.solve(matrix, product)
        earlier[:] = revolution
        for c in range(u + 1):
            for a in range(u):
                maps[k, c, a] = product[a, c]
                total = product[a, u] if c == u else 0.0
                for b in range(u):
                    total += earlier[c, b] * product[a, b]
                revolution[c, a] = total
    return maps, revolution
