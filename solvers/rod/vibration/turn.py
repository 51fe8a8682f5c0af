"""A turn of the strip put together from its elements and closed.

A panel lies between two corners of the force. There slow modes, which anything may have set going, are followed by
collocation, and fast ones follow them (``slow_modes``); where it matters fast modes ring behind corners (``ringing``).
A panel's unknowns are the first states of its slow modes and the real and imaginary parts of its ringing; states that
are equal on both sides of every corner determine them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.numerics.radau import Radau
from solvers.rod.vibration.equation import StripEquation
from solvers.rod.vibration.slow_modes import Parts, carried, factor, slow_motion, substitute

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_TERMS = 9
_LOOSEST = 1e-4


class Turn(NamedTuple):
    """What a turn is made of, before it is closed: of every element for unit first states (a, sqrt(mu) a') of the slow
    modes and, last, for none.

    widths    (elements,), those behind corners being ``first`` (panels,), those before the next ones ``stop``
    still     (elements, points, modes) the quasi-static amplitudes
    columns   (elements, points, 2 m + 1, modes) and ``speeds`` (elements, 2, 2 m + 1, fast) of the fast modes at the
              two ends, in coordinates of ``slow_modes``, of which ``rest`` takes the fast ones to modes
    change    what the series of the fast modes changed at last, and ``fell`` by how much less than before
    onward    (elements, 2 m + 1, 2 m), from the panel's first state, and 1, to the element's
    lefts     states behind corners and, ``rights``, before the next ones, (panels, 2 m + 1, 2 modes): first of slow
              modes, amplitudes and then speeds, then amplitude and speed of every fast one
    """

    slow: int
    widths: Array
    first: NDArray[np.int64]
    stop: NDArray[np.int64]
    still: Array
    columns: Array
    speeds: Array
    change: Array
    fell: float
    rest: Array
    onward: Array
    lefts: Array
    rights: Array


@kernel
def turn_of(
    equation: StripEquation, rule: Radau, flat: Array, quiet: Array, forced: Array, edges: Array,
    first: NDArray[np.int64], slow: int, wanted: float,
) -> Turn:  # fmt: skip
    """From what ``quasi_static`` gives at a rule's points of elements between edges (elements + 1,), of which the force
    is overwritten; series that could give more than ``wanted`` are not asked to."""
    m, n, p, count = slow, equation.slowness.size, rule.points.size, edges.size - 1
    fast, columns, widths, panels = n - m, 2 * m + 1, np.diff(edges), first.size
    swing, still, right = flat.reshape(count, p), quiet.reshape(count, p, n), forced.reshape(count, p, n)
    damping = equation.loss * np.sqrt(equation.slowness)
    if equation.loss != 0.0:
        # What follows the force is not damped.
        for e in range(count):
            moved = np.dot(rule.first, still[e])
            for i in range(p):
                for k in range(n):
                    right[e, i, k] += damping[k] * moved[i, k] / widths[e]
    parts, rest = _parts(equation, damping, m)
    if fast > 0:
        turned = np.dot(np.ascontiguousarray(forced[:, m:]), rest)
        for i in range(count * p):
            for k in range(fast):
                forced[i, m + k] = turned[i, k]
    out, last, speeds, change, fell = slow_motion(widths, swing, right, parts, rule, min(wanted, _LOOSEST), _TERMS)
    starts, stop = np.zeros(count, np.bool_), np.empty(panels, np.int64)
    for k in range(panels):
        starts[first[k]], stop[k] = True, (first[k + 1] if k + 1 < panels else count) - 1
    maps = carried(last, starts)
    onward = np.ascontiguousarray(maps[:, 0])
    lefts, rights = np.zeros((panels, columns, 2 * n)), np.zeros((panels, columns, 2 * n))
    step = np.zeros((columns, columns))
    step[columns - 1, columns - 1] = 1.0
    for k in range(panels):
        head = _fast_states(out[first[k], 0], speeds[first[k], 0], rest, equation.slowness)
        tail = _fast_states(out[stop[k], p - 1], speeds[stop[k], 1], rest, equation.slowness)
        for c in range(columns):
            for a in range(2 * m):
                step[c, a] = onward[stop[k], c, a]
        tail = np.dot(step, tail)
        for c in range(columns):
            for a in range(2 * m):
                lefts[k, c, a], rights[k, c, a] = 1.0 if c == a else 0.0, maps[stop[k], 1, c, a]
            for a in range(2 * fast):
                lefts[k, c, 2 * m + a], rights[k, c, 2 * m + a] = head[c, a], tail[c, a]
    return Turn(m, widths, first, stop, still, out, speeds, change, fell, rest, onward, lefts, rights)


@kernel
def _parts(equation: StripEquation, damping: Array, m: int) -> tuple[Parts, Array]:
    """The equation in coordinates of which the first m are modes and the rest makes G diagonal; these in modes."""
    n, coupling = equation.slowness.size, equation.coupling
    fast = n - m
    rates, rest = equation.rates, equation.turned
    if 0 < m < n:
        rates, turned = np.linalg.eigh(np.ascontiguousarray(coupling[m:, m:]))
        rest = np.ascontiguousarray(turned)
    elif m > 0:
        rates, rest = np.empty(0), np.empty((0, 0))
    inert, damped, across, read = np.zeros((fast, fast)), np.zeros((fast, fast)), np.zeros((m, fast)), np.zeros((2, n))
    if fast > 0:
        heavy, lossy = np.empty((fast, fast)), np.empty((fast, fast))
        for j in range(fast):
            for k in range(fast):
                heavy[j, k], lossy[j, k] = equation.slowness[m + j] * rest[j, k], damping[m + j] * rest[j, k]
        np.dot(rest.T, heavy, inert)
        if equation.loss != 0.0:
            np.dot(rest.T, lossy, damped)
    for k in range(fast):
        for j in range(fast):
            for a in range(m):
                across[a, k] += coupling[a, m + j] * rest[j, k]
            for q in range(2):
                read[q, m + k] += equation.clamp[q, m + j] * rest[j, k]
    for q in range(2):
        for a in range(m):
            read[q, a] = equation.clamp[q, a]
    own = np.ascontiguousarray(coupling[:m, :m])
    return Parts(equation.slowness[:m], damping[:m], own, across, rates, inert, damped, read), rest


@kernel
def _fast_states(columns: Array, speeds: Array, rest: Array, slowness: Array) -> Array:
    """Amplitude and speed of every fast mode by turns, (2 m + 1, 2 fast), from columns and speeds at one place."""
    count, fast = speeds.shape
    m, out = slowness.size - fast, np.zeros((count, 2 * fast))
    if fast > 0:
        place, speed = np.dot(np.ascontiguousarray(columns[:, m:]), rest.T), np.dot(speeds, rest.T)
        for c in range(count):
            for k in range(fast):
                out[c, 2 * k], out[c, 2 * k + 1] = place[c, k], speed[c, k] * math.sqrt(slowness[m + k])
    return out


@kernel
def close(turn: Turn, behind: Array, before: Array) -> tuple[Array, Complex, float]:
    """The slow modes' first states in every panel (panels, 2 m), the amplitudes of what rings behind corners (panels,
    ringing), and by which closing the turn enlarges what one turn misses; from states of what may ring (panels, 2
    ringing, states) behind corners and before the next ones."""
    m, panels, rung = turn.slow, turn.first.size, behind.shape[1]
    u = 2 * m + rung
    lefts, rights = np.empty((panels, u + 1, u)), np.empty((panels, u + 1, u))
    for k in range(panels):
        for c in range(u + 1):
            for a in range(u):
                if 2 * m <= c < u:
                    lefts[k, c, a], rights[k, c, a] = behind[k, c - 2 * m, a], before[k, c - 2 * m, a]
                else:
                    own = min(c, 2 * m)
                    lefts[k, c, a], rights[k, c, a] = turn.lefts[k, own, a], turn.rights[k, own, a]
    unknowns, amplification = closed(lefts, rights)
    begun, ringing = np.empty((panels, 2 * m)), np.empty((panels, rung // 2), np.complex128)
    for k in range(panels):
        for a in range(2 * m):
            begun[k, a] = unknowns[k, a]
        for r in range(rung // 2):
            ringing[k, r] = unknowns[k, 2 * m + 2 * r] + 1j * unknowns[k, 2 * m + 2 * r + 1]
    return begun, ringing, amplification


@kernel
def closed(lefts: Array, rights: Array) -> tuple[Array, float]:
    """The unknowns of every panel (panels, unknowns), from the states at the panels' two ends for unit unknowns and,
    last, for none, (panels, unknowns + 1, unknowns) each; and the greatest factor by which closing the turn enlarges
    what one turn misses: infinite, and the unknowns nought, exactly at a resonance without damping."""
    count, u = lefts.shape[0], lefts.shape[2]
    out = np.zeros((count, u))
    if u == 0:
        return out, 1.0
    steps, whole = _steps(lefts, rights)
    missing, first, order = np.empty((u, u)), np.empty((u, 1)), np.empty(u, np.int64)
    for a in range(u):
        first[a, 0] = whole[u, a]
        for b in range(u):
            missing[a, b] = (1.0 if a == b else 0.0) - whole[b, a]
    _, values, _ = np.linalg.svd(missing)
    if not values[u - 1] > 0.0:
        return out, np.inf
    factor(missing, order)
    substitute(missing, order, first)
    for a in range(u):
        out[0, a] = first[a, 0]
    for k in range(count - 1):
        for a in range(u):
            total = steps[k, u, a]
            for b in range(u):
                total += out[k, b] * steps[k, b, a]
            out[k + 1, a] = total
    return out, 1.0 / values[u - 1]


@kernel
def _steps(lefts: Array, rights: Array) -> tuple[Array, Array]:
    """Maps from every panel's unknowns, and 1, to those of the next one, (panels, unknowns + 1, unknowns), and that of
    the whole turn, from the states at the panels' ends."""
    count, u = lefts.shape[0], lefts.shape[2]
    steps, whole, before = np.empty((count, u + 1, u)), np.zeros((u + 1, u)), np.empty((u + 1, u))
    matrix, order, right = np.empty((u, u)), np.empty(u, np.int64), np.empty((u, u + 1))
    for a in range(u):
        whole[a, a] = 1.0
    for k in range(count):
        after = (k + 1) % count
        for a in range(u):
            for b in range(u):
                matrix[a, b] = lefts[after, b, a]
            for c in range(u + 1):
                right[a, c] = rights[k, c, a]
            right[a, u] -= lefts[after, u, a]
        factor(matrix, order)
        substitute(matrix, order, right)
        before[:] = whole
        for c in range(u + 1):
            for a in range(u):
                steps[k, c, a] = right[a, c]
                total = right[a, u] if c == u else 0.0
                for b in range(u):
                    total += before[c, b] * right[a, b]
                whole[c, a] = total
    return steps, whole
