"""Upper bound of the bore volume over a box of cones, to second order in the box's width.

With s_k(r, c) the maximum size allowed by one rule (a station's strength, the deflection, the slope), no shape
exceeds s_k^2 hollow for any k, hence not any weighted geometric mean of two of them. Over a box the mean value
theorem bounds its logarithm F = sum w_k F_k by F at the centre plus half the box's sides times the maxima of |dF/dr|
and |dF/dc|, whose ranges follow from the rules. Where two rules meet in a ridge, the optimal weight cancels the
slope at the best shape, and the excess of the bound decreases with the square of the width.

With d_i = s f_i the bore at station i and g_i > 0 the deflection's derivative in it, the implicit function theorem
gives d(ln s)/dr = -sum g_i (df_i/dr) / sum g_i f_i, all terms of one sign; likewise in c.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.shapes.tapers import Box, Taper, lost_range

Array = NDArray[np.float64]
_ROUNDING = 1e-14


@dataclass(frozen=True)
class Rule:
    """ln of the size one rule allows at a box's centre, and the ranges of d(ln size)/dr and d(ln size)/dc in the
    box."""

    middle: float
    slopes: Box


@kernel
def deflection_slopes(
    r0: float, r1: float, turn: float, least: float, most: float, lost_low: Array, lost_high: Array,
    gentlest: Array, steepest: Array, share: Array, bend: Array, shear: Array, a: float, b: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return the ranges of d(ln s)/dr and d(ln s)/dc of the size s in [least, most] under a deflection limit.

    ``turn`` is the sign of df/dc, the four arrays are those of ``tapers.lost_range``. Infinite ranges if a bore may
    reach the outer diameter.
    """
    r_low, r_high, c_low, c_high, f_low, f_high = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(share.size):
        if bend[i] == 0.0 and shear[i] == 0.0:
            continue
        low, high = 1.0 - (1.0 - r0) * lost_high[i], 1.0 - (1.0 - r1) * lost_low[i]
        d0, d1 = least * low, most * high
        if d1 >= 1.0:
            return -np.inf, np.inf, -np.inf, np.inf
        # -d(1/v)/du and -phi'(u), split into terms decreasing and increasing in u.
        u0, u1 = (1.0 - d1) * (1.0 + d1), (1.0 - d0) * (1.0 + d0)
        v0, v1 = 2.0 - u0, 2.0 - u1
        bend0, bend1 = 0.5 * (1.0 / (u1 * u1) - 1.0 / (v1 * v1)), 0.5 * (1.0 / (u0 * u0) - 1.0 / (v0 * v0))
        fall = a + 0.25 * b
        rise0, rise1 = b * (1.0 / v0 - 0.25) / (v0 * v0), b * (1.0 / v1 - 0.25) / (v1 * v1)
        g0 = share[i] * d0 * (bend[i] * bend0 + shear[i] * (fall / (u1 * u1) + rise0))
        g1 = share[i] * d1 * (bend[i] * bend1 + shear[i] * (fall / (u0 * u0) + rise1))
        f_low += g0 * low
        f_high += g1 * high
        r_low += g0 * lost_low[i]
        r_high += g1 * lost_high[i]
        c_low += g0 * (1.0 - r1) * gentlest[i]
        c_high += g1 * (1.0 - r0) * steepest[i]
    if f_low <= 0.0:
        return -np.inf, np.inf, -np.inf, np.inf
    if turn > 0.0:
        return -r_high / f_low, -r_low / f_high, -c_high / f_low, -c_low / f_high
    return -r_high / f_low, -r_low / f_high, c_low / f_high, c_high / f_low


def station_slopes(taper: Taper, box: Box, t: float) -> Box:
    """As ``deflection_slopes``, for ln s = ln bore - ln f(t), the size allowed by one station's strength."""
    r0, r1, c0, c1 = box
    lost_low, lost_high, gentlest, steepest = (float(x[0]) for x in lost_range(taper, np.array([t]), c0, c1))
    low, high = 1.0 - (1.0 - r0) * lost_high, 1.0 - (1.0 - r1) * lost_low
    if low <= 0.0:
        return -math.inf, math.inf, -math.inf, math.inf
    most, least = (1.0 - r0) * steepest / low, (1.0 - r1) * gentlest / high
    return -lost_high / low, -lost_low / high, *((-most, -least) if taper.turn > 0 else (least, most))


def second_order(taper: Taper, box: Box, rules: list[Rule]) -> float:
    """Return the least bound of s^2 hollow over the box from any one or two of the rules; infinite if none applies.

    The bound is convex and piecewise linear in the weight: its minimum is at an end or where a slope range changes
    the side that dominates.
    """
    r0, r1, c0, c1 = box
    half_r, half_c = 0.5 * (r1 - r0), 0.5 * (c1 - c0)
    own, at = taper.hollow_slopes(box), math.log(taper.hollow(0.5 * (r0 + r1), 0.5 * (c0 + c1)))
    pieces = [
        (2.0 * rule.middle + at, *(2.0 * mine + more for mine, more in zip(rule.slopes, own, strict=True)))
        for rule in rules
        if all(math.isfinite(slope) for slope in rule.slopes)
    ]

    def bound(p: tuple[float, ...]) -> float:
        return p[0] + half_r * max(-p[1], p[2], 0.0) + half_c * max(-p[3], p[4], 0.0)

    best = min((bound(p) for p in pieces), default=math.inf)
    for p, q in itertools.combinations(pieces, 2):
        # Where -low = high, the dominating side changes.
        for side in (1, 3):
            mine, other = p[side] + p[side + 1], q[side] + q[side + 1]
            if mine * other < 0.0:
                w = other / (other - mine)
                best = min(best, bound(tuple(w * x + (1.0 - w) * y for x, y in zip(p, q, strict=True))))
    return math.exp(best) * (1.0 + _ROUNDING) if best < 700.0 else math.inf
