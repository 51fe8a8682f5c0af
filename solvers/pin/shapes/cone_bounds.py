"""Upper bound of the bore volume over boxes of cones, and branch and bound with it.

A shape that is wider everywhere has a smaller maximum size and a greater volume for a given size. So over a box of
(r, c) the size at one corner and the relative volume at the opposite one bound the bore's volume, with an error of
first order in the box's width. A second bound has an error of second order:

With s_k(r, c) the maximum size allowed by one constraint (a station's strength, the deflection, the slope) and h the
relative volume of a shape, no bore's volume exceeds s_k^2 h for any k, hence not any weighted geometric mean of two of
them. Over a box the mean value theorem bounds its logarithm F = sum w_k F_k by F at the centre plus half the box's
sides times the maxima of |dF/dr| and |dF/dc|, whose ranges follow from the constraints. Where two constraints meet in a
ridge, the optimal weight cancels the slope at the best shape, and the bound's error decreases with the square of the
width.

With d_i = s f_i the bore at station i and g_i > 0 the deflection's derivative in it, the implicit function theorem
gives d(ln s)/dr = -sum g_i (df_i/dr) / sum g_i f_i, all terms of one sign; likewise in c.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.pin.shapes.cone_sizes import (
    SIZE_TOLERANCE,
    HalfBar,
    bore_volume,
    corner_range,
    greatest_size_for_deflection,
    pattern_search,
    size_for_deflection,
    size_for_strength,
    split_panels,
    workspace,
)
from solvers.pin.shapes.tapers import relative_bore, taper_fraction, unit_volume, unit_volume_slopes

Slopes = tuple[float, float, float, float]
"""Ranges of d(ln size)/dr and d(ln size)/dc in a box."""
_ROUNDING = 1e-14
_MAX_CONSTRAINTS = 7
_MAX_ASPECT = 16.0
"""Ratio of a box's sides above which the longer one is halved."""
_COARSE = 1e-4
"""Relative width of the size's bracket where it serves only to bound derivatives."""


@kernel
def _range_at(direction: int, c0: float, c1: float, t: float) -> Slopes:
    """Return for c in [c0, c1] the ranges of p and |dp/dc| at t; the latter includes both sides of the kink at c."""
    c_narrow, c_wide = (c0, c1) if direction > 0 else (c1, c0)
    steepest, longest = 0.0, max(c0, t)
    if t <= c1:
        steepest = t / (longest * longest)
    least, most = taper_fraction(direction, c_wide, t), taper_fraction(direction, c_narrow, t)
    return least, most, t / (c1 * c1) if t < c0 else 0.0, steepest


@kernel
def station_slopes(direction: int, r0: float, r1: float, c0: float, c1: float, t: float) -> Slopes:
    """Return the ranges of the derivatives of ln s = ln bore - ln f(t), s being the size allowed by one station's
    strength."""
    least, most, gentlest, steepest = _range_at(direction, c0, c1, t)
    low, high = 1.0 - (1.0 - r0) * most, 1.0 - (1.0 - r1) * least
    if low <= 0.0:
        return -np.inf, np.inf, -np.inf, np.inf
    greatest_rate, least_rate = (1.0 - r0) * steepest / low, (1.0 - r1) * gentlest / high
    if direction > 0:
        return -most / low, -least / high, -greatest_rate, -least_rate
    return -most / low, -least / high, least_rate, greatest_rate


@kernel
def deflection_slopes(
    bar: HalfBar, direction: int, r0: float, r1: float, c0: float, c1: float, least: float, most: float, work: Array
) -> Slopes:  # fmt: skip
    """Return the ranges of the derivatives of ln s, s being the size allowed by the deflection limit, for s in [least,
    most]; infinite if a bore may reach the outer diameter."""
    r_low, r_high, c_low, c_high, f_low, f_high = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(split_panels(bar, c0, c1, work)):
        t, weight, bend, shear = work[0, i], work[1, i], work[2, i], work[3, i]
        if bend == 0.0 and shear == 0.0:
            continue
        p_least, p_most, gentlest, steepest = _range_at(direction, c0, c1, t)
        low, high = 1.0 - (1.0 - r0) * p_most, 1.0 - (1.0 - r1) * p_least
        d0, d1 = least * low, most * high
        if d1 >= 1.0:
            return -np.inf, np.inf, -np.inf, np.inf
        # -d(1/v)/du and -phi'(u), split into terms decreasing and increasing in u.
        u0, u1 = (1.0 - d1) * (1.0 + d1), (1.0 - d0) * (1.0 + d0)
        v0, v1 = 2.0 - u0, 2.0 - u1
        bend0, bend1 = 0.5 * (1.0 / (u1 * u1) - 1.0 / (v1 * v1)), 0.5 * (1.0 / (u0 * u0) - 1.0 / (v0 * v0))
        fall, b = bar.law.a + 0.25 * bar.law.b, bar.law.b
        rise0, rise1 = b * (1.0 / v0 - 0.25) / (v0 * v0), b * (1.0 / v1 - 0.25) / (v1 * v1)
        g0 = weight * d0 * (bend * bend0 + shear * (fall / (u1 * u1) + rise0))
        g1 = weight * d1 * (bend * bend1 + shear * (fall / (u0 * u0) + rise1))
        f_low += g0 * low
        f_high += g1 * high
        r_low += g0 * p_least
        r_high += g1 * p_most
        c_low += g0 * (1.0 - r1) * gentlest
        c_high += g1 * (1.0 - r0) * steepest
    if f_low <= 0.0:
        return -np.inf, np.inf, -np.inf, np.inf
    if direction > 0:
        return -r_high / f_low, -r_low / f_high, -c_high / f_low, -c_low / f_high
    return -r_high / f_low, -r_low / f_high, c_low / f_high, c_high / f_low


@kernel
def _critical_station(bar: HalfBar, direction: int, r: float, c: float) -> int:
    """Return the index of the station whose strength limits a shape's size."""
    best, at = np.inf, 0
    for i in range(bar.x.size):
        size = bar.bore[i] / relative_bore(direction, r, c, bar.x[i])
        if size < best:
            best, at = size, i
    return at


@kernel
def _add(constraints: Array, count: int, middle: float, slopes: Slopes) -> int:
    """Add a constraint (ln of its size at the centre, ranges of its derivatives); return the number of constraints."""
    low_r, high_r, low_c, high_c = slopes
    if not (math.isfinite(middle) and math.isfinite(low_r + high_r + low_c + high_c)):
        return count
    row = constraints[count]
    row[0], row[1], row[2], row[3], row[4] = middle, low_r, high_r, low_c, high_c
    return count + 1


@kernel
def box_constraints(
    bar: HalfBar, direction: int, r0: float, r1: float, c0: float, c1: float, size_tolerance: float, work: Array,
    constraints: Array,
) -> int:  # fmt: skip
    """Write the constraints that limit the size over a box: critical stations, slope, corner, deflection. Return their
    number."""
    r, c = 0.5 * (r0 + r1), 0.5 * (c0 + c1)
    c_narrow, c_wide = (c0, c1) if direction > 0 else (c1, c0)
    count, before = 0, (-1, -1)
    for r_at, c_at in ((r, c), (r0, c1), (r1, c0)):
        i = _critical_station(bar, direction, r_at, c_at)
        shape = relative_bore(direction, r, c, bar.x[i])
        if i != before[0] and i != before[1] and bar.bore[i] > 0.0 and shape > 0.0:
            slopes = station_slopes(direction, r0, r1, c0, c1, bar.x[i])
            count = _add(constraints, count, math.log(bar.bore[i] / shape), slopes)
        before = i, before[0]
    if bar.slope_coefficient < np.inf and r1 < 1.0:
        slopes = 1.0 / (1.0 - r0), 1.0 / (1.0 - r1), 1.0 / c1, 1.0 / c0
        count = _add(constraints, count, math.log(bar.slope_coefficient * c / (1.0 - r)), slopes)
    _, at_corner, least_rate, greatest_rate = corner_range(bar, c0, c1)
    count = _add(constraints, count, at_corner, (0.0, 0.0, least_rate, greatest_rate))
    least = greatest_size_for_deflection(bar, direction, r1, c_wide, _COARSE, work)[0]
    most = greatest_size_for_deflection(bar, direction, r0, c_narrow, _COARSE, work)[1]
    if least > 0.0 and most < np.inf:
        slopes = deflection_slopes(bar, direction, r0, r1, c0, c1, least, most, work)
        size = greatest_size_for_deflection(bar, direction, r, c, size_tolerance, work)[1]
        count = _add(constraints, count, math.log(size), slopes)
    return count


@kernel
def _second_order(constraints: Array, half_r: float, half_c: float) -> tuple[float, float, float]:
    """Return the least bound of F from any one or two of the constraints F_k, and the contributions of r and c to it.

    The bound is convex and piecewise linear in the weight: its minimum is at an end or where a slope range changes
    the side that dominates, -low = high.
    """
    best, by_r, by_c = np.inf, 0.0, 0.0
    for k in range(constraints.shape[0]):
        for j in range(k, constraints.shape[0]):
            for side in (1, 3):
                mine = constraints[k, side] + constraints[k, side + 1]
                other, w = constraints[j, side] + constraints[j, side + 1], 1.0
                if j > k:
                    if not mine * other < 0.0:
                        continue
                    w = other / (other - mine)
                in_r = max(
                    -w * constraints[k, 1] - (1.0 - w) * constraints[j, 1],
                    w * constraints[k, 2] + (1.0 - w) * constraints[j, 2],
                    0.0,
                )
                in_c = max(
                    -w * constraints[k, 3] - (1.0 - w) * constraints[j, 3],
                    w * constraints[k, 4] + (1.0 - w) * constraints[j, 4],
                    0.0,
                )
                bound = w * constraints[k, 0] + (1.0 - w) * constraints[j, 0] + half_r * in_r + half_c * in_c
                if bound < best:
                    best, by_r, by_c = bound, half_r * in_r, half_c * in_c
    return best, by_r, by_c


@kernel
def box_bound(
    bar: HalfBar, direction: int, r0: float, r1: float, c0: float, c1: float, size_tolerance: float, work: Array
) -> tuple[float, bool]:  # fmt: skip
    """Return an upper bound of the bore volume over a box, and whether to halve the box in r rather than in c.

    ``size_tolerance``: relative width of the size's bracket at the box's centre.
    """
    c_narrow, c_wide = (c0, c1) if direction > 0 else (c1, c0)
    size = min(size_for_strength(bar, direction, r0, c_narrow), corner_range(bar, c0, c1)[0])
    if r1 < 1.0:
        # The slope limit relaxes with r and c.
        size = min(size, bar.slope_coefficient * c1 / (1.0 - r1))
    most_size = size_for_deflection(bar, direction, r0, c_narrow, size, _COARSE, work)[1]
    first_order = most_size**2 * unit_volume(direction, r1, c_wide)
    constraints, half_r, half_c = np.empty((_MAX_CONSTRAINTS, 5)), 0.5 * (r1 - r0), 0.5 * (c1 - c0)
    count = box_constraints(bar, direction, r0, r1, c0, c1, size_tolerance, work, constraints)
    volume_slopes = unit_volume_slopes(direction, r0, r1, c0, c1)
    at_centre = math.log(unit_volume(direction, 0.5 * (r0 + r1), 0.5 * (c0 + c1)))
    for k in range(count):
        constraints[k, 0] = 2.0 * constraints[k, 0] + at_centre
        for side in range(4):
            constraints[k, 1 + side] = 2.0 * constraints[k, 1 + side] + volume_slopes[side]
    best, by_r, by_c = _second_order(constraints[:count], half_r, half_c)
    halve_r = by_r >= by_c
    if max(half_r, half_c) > _MAX_ASPECT * min(half_r, half_c):
        # A constraint critical only at the best shape of a long box is missing from its bound.
        halve_r = half_r > half_c
    return min(first_order, math.exp(min(best, 700.0)) * (1.0 + _ROUNDING)), halve_r


@kernel
def branch_and_bound(
    bar: HalfBar, direction: int, c_low: float, gap: float, most_boxes: int, start: Array, known: float
) -> tuple[tuple[float, float, float], float, int]:  # fmt: skip
    """Return (best shape, upper bound of every bore's volume, boxes examined) by best-first branch and bound.

    ``start`` is an initial shape: bore volume, r and c. Stops once no box can exceed ``known``, the volume of another
    bore.
    """
    work, boxes, count, examined = workspace(bar), np.empty((most_boxes + 2, 6)), 1, 0
    best, size_tolerance, single = (start[0], start[1], start[2]), SIZE_TOLERANCE * gap, np.empty((2, 1))
    boxes[0, 1], boxes[0, 2], boxes[0, 3], boxes[0, 4] = 0.0, 1.0, c_low, 1.0
    boxes[0, 0], boxes[0, 5] = box_bound(bar, direction, 0.0, 1.0, c_low, 1.0, size_tolerance, work)
    bound = boxes[0, 0]
    while count > 0:
        top = 0
        for k in range(count):
            top = k if boxes[k, 0] > boxes[top, 0] else top
        bound, reached = boxes[top, 0], max(best[0], known)
        if bound - reached <= gap * (1.0 - reached) or examined == most_boxes:
            break
        examined += 1
        r0, r1, c0, c1, halve_r = boxes[top, 1], boxes[top, 2], boxes[top, 3], boxes[top, 4], boxes[top, 5]
        r, c = 0.5 * (r0 + r1), 0.5 * (c0 + c1)
        count -= 1
        for column in range(6):
            boxes[top, column] = boxes[count, column]
        if bore_volume(bar, direction, r, c, size_tolerance, work) > best[0]:
            single[0, 0], single[1, 0] = r, c
            trial = pattern_search(bar, direction, single[0], single[1], c_low, gap, work)
            best = trial if trial[0] > best[0] else best
        for half in range(2):
            child = boxes[count]
            child[1], child[2], child[3], child[4] = r0, r1, c0, c1
            child[(2 if half == 0 else 1) + (0 if halve_r > 0.0 else 2)] = r if halve_r > 0.0 else c
            child[0], child[5] = box_bound(
                bar, direction, child[1], child[2], child[3], child[4], size_tolerance, work
            )  # fmt: skip
            if child[0] > max(best[0], known):
                count += 1
    return best, max(bound if count > 0 else 0.0, best[0], known), examined
