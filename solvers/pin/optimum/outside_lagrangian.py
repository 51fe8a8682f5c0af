"""One multiplier for the bushing's deflection, a one-dimensional convex minimum at every station, and their bound.

As ``solvers.pin.optimum.lagrangian`` and ``solvers.pin.optimum.dual_bound`` for the pin, with the bushing's own two
flexibilities: they are convex everywhere, and there is no solid section to end at. Newton's method runs in ln y, since
the Lagrangian's slope falls nearly as a power of y.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.optimum.program import Program, Weighed
from solvers.pin.section.outside_wall import utilisation
from solvers.pin.section.tube import bending, place_around, shearing

Array = NDArray[np.float64]
_EPS = float(np.finfo(float).eps)
_ROUNDS = 200
CLOSE = 4e-14
"""How far below its limit the deflection may end, relative."""


@kernel
def _free(lam: float, share: Array, low: Array, bend: Array, shear: Array, k: float, a: float, b: float, y: Array):
    """Every station's minimum, into y; the deflection and its derivative by lambda."""
    total, change = 0.0, 0.0
    for i in range(y.size):
        if bend[i] == 0.0 and shear[i] == 0.0:
            y[i] = low[i]
            continue
        x = place_around(lam, 1.0, bend[i], shear[i], low[i], k, a, b)
        y[i] = x
        f, df, d2f = bending(x, k)
        g, dg, d2g = shearing(x, k, a, b)
        total += share[i] * (bend[i] * f + shear[i] * g)
        if x > low[i]:
            slope = bend[i] * df + shear[i] * dg
            change -= share[i] * slope * slope / (lam * (bend[i] * d2f + shear[i] * d2g))
    return total, change


@kernel
def _monotone(lam: float, share: Array, low: Array, bend: Array, shear: Array, k: float, a: float, b: float, y: Array):
    """As ``_free`` for y that must not fall along the stations, by pooling adjacent violators."""
    n = y.size
    w, wb, ws, lo, at = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    count = np.empty(n, dtype=np.int64)
    top = -1
    for i in range(n):
        top += 1
        w[top], wb[top], ws[top], lo[top], count[top] = share[i], share[i] * bend[i], share[i] * shear[i], low[i], 1
        at[top] = place_around(lam, w[top], wb[top], ws[top], lo[top], k, a, b)
        while top > 0 and at[top - 1] > at[top]:
            w[top - 1] += w[top]
            wb[top - 1] += wb[top]
            ws[top - 1] += ws[top]
            lo[top - 1] = lo[top]
            count[top - 1] += count[top]
            top -= 1
            at[top] = place_around(lam, w[top], wb[top], ws[top], lo[top], k, a, b)
    total, change, i = 0.0, 0.0, 0
    for j in range(top + 1):
        x = at[j]
        y[i : i + count[j]] = x
        i += count[j]
        if wb[j] == 0.0 and ws[j] == 0.0:
            continue
        f, df, d2f = bending(x, k)
        g, dg, d2g = shearing(x, k, a, b)
        total += wb[j] * f + ws[j] * g
        if x > lo[j]:
            slope = wb[j] * df + ws[j] * dg
            change -= slope * slope / (lam * (wb[j] * d2f + ws[j] * d2g))
    return total, change


def _respond(program: Program, lam: float, low: Array, y: Array, monotone: bool) -> tuple[float, float]:
    total = change = 0.0
    way = _monotone if monotone else _free
    halves = (slice(0, program.anchor), slice(program.anchor, y.size))
    for half, step in zip(halves, (1, -1), strict=True):
        if half.start == half.stop:
            continue
        cut = [np.ascontiguousarray(v[half][::step]) for v in (program.share, low, program.bending, program.shear)]
        piece = np.empty(cut[0].size)
        t, c = way(
            lam, cut[0], cut[1], cut[2] / program.limit, cut[3] / program.limit, program.sought.kappa, program.law.a,
            program.law.b, piece,
        )  # fmt: skip
        y[half] = piece[::step]
        total, change = total + t, change + c
    return total, change


def weigh(program: Program, low: Array, monotone: bool) -> Weighed:
    """The least volume that keeps the deflection limit (there always is one); it ends within CLOSE of the limit."""
    if program.limit is None or program.deflection(low) <= program.limit:
        return Weighed(low, 0.0, 0)
    y = low.copy()
    lower, upper, lam, best, rounds = 0.0, math.inf, 0.5 * max(program.volume(low), 1.0), None, 0
    for rounds in range(1, _ROUNDS + 1):  # noqa: B007
        total, change = _respond(program, lam, low, y, monotone)
        if total <= 1.0:
            upper, best = lam, (lam, y.copy())
            if total >= 1.0 - CLOSE:
                break
        else:
            lower = lam
        if upper < math.inf and upper - lower <= 2.0 * _EPS * upper:
            break
        # 1/total^2 is nearly straight in lambda; aim a hair inside the limit.
        aim = 1.0 - 0.4 * CLOSE
        new = lam + (aim**-2 - total**-2) / (-2.0 * change * total**-3) if change < 0.0 else math.nan
        if not lower < new < upper:
            new = math.sqrt(lower * upper) if lower > 0.0 and upper < math.inf else 0.0
            if new == 0.0:
                new = 16.0 * lam if upper == math.inf else 0.0625 * upper
        lam = new
    return Weighed(best[1], best[0], rounds)


def bound(program: Program, low: Array, multiplier: float, y: Array, monotone: bool) -> float:
    """Lower bound of the volume over all y >= low (not falling toward the middle) that keep the deflection limit.

    Tangents of the Lagrangian at y, over [low, top]; at ``top`` every slope is positive, so no minimum lies beyond.
    """
    share, scale = program.share, multiplier / program.limit
    pulls = (program.bending > 0.0) | (program.shear > 0.0)

    def slopes(at: Array) -> Array:
        safe = np.where(pulls, at, 1.0)
        f, g = _slopes(safe, program.sought.kappa, program.law.a, program.law.b)
        return share * (1.0 + scale * (program.bending * f + program.shear * g))

    top = float(y.max())
    while np.any(slopes(np.full_like(y, top)) < 0.0):
        top *= 1.5
    value = share * (y + scale * program.densities(np.where(pulls, y, 1.0)))
    slope = slopes(y)
    total = float(value.sum()) - multiplier
    if not monotone:
        return total + float(np.sum(np.where(slope > 0.0, slope * (low - y), slope * (top - y))))
    halves = (slice(0, program.anchor), slice(program.anchor, y.size))
    for half, step in zip(halves, (1, -1), strict=True):
        yn, sn, ln = y[half][::step], slope[half][::step], low[half][::step]
        if not yn.size:
            continue
        starts = np.flatnonzero(np.concatenate([[True], yn[1:] != yn[:-1]]))
        for begin, end in zip(starts, np.append(starts[1:], yn.size), strict=True):
            suffix = np.concatenate([np.cumsum(sn[begin:end][::-1])[::-1], [0.0]])
            total += float(np.min((ln[begin] - yn[begin]) * (suffix[0] - suffix) + (top - yn[begin]) * suffix))
    return total


@kernel
def _slopes(y: Array, kappa: float, a: float, b: float) -> tuple[Array, Array]:
    f, g = np.empty_like(y), np.empty_like(y)
    for i in range(y.size):
        f[i], g[i] = bending(y[i], kappa)[1], shearing(y[i], kappa, a, b)[1]
    return f, g


def strength_bound(program: Program, low: Array) -> float:
    """Volume of walls thinner than the least ones by 1e-12 (more where rounding hides that), each shown not to hold."""
    gap = program.sought.wall_of(program.lower)
    own = gap > program.floor * (1.0 + 4e-16)
    loss = 1e-12
    for margin in (1e-12, 1e-10, 1e-8):
        loss = margin
        thinner = gap * (1.0 - margin)
        fails = np.zeros(gap.shape, dtype=bool)
        for constraint in program.constraints:
            fails |= utilisation(constraint, program.scene.geometry.bore, thinner) > 1.0
        if not np.any(own & ~fails):
            break
    return program.volume(low * (1.0 - 2.0 * loss))
