"""The fast tier: one multiplier for the deflection, and a one-dimensional convex minimum at every station.

For a multiplier lambda the Lagrangian sum s_i (u_i + lambda (B_i/v + S_i phi)) - lambda falls apart into stations (or,
where the bore must narrow toward the middle, into blocks of equal u, found by pooling adjacent violators, which stays
exact because all stations share the two functions 1/v and phi). The deflection falls as lambda rises; 1/deflection^2
is nearly straight in it, so a safeguarded Newton method ends after a few rounds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.flexibility import bending, line_from, phi, phi_curvature, phi_slope
from solvers.pin.program import Program

Array = NDArray[np.float64]
_EPS = float(np.finfo(float).eps)
_ROUNDS = 200
_STEPS = 60
CONVEX = 0.8
"""Below this u phi is convex, and so is its envelope's own part, for every Poisson's ratio."""

CLOSE = 4e-14
"""How far below its limit the deflection may end, relative."""


@kernel
def _slopes(u: float, bend: float, shear: float, a: float, b: float, knee: float) -> tuple[float, float]:
    """g'(u) and g''(u) of g = bend/v + shear phi."""
    _, db, d2b = bending(u)
    return bend * db + shear * phi_slope(u, a, b, knee), bend * d2b + shear * phi_curvature(u, a, b, knee)


@kernel
def place(
    lam: float, weight: float, bend: float, shear: float, low: float, start: float, a: float, b: float, knee: float
) -> float:  # fmt: skip
    """argmin over [low, 1] of weight u + lam (bend/v + shear phi): the global one, though phi is concave near 1."""
    if lam * bend == 0.0 and lam * shear == 0.0:
        return low
    high = 1.0
    if knee >= 1.0 and weight + lam * _slopes(CONVEX, bend, shear, a, b, knee)[0] < 0.0:
        # The minimum may lie where g is concave: there it is at an end of the envelope's straight line.
        line = line_from(bend, shear, a, b, knee)
        if line < 1.0:
            begin = max(line, low)
            if begin >= 1.0:
                return 1.0
            rise = bend * (1.0 - bending(begin)[0]) + shear * (a - phi(begin, a, b, knee))
            if weight * (1.0 - begin) + lam * rise < 0.0:
                return 1.0
            if begin == low:
                return low
            high = line
        elif weight + lam * _slopes(1.0, bend, shear, a, b, knee)[0] <= 0.0:
            return 1.0
    left, right, u, seen = low, high, start, False
    if not low < u < high:
        u = min(max(math.sqrt(lam * (0.5 * bend + shear * (a + 0.25 * b)) / weight), low), high)
    if u <= 0.0:
        u = 1e-12
    for _ in range(_STEPS):
        slope, curve = _slopes(u, bend, shear, a, b, knee)
        rise = weight + lam * slope
        if rise > 0.0:
            right = u
            if u <= low:
                return low
        else:
            left = u
        new = u - rise / (lam * curve) if curve > 0.0 else high + 1.0
        if not 0.5 * u < new < 1.4 * u:
            # Far away Newton creeps from the left and shoots past from the right; the slope is nearly -K/u^2.
            new = max(u * math.sqrt(max(-lam * slope / weight, 0.0)), low)
        if new <= low and rise > 0.0:
            new = low
        elif not left < new < right:
            if rise <= 0.0 and u >= high:
                return high
            if rise <= 0.0 and not seen:
                # Past the end: look at the end itself, once.
                new, seen = high, True
            else:
                new = 0.5 * (left + right) if left > 0.0 else 0.5 * right
        if abs(new - u) <= 4.0 * _EPS * u:
            return new
        u = new
    return u


@kernel
def _free(
    lam: float, share: Array, low: Array, bend: Array, shear: Array, a: float, b: float, knee: float, u: Array
) -> tuple[float, float]:  # fmt: skip
    """Every station's minimum, into u; the deflection and its derivative by lambda."""
    total, change = 0.0, 0.0
    for i in range(u.size):
        if bend[i] == 0.0 and shear[i] == 0.0:
            u[i] = low[i]
            continue
        x = place(lam, 1.0, bend[i], shear[i], low[i], u[i], a, b, knee)
        u[i] = x
        total += share[i] * (bend[i] * bending(x)[0] + shear[i] * phi(x, a, b, knee))
        if low[i] < x < 1.0:
            slope, curve = _slopes(x, bend[i], shear[i], a, b, knee)
            curve = max(curve, 1e-300)
            change -= share[i] * slope * slope / (lam * curve)
    return total, change


@kernel
def _monotone(
    lam: float, share: Array, low: Array, bend: Array, shear: Array, a: float, b: float, knee: float, u: Array
) -> tuple[float, float]:  # fmt: skip
    """As ``_free`` for u that must not fall along the stations; ``low`` does not fall either."""
    n = u.size
    w, wb, ws, lo, at = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    count = np.empty(n, dtype=np.int64)
    top = -1
    for i in range(n):
        top += 1
        w[top], wb[top], ws[top], lo[top], count[top] = share[i], share[i] * bend[i], share[i] * shear[i], low[i], 1
        at[top] = place(lam, w[top], wb[top], ws[top], lo[top], u[i], a, b, knee)
        while top > 0 and at[top - 1] > at[top]:
            w[top - 1] += w[top]
            wb[top - 1] += wb[top]
            ws[top - 1] += ws[top]
            lo[top - 1] = lo[top]
            count[top - 1] += count[top]
            top -= 1
            at[top] = place(lam, w[top], wb[top], ws[top], lo[top], at[top], a, b, knee)
    total, change, i = 0.0, 0.0, 0
    for k in range(top + 1):
        x = at[k]
        u[i : i + count[k]] = x
        i += count[k]
        if wb[k] == 0.0 and ws[k] == 0.0:
            continue
        total += wb[k] * bending(x)[0] + ws[k] * phi(x, a, b, knee)
        if lo[k] < x < 1.0:
            slope, curve = _slopes(x, wb[k], ws[k], a, b, knee)
            curve = max(curve, 1e-300)
            change -= slope * slope / (lam * curve)
    return total, change


@dataclass(frozen=True)
class Weighed:
    """u at the stations, the deflection's multiplier (per relative deflection), and the rounds it took."""

    solidity: Array
    multiplier: float
    rounds: int


def _respond(program: Program, lam: float, low: Array, u: Array, monotone: bool) -> tuple[float, float]:
    law, scale = program.law, 1.0 / program.limit
    parts = [slice(0, program.anchor), slice(program.anchor, u.size)]
    total = change = 0.0
    way = _monotone if monotone else _free
    for part, step in zip(parts, (1, -1), strict=True):
        if part.start == part.stop:
            continue
        order = slice(None, None, step)

        def cut(values: Array, part: slice = part, order: slice = order) -> Array:
            return np.ascontiguousarray(values[part][order])

        piece = cut(u)
        t, c = way(
            lam, cut(program.share), cut(low), cut(program.bending) * scale, cut(program.shear) * scale,
            law.a, law.b, law.knee, piece,
        )  # fmt: skip
        u[part] = piece[order]
        total, change = total + t, change + c
    return total, change


def weigh(program: Program, low: Array | None, monotone: bool, start: float | None = None) -> Weighed | None:
    """The least volume that keeps the deflection limit; None where even the solid pin gives more.

    ``low`` is the least u of every station, the program's own without it (for ``monotone`` it must not fall toward the
    middle). The answer keeps the limit; it ends within CLOSE of it.
    """
    low = program.lower if low is None else low
    if program.limit is None or program.deflection(low) <= program.limit:
        return Weighed(low, 0.0, 0)
    solid = np.where((program.bending > 0) | (program.shear > 0), 1.0, low)
    if monotone:
        solid = rising(solid, program.anchor)
    least = program.deflection(solid) / program.limit
    if least > 1.0 + 1e-12:
        return None
    if least >= 1.0 - 1e-12:
        return Weighed(solid, math.inf, 0)
    u = low.copy()
    lower, upper, lam = 0.0, math.inf, start or 0.5
    best: tuple[float, Array] | None = None
    short = low
    rounds = 0
    for rounds in range(1, _ROUNDS + 1):  # noqa: B007
        total, change = _respond(program, lam, low, u, monotone)
        if total <= 1.0:
            upper, best = lam, (lam, u.copy())
            if total >= 1.0 - CLOSE:
                break
        else:
            lower, short = lam, u.copy()
        if upper < math.inf and upper - lower <= 2.0 * _EPS * upper:
            break
        # 1/total^2 is nearly straight in lambda; aim a hair inside the limit.
        aim = 1.0 - 0.4 * CLOSE
        new = lam + (aim**-2 - total**-2) / (-2.0 * change * total**-3) if change < 0.0 else math.nan
        if not lower < new < upper:
            new = math.sqrt(lower * upper) if lower > 0.0 and upper < math.inf else 0.0
            if new == 0.0:
                new = 4.0 * lam if upper == math.inf else 0.25 * upper
        lam = new
    if best is None:
        return Weighed(solid, math.inf, rounds)
    return Weighed(_between(program, short, best[1]), best[0], rounds)


def _between(program: Program, short: Array, enough: Array) -> Array:
    """The lightest mix of an answer that is too soft and one that is stiff enough.

    They differ where a station jumps to the solid section as lambda passes one value; elsewhere this changes nothing.
    """
    if program.deflection(enough) >= program.limit * (1.0 - 1e-12):
        return enough
    least, most = 0.0, 1.0
    for _ in range(60):
        part = 0.5 * (least + most)
        if program.deflection(short + part * (enough - short)) <= program.limit:
            most = part
        else:
            least = part
    return short + most * (enough - short)


def rising(values: Array, anchor: int) -> Array:
    """The least values above the given ones that rise from both ends toward the anchor."""
    first = np.maximum.accumulate(values[:anchor])
    second = np.maximum.accumulate(values[anchor:][::-1])[::-1]
    return np.concatenate([first, second])
