"""Maximum over one revolution of a function with ripple.

  F(x) = f(x) + Re sum_n Z_n(x)

f is a polynomial on every panel (``solvers.numerics.panels``), the modes are those of ``solvers.numerics.ripple``. The
maximum is found by branch and bound on intervals. In an interval of half width r about m, with the modes' frequencies
w_n,

  F <= F(m) + |F'(m)| r + (max|f''| + sum |Z_n| w_n^2) r^2/2
  F <= max f + sum max Re(Z_n(m) exp(i t)),  |t| <= w_n r

the former is sharp if no mode rotates far, the latter if they do. The modes' amplitude bounds restrict the location of
the maximum beforehand, so that a small ripple is examined only in narrow intervals.

Source: for the search, R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis (2009), chapter 5.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import fusing_kernel
from solvers.numerics.panels import Rule, greatest, panel_error, slopes_of
from solvers.numerics.ripple import KINDS, TURN, Ripple, element_at, modes_at, tabulate

_MARGIN = 1.2
"""Safety factor on the second derivative of f, sampled at a panel's points."""
_ONE_TOP = 0.5
"""Rotation of the fastest mode in half an interval that guarantees at most one maximum [rad]."""
_NEGLIGIBLE = 0.3
"""Fraction of the tolerance for omitting the fastest modes."""
_DRIFT = 0.1
"""Relative change of a mode's amplitude per radian of rotation."""
_DEEPEST = 200
_MOST_STEPS = 30
_SLIGHTLY, _LEAST = 1e-9, 1e-14
"""Offset from an end for looking up its element: relative to a panel, and minimum in radians."""
_EPS = float(np.finfo(float).eps)


class _Place(NamedTuple):
    """Data of one panel and element: values and slopes of f with respect to the angle, the panel's centre and half
    width; the element, the map from angle to position, its table, and workspace."""

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
    """f, its slope, and the modes' contribution to both at the angle x, all times ``sign``; leaves Z in the
    workspace."""
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
    """Maximum real part of z exp(i t), |t| <= turn; ``reach`` if that is too far to know |z|."""
    if turn >= 0.5 * math.pi:
        return reach
    c, s, imag = math.cos(turn), math.sin(turn), abs(imag)
    ahead = imag * c - real * s
    # whether the rotation crosses the real axis
    return (math.hypot(real, imag) if ahead <= 0.0 and real > 0.0 else real * c + imag * s) + _DRIFT * turn * reach


@fusing_kernel
def _top(
    rule: Rule, ripple: Ripple, at: _Place, sign: float, a: float, b: float, tolerance: float
) -> tuple[float, float]:
    """Maximum and its angle in an interval with at most one maximum."""
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
        # a value misses the maximum by slope^2 / (2 |second derivative|)
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
    """Maximum of sign F over the revolution, its error bound, and its angle; ``tolerance`` is absolute, ``reach`` is
    that of the weights (``reaches``)."""
    best, missed, where = greatest(edges, rule, f, sign, tolerance)
    elements, modes = reach.shape
    # omit the fastest modes if their total amplitude is small
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
    # start with the panel of the smooth part's maximum: a good value excludes most others
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
            # the part of the panel within one element
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
                    # concave including all modes: a single maximum
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
                    # the half closer to the smooth part's maximum first
                    near = 1 if x < summit else 0
                    stack[count + near, 0], stack[count + near, 1] = x, high
                    stack[count + 1 - near, 0], stack[count + 1 - near, 1] = low, x
                    count += 2
    error = panel_error(f[top * n : (top + 1) * n], rule)
    return best, error + left_out + enough + 4.0 * _EPS * abs(best), where


@fusing_kernel
def _bends(g: Array, sign: float, half: float, rule: Rule, slope: Array, bend: Array, domed: Array) -> None:
    """Slopes of a panel's polynomial at its points with respect to the angle; and, for each, bounds on the second
    derivative and on the distance over which ``sign`` f is concave."""
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
