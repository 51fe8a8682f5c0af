"""The greatest value over one turn of a function that ripples.

    F(x) = f(x) + Re sum_n Z_n(x)

f is a polynomial on every panel (``solvers.numerics.panels``), the modes are those of ``solvers.numerics.ripple``. The
greatest F is looked for by halving intervals and leaving out those that cannot hold it. In an interval of half width r
about m, with the modes' frequencies w_n,

    F <= F(m) + |F'(m)| r + (max|f''| + sum |Z_n| w_n^2) r^2/2
    F <= max f + sum max Re(Z_n(m) exp(i t)),  |t| <= w_n r

the former close where no mode turns far, the latter where they do. What the modes reach bounds from the start where the
greatest may be, so that a small ripple is looked at in narrow places alone.

Source: for the search, R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis (2009), chapter 5.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import fusing_kernel
from solvers.numerics.panels import Rule, greatest, panel_error, slopes_of
from solvers.numerics.ripple import KINDS, TURN, Ripple, element_at, modes_at, tabulate

Array = NDArray[np.float64]

_MARGIN = 1.2
"""On the bend of f, known at a panel's points."""
_ONE_TOP = 0.5
"""Radians of the fastest mode, in half an interval, that hold no more than one maximum."""
_NEGLIGIBLE = 0.3
"""Of the tolerance, that the fastest modes may be left out for."""
_DRIFT = 0.1
"""Of its reach, by which a mode's amplitude may change while it turns by a radian."""
_DEEPEST = 200
_MOST_STEPS = 30
_SLIGHTLY, _LEAST = 1e-9, 1e-14
"""Of a panel, and radians at the least: how far behind an end its element is looked up."""
_EPS = float(np.finfo(float).eps)


class _Place(NamedTuple):
    """What is read at one panel and element: values and slopes of f by the angle, the panel's middle and half width;
    element, what turns an angle into its place, its table, and room."""

    f: Array
    slope: Array
    middle: float
    half: float
    e: int
    shift: float
    table: Array
    share: Array
    room: Array
    z: Array


@fusing_kernel
def _both(rule: Rule, ripple: Ripple, at: _Place, sign: float, x: float) -> tuple[float, float, float, float]:
    """f, its slope, and what the modes add to both at the angle x, all times ``sign``; leaves Z in its room."""
    u = (x - at.middle) / at.half
    below, value, steep, exact = 0.0, 0.0, 0.0, -1
    for j in range(rule.points.size):
        apart = u - rule.points[j]
        if apart == 0.0:
            exact = j
            apart = 1.0
        share = rule.weights[j] / apart
        below += share
        value += share * at.f[j]
        steep += share * at.slope[j]
    if exact >= 0:
        value, steep, below = at.f[exact], at.slope[exact], 1.0
    ring, more = modes_at(ripple, at.e, x + at.shift, at.table, at.share, at.room, at.z)
    return sign * value / below, sign * steep / below, sign * ring, sign * more


@fusing_kernel
def _highest(real: float, imag: float, turn: float, reach: float) -> float:
    """The greatest real part of z exp(i t), |t| <= turn; ``reach`` where that is too far to know |z|."""
    if turn >= 0.5 * math.pi:
        return reach
    c, s, imag = math.cos(turn), math.sin(turn), abs(imag)
    ahead = imag * c - real * s
    # Whether the turn leads past the real axis.
    return (math.hypot(real, imag) if ahead <= 0.0 and real > 0.0 else real * c + imag * s) + _DRIFT * turn * reach


@fusing_kernel
def _top(
    rule: Rule, ripple: Ripple, at: _Place, sign: float, a: float, b: float, tolerance: float
) -> tuple[float, float]:
    """The greatest value and its angle in an interval that holds no more than one maximum."""
    f, df, g, dg = _both(rule, ripple, at, sign, a)
    left, best, x = df + dg, f + g, a
    f, df, g, dg = _both(rule, ripple, at, sign, b)
    right = df + dg
    if f + g > best:
        best, x = f + g, b
    if not (left > 0.0 and right < 0.0):
        return best, x
    bend = (left - right) / (b - a)
    for _ in range(_MOST_STEPS):
        middle = b - right * (b - a) / (right - left)
        f, df, g, dg = _both(rule, ripple, at, sign, middle)
        steep = df + dg
        if f + g > best:
            best, x = f + g, middle
        # A value misses its top by its slope squared over twice the bend.
        if steep * steep <= tolerance * bend or abs(b - a) <= 8.0 * _EPS * TURN:
            break
        if steep * right < 0.0:
            a, left = b, right
        else:
            left *= 0.5
        b, right = middle, steep
    return best, x


@fusing_kernel
def greatest_with_ripple(
    edges: Array, rule: Rule, f: Array, sign: float, tolerance: float, ripple: Ripple, weights: Array, reach: Array
) -> tuple[float, float, float]:
    """Greatest value of sign F over the turn, how far off it may be, and its angle; ``tolerance`` is absolute, and
    ``reach`` that of the weights (``reaches``)."""
    best, missed, where = greatest(edges, rule, f, sign, tolerance)
    elements, modes = reach.shape
    # The fastest modes may be left out where all of them do not reach far.
    left_out = 0.0
    while modes > 0:
        most = 0.0
        for e in range(elements):
            most = max(most, reach[e, modes - 1])
        if left_out + most > _NEGLIGIBLE * tolerance:
            break
        left_out += most
        modes -= 1
    if modes == 0:
        return best, missed + left_out, where
    n, p = rule.points.size, ripple.points.size
    tall, bends, pace = np.zeros(elements), np.zeros(elements), np.zeros(elements)
    for e in range(elements):
        for k in range(modes):
            tall[e] += reach[e, k]
            bends[e] += reach[e, k] * (ripple.pace[e, k] + 1.0) ** 2
            pace[e] = max(pace[e], ripple.pace[e, k])
    table, room, z = np.empty((p, KINDS * modes)), np.empty(KINDS * modes), np.empty((2, modes))
    share, slope, bend, domed = np.empty(p), np.empty(n), np.empty(n), np.empty(n)
    stack, enough = np.empty((_DEEPEST, 2)), 0.5 * tolerance
    # First the panel of the smooth part's own top, since what is found there leaves little to be looked at elsewhere.
    first = min(max(np.searchsorted(edges, where, side="right"), 1), edges.size - 1) - 1
    summit, top, tabulated = where, first, -1
    best -= tall.max()
    for turn in range(edges.size - 1):
        panel = first if turn == 0 else turn - 1 if turn <= first else turn
        g, middle, half = f[panel * n : (panel + 1) * n], 0.5 * (edges[panel] + edges[panel + 1]), 0.0
        half = 0.5 * (edges[panel + 1] - edges[panel])
        highest, jump = -np.inf, 0.0
        for j in range(n):
            highest = max(highest, sign * g[j])
            if j > 0:
                jump = max(jump, abs(g[j] - g[j - 1]))
        bent, begin, nudge = False, edges[panel], max(_SLIGHTLY * half, _LEAST)
        while begin < edges[panel + 1] - nudge:
            # The part of the panel that lies in one element.
            inner = begin + nudge
            place = inner - math.floor((inner - ripple.edges[0]) / TURN) * TURN
            e = element_at(ripple, place)
            start, end = begin, min(edges[panel + 1], inner + max(ripple.edges[e + 1] - place, 0.0))
            begin = end
            if highest + 0.5 * jump + tall[e] <= best + enough:
                continue
            if not bent:
                _bends(g, sign, half, rule, slope, bend, domed)
                bent = True
            for j in range(n - 1):
                low, high = middle + half * rule.points[j], middle + half * rule.points[j + 1]
                over = max(sign * g[j], sign * g[j + 1]) + 0.125 * bend[j] * (high - low) ** 2
                if high <= start or low >= end or over + tall[e] <= best + enough:
                    continue
                if tabulated != e:
                    tabulate(ripple, weights, e, modes, table)
                    tabulated = e
                at = _Place(g, slope, middle, half, e, place - inner, table, share, room, z)
                if domed[j] > bends[e]:
                    # Concave with all that rings: there is one maximum.
                    found, angle = _top(rule, ripple, at, sign, max(low, start), min(high, end), 0.1 * tolerance)
                    if found > best:
                        best, where, top = found, angle, panel
                    continue
                stack[0, 0], stack[0, 1] = max(low, start), min(high, end)
                count = 1
                while count > 0:
                    count -= 1
                    low, high = stack[count, 0], stack[count, 1]
                    x, r = 0.5 * (low + high), 0.5 * (high - low)
                    value, steep, ring, more = _both(rule, ripple, at, sign, x)
                    if value + ring > best:
                        best, where, top = value + ring, x, panel
                    close = value + ring + abs(steep + more) * r + 0.5 * (bend[j] + bends[e]) * r * r
                    if close <= best + enough:
                        continue
                    far = value + abs(steep) * r + 0.5 * bend[j] * r * r
                    for k in range(modes):
                        far += _highest(sign * z[0, k], z[1, k], ripple.pace[e, k] * r, reach[e, k])
                    if far <= best + enough:
                        continue
                    if pace[e] * r <= _ONE_TOP or count + 2 > _DEEPEST:
                        found, angle = _top(rule, ripple, at, sign, low, high, 0.1 * tolerance)
                        if found > best:
                            best, where, top = found, angle, panel
                        continue
                    # The half nearer to the smooth part's top is looked at first.
                    near = 1 if x < summit else 0
                    stack[count + near, 0], stack[count + near, 1] = x, high
                    stack[count + 1 - near, 0], stack[count + 1 - near, 1] = low, x
                    count += 2
    error = panel_error(f[top * n : (top + 1) * n], rule)
    return best, error + left_out + enough + 4.0 * _EPS * abs(best), where


@fusing_kernel
def _bends(g: Array, sign: float, half: float, rule: Rule, slope: Array, bend: Array, domed: Array) -> None:
    """Slopes of a panel's polynomial at its points, by the angle; behind each how much it may bend, and how far it is
    sure to be concave where ``sign`` times it is looked at."""
    n = g.size
    own = np.empty(n)
    slopes_of(g, rule, slope)
    slope /= half
    slopes_of(slope, rule, own)
    own *= -sign / half
    for j in range(n):
        most, least = abs(own[j]), own[j]
        for k in range(max(j - 1, 0), min(j + 3, n)):
            most, least = max(most, abs(own[k])), min(least, own[k])
        bend[j], domed[j] = _MARGIN * most, least / _MARGIN
