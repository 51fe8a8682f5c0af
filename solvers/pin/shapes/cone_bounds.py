"""Upper bound of the bore volume over boxes of cones, and branch and bound with it.

For a shape that is wider everywhere the maximum size is smaller and the volume per size greater: on a box of (r, c)
the size at one corner and the shape at the opposite one bound the bore's volume, to first order in the box's width.
A second bound has second order:

With s_k(r, c) the maximum size allowed by one rule (a station's strength, the deflection, the slope), no shape
exceeds s_k^2 hollow for any k, hence not any weighted geometric mean of two of them. Over a box the mean value
theorem bounds its logarithm F = sum w_k F_k by F at the centre plus half the box's sides times the maxima of |dF/dr|
and |dF/dc|, whose ranges follow from the rules. Where two rules meet in a ridge, the optimal weight cancels the
slope at the best shape, and the excess of the bound decreases with the square of the width.

With d_i = s f_i the bore at station i and g_i > 0 the deflection's derivative in it, the implicit function theorem
gives d(ln s)/dr = -sum g_i (df_i/dr) / sum g_i f_i, all terms of one sign; likewise in c.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.shapes.cone_sizes import (
    FINE,
    Bar,
    bore_volume,
    climb,
    corner_range,
    split,
    stiff_size,
    stiffest,
    strong_size,
    workspace,
)
from solvers.pin.shapes.tapers import completed, hollow, hollow_slopes, relative_bore

Array = NDArray[np.float64]
Slopes = tuple[float, float, float, float]
"""Ranges of d(ln size)/dr and d(ln size)/dc in a box."""
_ROUNDING = 1e-14
_RULES = 7
_COARSE = 1e-4
"""Relative width of the size's bracket where only ranges follow from it."""


@kernel
def _range_at(turn: int, c0: float, c1: float, t: float) -> Slopes:
    """Return at position t for c in [c0, c1]: minimum and maximum p, and minimum and maximum |dp/dc|.

    p has a kink where the cone ends; the slope range there includes both sides.
    """
    near, far = (c0, c1) if turn > 0 else (c1, c0)
    steepest, longest = 0.0, max(c0, t)
    if t <= c1:
        steepest = t / (longest * longest)
    return completed(turn, far, t), completed(turn, near, t), t / (c1 * c1) if t < c0 else 0.0, steepest


@kernel
def station_slopes(turn: int, r0: float, r1: float, c0: float, c1: float, t: float) -> Slopes:
    """Slopes of ln s = ln bore - ln f(t), s being the size that the strength allows at one station."""
    least, most, gentlest, steepest = _range_at(turn, c0, c1, t)
    low, high = 1.0 - (1.0 - r0) * most, 1.0 - (1.0 - r1) * least
    if low <= 0.0:
        return -np.inf, np.inf, -np.inf, np.inf
    fast, slow = (1.0 - r0) * steepest / low, (1.0 - r1) * gentlest / high
    if turn > 0:
        return -most / low, -least / high, -fast, -slow
    return -most / low, -least / high, slow, fast


@kernel
def deflection_slopes(
    bar: Bar, turn: int, r0: float, r1: float, c0: float, c1: float, least: float, most: float, work: Array
) -> Slopes:  # fmt: skip
    """Slopes of ln s under the deflection limit, for a size s in [least, most]; infinite if a bore may reach the outer
    diameter."""
    r_low, r_high, c_low, c_high, f_low, f_high = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(split(bar, c0, c1, work)):
        t, share, bend, shear = work[0, i], work[1, i], work[2, i], work[3, i]
        if bend == 0.0 and shear == 0.0:
            continue
        p_least, p_most, gentlest, steepest = _range_at(turn, c0, c1, t)
        low, high = 1.0 - (1.0 - r0) * p_most, 1.0 - (1.0 - r1) * p_least
        d0, d1 = least * low, most * high
        if d1 >= 1.0:
            return -np.inf, np.inf, -np.inf, np.inf
        # -d(1/v)/du and -phi'(u), split into terms decreasing and increasing in u.
        u0, u1 = (1.0 - d1) * (1.0 + d1), (1.0 - d0) * (1.0 + d0)
        v0, v1 = 2.0 - u0, 2.0 - u1
        bend0, bend1 = 0.5 * (1.0 / (u1 * u1) - 1.0 / (v1 * v1)), 0.5 * (1.0 / (u0 * u0) - 1.0 / (v0 * v0))
        fall = bar.a + 0.25 * bar.b
        rise0, rise1 = bar.b * (1.0 / v0 - 0.25) / (v0 * v0), bar.b * (1.0 / v1 - 0.25) / (v1 * v1)
        g0 = share * d0 * (bend * bend0 + shear * (fall / (u1 * u1) + rise0))
        g1 = share * d1 * (bend * bend1 + shear * (fall / (u0 * u0) + rise1))
        f_low += g0 * low
        f_high += g1 * high
        r_low += g0 * p_least
        r_high += g1 * p_most
        c_low += g0 * (1.0 - r1) * gentlest
        c_high += g1 * (1.0 - r0) * steepest
    if f_low <= 0.0:
        return -np.inf, np.inf, -np.inf, np.inf
    if turn > 0:
        return -r_high / f_low, -r_low / f_high, -c_high / f_low, -c_low / f_high
    return -r_high / f_low, -r_low / f_high, c_low / f_high, c_high / f_low


@kernel
def _weakest(bar: Bar, turn: int, r: float, c: float) -> int:
    """Return the station whose strength limits a shape's size."""
    best, at = np.inf, 0
    for i in range(bar.x.size):
        size = bar.bore[i] / relative_bore(turn, r, c, bar.x[i])
        if size < best:
            best, at = size, i
    return at


@kernel
def _add(rules: Array, count: int, middle: float, slopes: Slopes) -> int:
    """Add a rule: ln of the size it allows at the box's centre, and its ranges; return the number of rules."""
    low_r, high_r, low_c, high_c = slopes
    if not (math.isfinite(middle) and math.isfinite(low_r + high_r + low_c + high_c)):
        return count
    rules[count, 0] = middle
    rules[count, 1], rules[count, 2], rules[count, 3], rules[count, 4] = low_r, high_r, low_c, high_c
    return count + 1


@kernel
def rules_of(
    bar: Bar, turn: int, r0: float, r1: float, c0: float, c1: float, fine: float, work: Array, rules: Array
) -> int:  # fmt: skip
    """Write the rules that limit a box's shapes: stations critical for some shape, slope, corner, deflection."""
    r, c = 0.5 * (r0 + r1), 0.5 * (c0 + c1)
    near, far = (c0, c1) if turn > 0 else (c1, c0)
    count, before = 0, (-1, -1)
    for i in (_weakest(bar, turn, r, c), _weakest(bar, turn, r0, c1), _weakest(bar, turn, r1, c0)):
        shape = relative_bore(turn, r, c, bar.x[i])
        if i != before[0] and i != before[1] and bar.bore[i] > 0.0 and shape > 0.0:
            count = _add(
                rules, count, math.log(bar.bore[i] / shape), station_slopes(turn, r0, r1, c0, c1, bar.x[i])
            )  # fmt: skip
        before = i, before[0]
    if bar.steep < np.inf and r1 < 1.0:
        slopes = 1.0 / (1.0 - r0), 1.0 / (1.0 - r1), 1.0 / c1, 1.0 / c0
        count = _add(rules, count, math.log(bar.steep * c / (1.0 - r)), slopes)
    _, at_corner, slow, fast = corner_range(bar, c0, c1)
    count = _add(rules, count, at_corner, (0.0, 0.0, slow, fast))
    least = stiffest(bar, turn, r1, far, _COARSE, work)[0]
    most = stiffest(bar, turn, r0, near, _COARSE, work)[1]
    if least > 0.0 and most < np.inf:
        slopes = deflection_slopes(bar, turn, r0, r1, c0, c1, least, most, work)
        count = _add(rules, count, math.log(stiffest(bar, turn, r, c, fine, work)[1]), slopes)
    return count


@kernel
def _second_order(rules: Array, half_r: float, half_c: float) -> tuple[float, float, float]:
    """Return the least bound of F from any one or two of the rules F_k, and its parts that r and c contribute.

    The bound is convex and piecewise linear in the weight: its minimum is at an end or where a slope range changes
    the side that dominates, -low = high.
    """
    best, by_r, by_c = np.inf, 0.0, 0.0
    for k in range(rules.shape[0]):
        for j in range(k, rules.shape[0]):
            for side in (1, 3):
                mine, other = rules[k, side] + rules[k, side + 1], rules[j, side] + rules[j, side + 1]
                w = 1.0
                if j > k:
                    if not mine * other < 0.0:
                        continue
                    w = other / (other - mine)
                in_r = max(-w * rules[k, 1] - (1.0 - w) * rules[j, 1], w * rules[k, 2] + (1.0 - w) * rules[j, 2], 0.0)
                in_c = max(-w * rules[k, 3] - (1.0 - w) * rules[j, 3], w * rules[k, 4] + (1.0 - w) * rules[j, 4], 0.0)
                bound = w * rules[k, 0] + (1.0 - w) * rules[j, 0] + half_r * in_r + half_c * in_c
                if bound < best:
                    best, by_r, by_c = bound, half_r * in_r, half_c * in_c
    return best, by_r, by_c


@kernel
def most_in_box(
    bar: Bar, turn: int, r0: float, r1: float, c0: float, c1: float, fine: float, work: Array
) -> tuple[float, bool]:  # fmt: skip
    """Return an upper bound of the bore volume over a box, and whether halving r improves it more than halving c.

    ``fine``: relative width of the size's bracket in the middle.
    """
    near, far = (c0, c1) if turn > 0 else (c1, c0)
    size = min(strong_size(bar, turn, r0, near), corner_range(bar, c0, c1)[0])
    if r1 < 1.0:
        # The slope limit relaxes with r and c.
        size = min(size, bar.steep * c1 / (1.0 - r1))
    first = stiff_size(bar, turn, r0, near, size, _COARSE, work)[1] ** 2 * hollow(turn, r1, far)
    rules, half_r, half_c = np.empty((_RULES, 5)), 0.5 * (r1 - r0), 0.5 * (c1 - c0)
    count = rules_of(bar, turn, r0, r1, c0, c1, fine, work, rules)
    own, at = hollow_slopes(turn, r0, r1, c0, c1), math.log(hollow(turn, 0.5 * (r0 + r1), 0.5 * (c0 + c1)))
    for k in range(count):
        rules[k, 0] = 2.0 * rules[k, 0] + at
        for side in range(4):
            rules[k, 1 + side] = 2.0 * rules[k, 1 + side] + own[side]
    best, by_r, by_c = _second_order(rules[:count], half_r, half_c)
    return min(first, math.exp(min(best, 700.0)) * (1.0 + _ROUNDING)), by_r >= by_c


@kernel
def branch_and_bound(
    bar: Bar, turn: int, c_low: float, gap: float, most_boxes: int, start: Array, known: float
) -> tuple[tuple[float, float, float], float, int]:  # fmt: skip
    """Return (best shape, upper bound of every bore's volume, boxes examined) by best-first branch and bound.

    ``start`` is an initial shape: bore volume, r and c. Stops once no box can exceed ``known``, the volume of another
    bore.
    """
    work, boxes, count, looked = workspace(bar), np.empty((most_boxes + 2, 6)), 1, 0
    best, fine, single = (start[0], start[1], start[2]), FINE * gap, np.empty((2, 1))
    boxes[0, 1], boxes[0, 2], boxes[0, 3], boxes[0, 4] = 0.0, 1.0, c_low, 1.0
    boxes[0, 0], boxes[0, 5] = most_in_box(bar, turn, 0.0, 1.0, c_low, 1.0, fine, work)
    bound = boxes[0, 0]
    while count > 0:
        top = 0
        for k in range(count):
            top = k if boxes[k, 0] > boxes[top, 0] else top
        bound, reached = boxes[top, 0], max(best[0], known)
        if bound - reached <= gap * (1.0 - reached) or looked == most_boxes:
            break
        looked += 1
        r0, r1, c0, c1, across = boxes[top, 1], boxes[top, 2], boxes[top, 3], boxes[top, 4], boxes[top, 5]
        r, c = 0.5 * (r0 + r1), 0.5 * (c0 + c1)
        count -= 1
        for column in range(6):
            boxes[top, column] = boxes[count, column]
        if bore_volume(bar, turn, r, c, fine, work) > best[0]:
            single[0, 0], single[1, 0] = r, c
            trial = climb(bar, turn, single[0], single[1], c_low, gap, work)
            best = trial if trial[0] > best[0] else best
        for half in range(2):
            own = boxes[count]
            own[1], own[2], own[3], own[4] = r0, r1, c0, c1
            own[(2 if half == 0 else 1) + (0 if across > 0.0 else 2)] = r if across > 0.0 else c
            own[0], own[5] = most_in_box(bar, turn, own[1], own[2], own[3], own[4], fine, work)
            if own[0] > max(best[0], known):
                count += 1
    return best, max(bound if count > 0 else 0.0, best[0], known), looked
