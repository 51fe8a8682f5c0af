"""Slow modes by collocation in time, fast ones following them without ringing: the strip's motion over one element.

    M a'' + C a' + (1 + swing(phi) G) a = f(phi),   C diagonal in the modes

in coordinates of which the first m are modes and the rest makes G diagonal beside them, so that the stiffness of the
rest is diagonal at every angle. What the rest does is, w = 1/(1 + swing gamma),

    r = w (f_r - swing G_sr' a_s - M_r r'' - C_r r')

without r'' and r' at first, and again with those of the last r: a series in powers of (slow/fast frequency)^2. It is
asymptotic; where its terms no longer fall it ends. Each time the slow modes obey Radau's collocation under the force of
the rest. All columns of the solution (for unit first states, and for f alone) are carried on side by side.

Source: R. J. Guyan (1965); for the series, J. Kevorkian, J. D. Cole, Multiple Scale and Singular Perturbation Methods
(1996), section 4.3; for the collocation, ``solvers.numerics.radau``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import fusing_kernel, kernel
from solvers.numerics.radau import Radau

Array = NDArray[np.float64]

_WIDE, _ROUNDING, _SMOOTH = 2.0, 1e-16, 200.0
"""Radians beyond which a series is given an element's whole polynomials; rounding of a polynomial's highest degree; and
radians of a fast mode over which forces are smooth at the least: their Legendre coefficients fall that fast."""


class Parts(NamedTuple):
    """Matrices in the coordinates of above: ``slowness`` (m,) masses of the slow modes and ``damping`` (m,) of C,
    ``own`` (m, m), ``across`` (m, rest) and ``rates`` (rest,) of G, ``inert`` and ``damped`` (rest, rest) masses and C
    of the rest, ``read`` (2, m + rest) what is looked at."""

    slowness: Array
    damping: Array
    own: Array
    across: Array
    rates: Array
    inert: Array
    damped: Array
    read: Array


@kernel
def factor(a: Array, order: NDArray[np.int64]) -> None:
    """Gauss's elimination in place, rows exchanged."""
    n = a.shape[0]
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[best, k]):
                best = i
        order[k] = best
        for j in range(n if best != k else 0):
            a[k, j], a[best, j] = a[best, j], a[k, j]
        for i in range(k + 1, n):
            share = a[i, k] / a[k, k]
            a[i, k] = share
            for j in range(k + 1, n):
                a[i, j] -= share * a[k, j]


@kernel
def substitute(a: Array, order: NDArray[np.int64], b: Array) -> None:
    """Right sides (n, columns) become solutions."""
    n, columns = b.shape
    for k in range(n):
        best = order[k]
        for j in range(columns if best != k else 0):
            b[k, j], b[best, j] = b[best, j], b[k, j]
    for k in range(n):
        for i in range(k + 1, n):
            for j in range(columns):
                b[i, j] -= a[i, k] * b[k, j]
    for k in range(n - 1, -1, -1):
        for i in range(k + 1, n):
            for j in range(columns):
                b[k, j] -= a[k, i] * b[i, j]
        for j in range(columns):
            b[k, j] /= a[k, k]


@kernel
def degree_in(turned: float, most: int) -> int:
    """The degree up to which polynomials are given to a series, in an element in which the slowest fast mode turns by
    ``turned`` [rad].

    A term's second derivative makes (d - 1) d (d + 1) (d + 2)/(2 turned^2) times as much of what is of degree d, two
    degrees lower, and the next terms go on with that. So rounding grows the more the higher the degree and the
    narrower the element; what a lower degree leaves out is smooth, and the derivatives that it has are left out."""
    if turned >= _WIDE:
        return most
    best, least = most, np.inf
    for degree in range(1, most + 1):
        lost = _ROUNDING * _steepened(degree, turned)
        for further in range(degree + 1, degree + 3):
            lost += (turned / _SMOOTH) ** further * _steepened(further, turned)
        if lost < least:
            best, least = degree, lost
    return best


@kernel
def _steepened(degree: int, turned: float) -> float:
    """What all terms together make of a polynomial of that degree."""
    out = 1.0
    for d in range(degree, 1, -2):
        out *= max(0.5 * (d - 1) * d * (d + 1) * (d + 2) / turned**2, 1.0)
    return out


@fusing_kernel
def slow_motion(
    widths: Array, swing: Array, right: Array, parts: Parts, rule: Radau, wanted: float, most: int
) -> tuple[Array, Array, Array, Array, float]:
    """Motions over the elements, from ``swing`` (elements, points) and ``right`` (elements, points, m + rest).

    Gives (elements, points, 2 m + 1, m + rest): columns for unit first states (a, sqrt(mu) a') and, last, for the
    right side alone; the last states of the slow modes, (elements, 2 m + 1, 2 m); the speeds of the rest at an
    element's two ends, (elements, 2, 2 m + 1, rest); the last change of what ``parts.read`` reads, (elements,
    points, 2 m + 1, 2), at the ends of narrow elements as their speeds change it; and the greatest ratio by which
    changes fell at last. The series ends where it changes less than ``wanted`` of the first term's greatest that is
    read, after ``most`` terms, or before it grows.

    Within an element all is laid out as (modes, columns, points): every step is one product of small matrices or one
    pass over all of an array.
    """
    count, p, m, rest = widths.size, swing.shape[1], parts.slowness.size, parts.rates.size
    columns, size = 2 * m + 1, m + rest
    wide, last = columns * p, (columns - 1) * p
    out, ends = np.empty((count, p, columns, size)), np.empty((count, columns, 2 * m))
    speeds, change = np.empty((count, 2, columns, rest)), np.empty((count, p, columns, 2))
    lossy, slowest = bool(np.any(parts.damped != 0.0)), 0.0
    # 1/(1 + swing gamma), once for all columns; and the right side, that of the last column alone
    soft, given, pushed = np.empty((rest, wide)), np.zeros((rest, wide)), np.zeros((m, wide))
    # x holds slow modes and the rest; ``inertia`` is what inertia and damping of the rest take.
    x, kept, inertia, pulled = np.zeros((size, wide)), np.zeros((size, wide)), np.zeros((rest, wide)), soft.copy()
    slow, r, turned = x[:m], x[m:], np.empty((2 if lossy else 1, rest, wide))
    # The same arrays as products need them
    flat, both = r.reshape(rest * columns, p), turned.reshape(turned.shape[0] * rest, wide)
    once, twice = turned[turned.shape[0] - 1].reshape(rest * columns, p), turned[0].reshape(rest * columns, p)
    weights, across = np.empty((rest, turned.shape[0] * rest)), np.ascontiguousarray(parts.across.T)
    firsts, seconds, transposed = np.empty((p, p)), np.empty((p, p)), -1
    force, load, lifted = np.empty((m, wide)), np.empty((columns, m * p)), np.empty((columns, m * p))
    start, response = np.empty((columns, m * p)), np.empty((m * p, m * p))
    seen, read, untold, changed = np.zeros((2, wide)), np.empty((2, wide)), np.zeros((2, wide)), np.empty((2, wide))
    # The last change of speeds at the two ends, as places suffer from it.
    sped, steep = np.zeros((2, columns, 2)), np.empty((rest * columns, 2))
    at_first, two, left = np.zeros(2 * columns), np.empty((p, 2)), kept[m:].reshape(rest * columns, p)
    for e in range(count):
        h, per_width, per_square = widths[e], 1.0 / widths[e], 1.0 / widths[e] ** 2
        turns = h / math.sqrt(np.trace(parts.inert)) if rest > 0 else np.inf
        degree, narrow = degree_in(turns, p - 1), turns < _WIDE
        first, second = rule.firsts[degree], rule.seconds[degree]
        if degree != transposed:
            transposed = degree
            for i in range(p):
                for j in range(p):
                    firsts[i, j], seconds[i, j] = first[j, i], second[j, i]
        for k in range(rest):
            for i in range(p):
                soft[k, i] = 1.0 / (1.0 + swing[e, i] * parts.rates[k])
            for c in range(1, columns):
                for i in range(p):
                    soft[k, c * p + i] = soft[k, i]
            for i in range(p):
                given[k, last + i] = right[e, i, m + k]
            for j in range(rest):
                weights[k, j] = per_square * parts.inert[k, j]
                if lossy:
                    weights[k, rest + j] = per_width * parts.damped[k, j]
        for a in range(m):
            for i in range(p):
                pushed[a, last + i] = right[e, i, a]
        _respond(h, swing[e], soft, parts, rule, start, response)
        inertia[:], seen[:], untold[:], before, fell = 0.0, 0.0, 0.0, np.inf, 0.0
        # A polynomial has no more derivatives than its degree: whether terms fall is not told by what follows.
        for term in range(min(most, degree // 2 + 1) if narrow else most):
            for k in range(rest):
                for j in range(wide):
                    r[k, j] = (given[k, j] - inertia[k, j]) * soft[k, j]
            np.dot(parts.across, r, force)
            for a in range(m):
                for c in range(columns):
                    for i in range(p):
                        load[c, a * p + i] = pushed[a, c * p + i] - swing[e, i] * force[a, c * p + i]
            np.dot(load, response, lifted)
            for a in range(m):
                for c in range(columns):
                    for i in range(p):
                        slow[a, c * p + i] = start[c, a * p + i] + lifted[c, a * p + i]
                        force[a, c * p + i] = swing[e, i] * slow[a, c * p + i]
            np.dot(across, force, pulled)
            for k in range(rest):
                for j in range(wide):
                    r[k, j] -= pulled[k, j] * soft[k, j]
            np.dot(parts.read, x, read)
            if narrow:
                _speeds_of(read - seen + untold, first, turns, sped)
            now = 0.0
            for q in range(2):
                for c in range(columns):
                    moved, greatest = 0.0, 0.0
                    for j in range(c * p, (c + 1) * p):
                        moved, greatest = max(moved, abs(read[q, j] - seen[q, j])), max(greatest, abs(read[q, j]))
                    if term == 0:
                        at_first[q * columns + c] = greatest
                    if narrow:
                        moved = max(moved, abs(sped[0, c, q]), abs(sped[1, c, q]))
                    if at_first[q * columns + c] > 0.0:
                        now = max(now, moved / at_first[q * columns + c])
            if term > 0:
                fell = now / before
            if fell >= 1.0:
                break
            for q in range(2):
                for j in range(wide):
                    changed[q, j], seen[q, j] = read[q, j] - seen[q, j] + untold[q, j], read[q, j]
            for k in range(size):
                for j in range(wide):
                    kept[k, j] = x[k, j]
            if narrow:
                for q in range(2):
                    for c in range(columns):
                        changed[q, c * p], changed[q, c * p + p - 1] = sped[0, c, q], sped[1, c, q]
            if now <= wanted or rest == 0:
                break
            before = now
            if term == 0 and degree < p - 1:
                _untold_of(r, rule.seconds[min(degree + 2, p - 1)] - second, parts, soft, per_square, untold)
            np.dot(flat, seconds, twice)
            if lossy:
                np.dot(flat, firsts, once)
            np.dot(weights, both, inertia)
        slowest = max(slowest, fell)
        for i in range(p):
            two[i, 0], two[i, 1] = per_width * rule.first[0, i], per_width * rule.first[p - 1, i]
            for c in range(columns):
                for k in range(size):
                    out[e, i, c, k] = kept[k, c * p + i]
                for q in range(2):
                    change[e, i, c, q] = changed[q, c * p + i]
        np.dot(left, two, steep)
        for c in range(columns):
            for k in range(rest):
                speeds[e, 0, c, k], speeds[e, 1, c, k] = steep[k * columns + c, 0], steep[k * columns + c, 1]
            for a in range(m):
                rate, began = 0.0, 0.0
                for i in range(p):
                    began += two[i, 0] * kept[a, c * p + i]
                for i in range(1, p):
                    rate += rule.slope[i - 1] * (kept[a, c * p + i] - kept[a, c * p])
                ends[e, c, a], ends[e, c, m + a] = kept[a, c * p + p - 1], math.sqrt(parts.slowness[a]) / h * rate
                # Radau's polynomial has the right slope at its last end alone.
                slip = began - (1.0 / math.sqrt(parts.slowness[a]) if c == m + a else 0.0)
                for k in range(rest):
                    speeds[e, 0, c, k] += swing[e, 0] * soft[k, 0] * parts.across[a, k] * slip
    return out, ends, speeds, change, slowest


@fusing_kernel
def _respond(h: float, swing: Array, soft: Array, parts: Parts, rule: Radau, start: Array, response: Array) -> None:
    """What the slow modes do in an element of width h: ``start`` (columns, m points) for unit first states, and
    ``response`` (m points, m points), rows those of forces, under forces at the points."""
    p, (m, rest) = swing.size, parts.across.shape
    square, s, n, held = h * h, p - 1, (p - 1) * m, np.empty(p)
    matrix, order, solution = np.empty((n, n)), np.empty(n, np.int64), np.zeros((n, 2 * m + p * m))
    for b in range(m):
        for a in range(m):
            for i in range(p):
                held[i] = 0.0
            for k in range(rest):
                pair = parts.across[a, k] * parts.across[b, k]
                for i in range(p):
                    held[i] += pair * soft[k, i]
            mu, lost = parts.slowness[a], parts.damping[a]
            scale = 1.0 / (mu + square)
            for j in range(s):
                here = swing[j + 1] * (parts.own[a, b] - swing[j + 1] * held[j + 1]) + (1.0 if a == b else 0.0)
                for i in range(s):
                    matrix[a * s + i, b * s + j] = square * scale * rule.twice[i, j] * here
                    if a == b:
                        matrix[a * s + i, a * s + j] += lost * h * scale * rule.once[i, j]
                        solution[a * s + i, 2 * m + a * p + j + 1] = square * scale * rule.twice[i, j]
    for a in range(m):
        mu, lost = parts.slowness[a], parts.damping[a]
        scale = 1.0 / (mu + square)
        for i in range(s):
            matrix[a * s + i, a * s + i] += mu * scale
            solution[a * s + i, a] = (mu + lost * h * rule.points[i + 1]) * scale
            solution[a * s + i, m + a] = math.sqrt(mu) * scale * h * rule.points[i + 1]
    factor(matrix, order)
    substitute(matrix, order, solution)
    start[:], response[:] = 0.0, 0.0
    for a in range(m):
        start[a, a * p] = 1.0
        for i in range(s):
            for c in range(2 * m):
                start[c, a * p + i + 1] = solution[a * s + i, c]
            for j in range(m * p):
                response[j, a * p + i + 1] = solution[a * s + i, 2 * m + j]


@kernel
def _untold_of(r: Array, second: Array, parts: Parts, soft: Array, per_square: float, out: Array) -> None:
    """What is read (2, columns points) of the inertia of the rest's part (rest, columns points) that is not told to the
    series, of which ``second`` makes the second derivative; added to ``out``. ``per_square`` is 1/width^2."""
    (rest, wide), p = r.shape, second.shape[0]
    bent = np.dot(r.reshape(rest * wide // p, p), np.ascontiguousarray(second.T)).reshape(rest, wide)
    inertia = np.dot(parts.inert, bent)
    for q in range(2):
        for k in range(rest):
            for j in range(wide):
                out[q, j] += parts.read[q, parts.slowness.size + k] * soft[k, j] * inertia[k, j] * per_square


@kernel
def _speeds_of(change: Array, first: Array, turns: float, out: Array) -> None:
    """At an element's two ends, in which the slowest fast mode turns by so many radians: the amplitudes of what rings
    by a change of the speed, (2, columns, 2), from that of what is read (2, columns points). A mode that hardly turns
    is hardly kept apart by the two ends, of which one takes back what the other gives."""
    p = first.shape[0]
    for end in range(2):
        for c in range(out.shape[1]):
            for q in range(2):
                out[end, c, q] = 0.0
                for j in range(p):
                    out[end, c, q] += first[end * (p - 1), j] / max(turns, 1.0) * change[q, c * p + j]


@kernel
def carried(ends: Array, starts: NDArray[np.bool_]) -> Array:
    """Maps to every element's first state and, in the next place, to its last one, from the first state of the last
    element before it that ``starts``: (elements, 2, 2 m + 1, 2 m), rows as the columns of ``slow_motion``."""
    count, columns, size = ends.shape
    out = np.zeros((count, 2, columns, size))
    for e in range(count):
        if starts[e]:
            for a in range(size):
                out[e, 0, a, a] = 1.0
        else:
            for c in range(columns):
                for a in range(size):
                    out[e, 0, c, a] = out[e - 1, 1, c, a]
        for c in range(columns):
            for b in range(size):
                total = ends[e, size, b] if c == size else 0.0
                for a in range(size):
                    total += out[e, 0, c, a] * ends[e, a, b]
                out[e, 1, c, b] = total
    return out
