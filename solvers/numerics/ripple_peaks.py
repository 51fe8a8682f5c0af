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
from solvers.numerics.panels import Rule, greatest, maximum_and_jump, panel_error, slopes_of
from solvers.numerics.ripple import KINDS, TURN, Ripple, element_at, modes_at, tabulate

_MARGIN = 1.2
"""Safety factor on the second derivative of f, sampled at a panel's points."""
_SINGLE_MAXIMUM_PHASE = 0.5
"""Rotation of the fastest mode in half an interval that guarantees at most one maximum [rad]."""
_NEGLIGIBLE = 0.3
"""Fraction of the tolerance for omitting the fastest modes."""
_DRIFT = 0.1
"""Relative change of a mode's amplitude per radian of rotation."""
_STACK_SIZE = 200
_MOST_STEPS = 30
_RELATIVE_OFFSET, _LEAST_OFFSET = 1e-9, 1e-14
"""Offset from an end for looking up its element: relative to a panel, and minimum in radians."""
_EPS = float(np.finfo(float).eps)


class _Location(NamedTuple):
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
    interpolated: Array
    z: Array


@fusing_kernel
def _value_and_slope(
    rule: Rule, ripple: Ripple, at: _Location, sign: float, x: float
) -> tuple[float, float, float, float]:
    """f, its slope, and the modes' part of both at x, times ``sign``; leaves Z in the workspace."""
    u = (x - at.middle) / at.half
    denominator, value, slope, node = 0.0, 0.0, 0.0, -1
    for j in range(rule.points.size):
        distance = u - rule.points[j]
        if distance == 0.0:
            node = j
            distance = 1.0
        weight = rule.weights[j] / distance
        denominator += weight
        value += weight * at.f[j]
        slope += weight * at.slope[j]
    if node >= 0:
        value, slope, denominator = at.f[node], at.slope[node], 1.0
    ripple_value, ripple_slope = modes_at(ripple, at.e, x + at.shift, at.table, at.share, at.interpolated, at.z)
    return sign * value / denominator, sign * slope / denominator, sign * ripple_value, sign * ripple_slope


@fusing_kernel
def _largest_real_part(real: float, imag: float, rotation: float, bound: float) -> float:
    """Maximum real part of z exp(i t), |t| <= rotation; ``bound`` if that is too far to know |z|."""
    if rotation >= 0.5 * math.pi:
        return bound
    c, s, imag = math.cos(rotation), math.sin(rotation), abs(imag)
    ahead = imag * c - real * s
    # whether the rotation crosses the real axis
    return (math.hypot(real, imag) if ahead <= 0.0 and real > 0.0 else real * c + imag * s) + _DRIFT * rotation * bound


@fusing_kernel
def _single_maximum(
    rule: Rule, ripple: Ripple, at: _Location, sign: float, a: float, b: float, tolerance: float
) -> tuple[float, float]:
    """Maximum and its angle in an interval with at most one maximum."""
    f, df, g, dg = _value_and_slope(rule, ripple, at, sign, a)
    left, best, x = df + dg, f + g, a
    f, df, g, dg = _value_and_slope(rule, ripple, at, sign, b)
    right = df + dg
    if f + g > best:
        best, x = f + g, b
    if not (left > 0.0 and right < 0.0):
        return best, x
    curvature = (left - right) / (b - a)
    for _ in range(_MOST_STEPS):
        middle = b - right * (b - a) / (right - left)
        f, df, g, dg = _value_and_slope(rule, ripple, at, sign, middle)
        slope = df + dg
        if f + g > best:
            best, x = f + g, middle
        # a value misses the maximum by slope^2 / (2 |second derivative|)
        if slope * slope <= tolerance * curvature or abs(b - a) <= 8.0 * _EPS * TURN:
            break
        if slope * right < 0.0:
            a, left = b, right
        else:
            left *= 0.5
        b, right = middle, slope
    return best, x


@fusing_kernel
def greatest_with_ripple(
    edges: Array, rule: Rule, f: Array, sign: float, tolerance: float, ripple: Ripple, weights: Array, bounds: Array
) -> tuple[float, float, float]:
    """Maximum of sign F over the revolution, its error bound, and its angle; ``tolerance`` is absolute, ``bounds``
    are those of the weights (``amplitude_bounds``)."""
    best, error_found, where = greatest(edges, rule, f, sign, tolerance)
    elements, modes = bounds.shape
    # omit the fastest modes if their total amplitude is small
    omitted = 0.0
    while modes > 0:
        largest = 0.0
        for e in range(elements):
            largest = max(largest, bounds[e, modes - 1])
        if omitted + largest > _NEGLIGIBLE * tolerance:
            break
        omitted += largest
        modes -= 1
    if modes == 0:
        return best, error_found + omitted, where
    n, p = rule.points.size, ripple.points.size
    total_bound, ripple_curvature, highest_frequency = np.zeros(elements), np.zeros(elements), np.zeros(elements)
    for e in range(elements):
        for k in range(modes):
            total_bound[e] += bounds[e, k]
            ripple_curvature[e] += bounds[e, k] * (ripple.frequency[e, k] + 1.0) ** 2
            highest_frequency[e] = max(highest_frequency[e], ripple.frequency[e, k])
    table, interpolated, z = np.empty((p, KINDS * modes)), np.empty(KINDS * modes), np.empty((2, modes))
    share, slope, curvature, concavity = np.empty(p), np.empty(n), np.empty(n), np.empty(n)
    stack, enough = np.empty((_STACK_SIZE, 2)), 0.5 * tolerance
    # start with the panel of the smooth part's maximum: a good value excludes most others
    first = min(max(np.searchsorted(edges, where, side="right"), 1), edges.size - 1) - 1
    smooth_angle, best_panel, tabulated = where, first, -1
    greatest_bound = total_bound.max()
    best -= greatest_bound
    for order in range(edges.size - 1):
        panel = first if order == 0 else order - 1 if order <= first else order
        g = f[panel * n : (panel + 1) * n]
        highest, jump = maximum_and_jump(g, sign)
        if highest + 0.5 * jump + greatest_bound <= best + enough:
            continue
        middle, half = 0.5 * (edges[panel] + edges[panel + 1]), 0.5 * (edges[panel + 1] - edges[panel])
        has_bounds, begin, offset = False, edges[panel], max(_RELATIVE_OFFSET * half, _LEAST_OFFSET)
        while begin < edges[panel + 1] - offset:
            # the part of the panel within one element
            inner = begin + offset
            position = inner - math.floor((inner - ripple.edges[0]) / TURN) * TURN
            e = element_at(ripple, position)
            start, end = begin, min(edges[panel + 1], inner + max(ripple.edges[e + 1] - position, 0.0))
            begin = end
            if highest + 0.5 * jump + total_bound[e] <= best + enough:
                continue
            if not has_bounds:
                _derivative_bounds(g, sign, half, rule, slope, curvature, concavity)
                has_bounds = True
            for j in range(n - 1):
                low, high = middle + half * rule.points[j], middle + half * rule.points[j + 1]
                upper = max(sign * g[j], sign * g[j + 1]) + 0.125 * curvature[j] * (high - low) ** 2
                if high <= start or low >= end or upper + total_bound[e] <= best + enough:
                    continue
                if tabulated != e:
                    tabulate(ripple, weights, e, modes, table)
                    tabulated = e
                at = _Location(g, slope, middle, half, e, position - inner, table, share, interpolated, z)
                if concavity[j] > ripple_curvature[e]:
                    # concave including all modes: a single maximum
                    low, high = max(low, start), min(high, end)
                    found, angle = _single_maximum(rule, ripple, at, sign, low, high, 0.1 * tolerance)
                    if found > best:
                        best, where, best_panel = found, angle, panel
                    continue
                stack[0, 0], stack[0, 1] = max(low, start), min(high, end)
                count = 1
                while count > 0:
                    count -= 1
                    low, high = stack[count, 0], stack[count, 1]
                    x, r = 0.5 * (low + high), 0.5 * (high - low)
                    value, smooth_slope, ripple_value, ripple_slope = _value_and_slope(rule, ripple, at, sign, x)
                    if value + ripple_value > best:
                        best, where, best_panel = value + ripple_value, x, panel
                    total_slope, total_curvature = smooth_slope + ripple_slope, curvature[j] + ripple_curvature[e]
                    taylor_bound = value + ripple_value + abs(total_slope) * r + 0.5 * total_curvature * r * r
                    if taylor_bound <= best + enough:
                        continue
                    amplitude_bound = value + abs(smooth_slope) * r + 0.5 * curvature[j] * r * r
                    for k in range(modes):
                        rotation = ripple.frequency[e, k] * r
                        amplitude_bound += _largest_real_part(sign * z[0, k], z[1, k], rotation, bounds[e, k])
                    if amplitude_bound <= best + enough:
                        continue
                    if highest_frequency[e] * r <= _SINGLE_MAXIMUM_PHASE or count + 2 > _STACK_SIZE:
                        found, angle = _single_maximum(rule, ripple, at, sign, low, high, 0.1 * tolerance)
                        if found > best:
                            best, where, best_panel = found, angle, panel
                        continue
                    # the half closer to the smooth part's maximum first
                    closer = 1 if x < smooth_angle else 0
                    stack[count + closer, 0], stack[count + closer, 1] = x, high
                    stack[count + 1 - closer, 0], stack[count + 1 - closer, 1] = low, x
                    count += 2
    error = panel_error(f[best_panel * n : (best_panel + 1) * n], rule)
    return best, error + omitted + enough + 4.0 * _EPS * abs(best), where


@fusing_kernel
def _derivative_bounds(
    g: Array, sign: float, half: float, rule: Rule, slope: Array, curvature: Array, concavity: Array
) -> None:
    """Slopes of a panel's polynomial at its points with respect to the angle; and, for each, bounds on the second
    derivative and on the distance over which ``sign`` f is concave."""
    n = g.size
    second = np.empty(n)
    slopes_of(g, rule, slope)
    slope /= half
    slopes_of(slope, rule, second)
    second *= -sign / half
    for j in range(n):
        largest, smallest = abs(second[j]), second[j]
        for k in range(max(j - 1, 0), min(j + 3, n)):
            largest, smallest = max(largest, abs(second[k])), min(smallest, second[k])
        curvature[j], concavity[j] = _MARGIN * largest, smallest / _MARGIN
