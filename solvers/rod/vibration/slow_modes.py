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
    """
    count, p, m, rest = widths.size, swing.shape[1], parts.slowness.size, parts.rates.size
    s, columns, size = p - 1, 2 * m + 1, m + rest
    out, ends = np.zeros((count, p, columns, size)), np.zeros((count, columns, 2 * m))
    speeds, slip = np.zeros((count, 2, columns, rest)), np.empty((columns, m))
    change = np.zeros((count, p, columns, 2))
    matrix, order = np.empty((s * m, s * m)), np.empty(s * m, np.int64)
    base, solution = np.zeros((s * m, columns)), np.zeros((s * m, columns))
    soft, held = np.empty((p, rest)), np.empty((p, m, m))
    # What the rest does, its inertia beside it, and a place for what leads from one to the other.
    r, inertia, turned = np.zeros((p, columns, rest)), np.zeros((p, columns, rest)), np.zeros((p, columns, rest))
    drag, lossy = np.zeros((p, columns, rest)), bool(np.any(parts.damped != 0.0))
    slow, force = np.zeros((p, columns, m)), np.empty((p, columns, m))
    seen, read = np.zeros((p, columns, 2)), np.empty((p, columns, 2))
    # What a lower degree leaves out, and the last change of speeds at the two ends, as places suffer from it.
    untold, sped = np.zeros((p, columns, 2)), np.zeros((2, columns, 2))
    moved, most_seen = np.empty((columns, 2)), np.empty((columns, 2))
    slowest = 0.0
    for e in range(count):
        h, square = widths[e], widths[e] * widths[e]
        turns = h / math.sqrt(np.trace(parts.inert)) if rest > 0 else np.inf
        degree, narrow = degree_in(turns, p - 1), turns < _WIDE
        first, second = rule.firsts[degree], rule.seconds[degree]
        for i in range(p):
            for k in range(rest):
                soft[i, k] = 1.0 / (1.0 + swing[e, i] * parts.rates[k])
            for a in range(m):
                for b in range(m):
                    total = 0.0
                    for k in range(rest):
                        total += parts.across[a, k] * soft[i, k] * parts.across[b, k]
                    held[i, a, b] = swing[e, i] * (parts.own[a, b] - swing[e, i] * total)
                held[i, a, a] += 1.0
        for a in range(m):
            mu, lost = parts.slowness[a], parts.damping[a]
            scale = 1.0 / (mu + square)
            for i in range(s):
                row = i * m + a
                for j in range(s):
                    for b in range(m):
                        matrix[row, j * m + b] = square * scale * rule.twice[i, j] * held[j + 1, a, b]
                    matrix[row, j * m + a] += lost * h * scale * rule.once[i, j]
                matrix[row, row] += mu * scale
                base[row, a] = (mu + lost * h * rule.points[i + 1]) * scale
                base[row, m + a] = math.sqrt(mu) * scale * h * rule.points[i + 1]
        factor(matrix, order)
        inertia[:], seen[:], untold[:], last, fell = 0.0, 0.0, 0.0, np.inf, 0.0
        slow[0] = 0.0
        for a in range(m):
            slow[0, a, a] = 1.0
        # A polynomial has no more derivatives than its degree: whether terms fall is not told by what follows.
        for term in range(min(most, degree // 2 + 1) if narrow else most):
            for i in range(p):
                for c in range(columns):
                    for k in range(rest):
                        r[i, c, k] = -inertia[i, c, k] * soft[i, k]
                for k in range(rest):
                    r[i, columns - 1, k] += right[e, i, m + k] * soft[i, k]
                for c in range(columns):
                    for a in range(m):
                        total = 0.0
                        for k in range(rest):
                            total += parts.across[a, k] * r[i, c, k]
                        force[i, c, a] = -swing[e, i] * total
                for a in range(m):
                    force[i, columns - 1, a] += right[e, i, a]
            for a in range(m):
                scale = square / (parts.slowness[a] + square)
                for i in range(s):
                    for c in range(columns):
                        total = 0.0
                        for j in range(s):
                            total += rule.twice[i, j] * force[j + 1, c, a]
                        solution[i * m + a, c] = base[i * m + a, c] + scale * total
            substitute(matrix, order, solution)
            moved[:] = 0.0
            if term == 0:
                most_seen[:] = 0.0
            for i in range(p):
                for c in range(columns):
                    for a in range(m):
                        if i > 0:
                            slow[i, c, a] = solution[(i - 1) * m + a, c]
                        pull = swing[e, i] * slow[i, c, a]
                        for k in range(rest):
                            r[i, c, k] -= pull * parts.across[a, k] * soft[i, k]
                    for q in range(2):
                        total = 0.0
                        for a in range(m):
                            total += parts.read[q, a] * slow[i, c, a]
                        for k in range(rest):
                            total += parts.read[q, m + k] * r[i, c, k]
                        read[i, c, q] = total
                        moved[c, q] = max(moved[c, q], abs(total - seen[i, c, q]))
                        if term == 0:
                            most_seen[c, q] = max(most_seen[c, q], abs(total))
            if narrow:
                _speeds_of(read - seen + untold, first, turns, sped)
            now = 0.0
            for c in range(columns):
                for q in range(2):
                    if narrow:
                        moved[c, q] = max(moved[c, q], abs(sped[0, c, q]), abs(sped[1, c, q]))
                    if most_seen[c, q] > 0.0:
                        now = max(now, moved[c, q] / most_seen[c, q])
            if term > 0:
                fell = now / last
            if fell >= 1.0:
                break
            for i in range(p):
                for c in range(columns):
                    for a in range(m):
                        out[e, i, c, a] = slow[i, c, a]
                    for k in range(rest):
                        out[e, i, c, m + k] = r[i, c, k]
                    for q in range(2):
                        change[e, i, c, q] = read[i, c, q] - seen[i, c, q] + untold[i, c, q]
                        seen[i, c, q] = read[i, c, q]
            if narrow:
                change[e, 0], change[e, p - 1] = sped[0], sped[1]
            if now <= wanted or rest == 0:
                break
            last = now
            if term == 0 and degree < p - 1:
                _untold_of(r, rule.seconds[min(degree + 2, p - 1)] - second, parts, soft, square, untold)
            np.dot(second, r.reshape(p, columns * rest), turned.reshape(p, columns * rest))
            np.dot(turned.reshape(p * columns, rest), parts.inert, inertia.reshape(p * columns, rest))
            inertia /= square
            if lossy:
                np.dot(first, r.reshape(p, columns * rest), turned.reshape(p, columns * rest))
                np.dot(turned.reshape(p * columns, rest), parts.damped, drag.reshape(p * columns, rest))
                for i in range(p):
                    for c in range(columns):
                        for k in range(rest):
                            inertia[i, c, k] += drag[i, c, k] / h
        slowest, x = max(slowest, fell), out[e]
        for c in range(columns):
            for a in range(m):
                steep = 0.0
                for j in range(s):
                    steep += rule.slope[j] * (x[j + 1, c, a] - x[0, c, a])
                ends[e, c, a] = x[s, c, a]
                ends[e, c, m + a] = math.sqrt(parts.slowness[a]) / h * steep
                # Radau's polynomial has the right slope at its last end alone.
                slip[c, a] = -1.0 / math.sqrt(parts.slowness[a]) if c == m + a else 0.0
                for j in range(p):
                    slip[c, a] += rule.first[0, j] / h * x[j, c, a]
            for end in range(2):
                for j in range(p):
                    weight = rule.first[end * s, j] / h
                    for k in range(rest):
                        speeds[e, end, c, k] += weight * x[j, c, m + k]
            for a in range(m):
                for k in range(rest):
                    speeds[e, 0, c, k] += swing[e, 0] * soft[0, k] * parts.across[a, k] * slip[c, a]
    return out, ends, speeds, change, slowest


@kernel
def _untold_of(r: Array, second: Array, parts: Parts, soft: Array, square: float, out: Array) -> None:
    """What is read (points, columns, 2) of the inertia of the rest's part that is not told to the series, of which
    ``second`` makes the second derivative; added to ``out``, in elements of width^2 ``square``."""
    p, columns, rest = r.shape
    bent = np.dot(second, r.reshape(p, columns * rest)).reshape(p * columns, rest)
    inertia = np.dot(bent, parts.inert).reshape(p, columns, rest)
    for i in range(p):
        for c in range(columns):
            for q in range(2):
                for k in range(rest):
                    share = parts.read[q, parts.slowness.size + k] * soft[i, k]
                    out[i, c, q] += share * inertia[i, c, k] / square


@kernel
def _speeds_of(change: Array, first: Array, turns: float, out: Array) -> None:
    """At an element's two ends, in which the slowest fast mode turns by so many radians: the amplitudes of what rings
    by a change of the speed, (2, columns, 2), from that of what is read (points, columns, 2). A mode that hardly turns
    is hardly kept apart by the two ends, of which one takes back what the other gives."""
    p, columns, _ = change.shape
    for end in range(2):
        for c in range(columns):
            for q in range(2):
                out[end, c, q] = 0.0
                for j in range(p):
                    out[end, c, q] += first[end * (p - 1), j] / max(turns, 1.0) * change[j, c, q]


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
