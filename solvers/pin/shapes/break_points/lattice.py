"""Cheapest steps on a lattice of break points and walls, for a given deflection multiplier or the best one.

Steps end at t_1 <= ... <= t_n = 1, with walls u_1 <= ... <= u_n. With f(t) the lower bound of u, B and S the cumulative
deflection coefficients, beta and phi the flexibilities in bending and shear, and lambda the multiplier,

    cost = sum G(t_k, u_k) - G(t_{k-1}, u_k),   G(t, u) = u t + lambda (B(t) beta(u) + S(t) phi(u)),   u_k >= f(t_k).

In cells beta, phi, B and S are replaced by lines below them. Neither increases the cost: B and S increase with t, and
replacing B by B' changes it by lambda sum (B'(t_k) - B(t_k)) (beta(u_k) - beta(u_{k+1})), where beta must not increase
with u. Now every G is linear in t and in u. So if every t is moved to one end of its cell or the other, at random
with its own value as the mean, and every u too, all t of one cell alike and all u of one cell alike, which keeps their
order, the expected cost is the same, and some steps through ends of cells cost no more than any through the cells.

Only in a cell of break points with the cell of walls that accompanies it on the curve f must t and u move together, so
that u stays above f: then the expected cost of a step that ends there exceeds that by the covariance of u and t, at
most a quarter of the product of their cells' widths, and of a step that begins there by lambda times that of -beta and
B, and of -phi and S. Walls above the curve, but below its chord, are raised by the sag before. These losses are
deducted.

Walls and break points both increase along a path, so both minima of dynamic programming are running ones: the cost of
an iteration is proportional to the number of pairs of a break point and a wall before or after it.

The bound is concave in lambda, with the derivative (cheapest steps' deflection - limit)/limit. So its values and
slopes at two multipliers on either side of the maximum enclose the maximum between the larger value and the
intersection of the two tangents.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.pin.shapes.break_points.cells import Indices

_MAX_TRIALS = 60
_WIDE = 4.0
"""Ratio of the multiplier's bracket above which its geometric mean is tried."""


class Lattice(NamedTuple):
    """Both ends of m cells of break points and of q cells of walls, in order, those of cell i being 2 i and 2 i + 1.

    ``t``, ``b``, ``s``, ``least``, ``most`` (2 m,): position, B', S', least wall of a step that ends there, greatest
    wall of one that begins there; ``sag`` (m,), ``depth`` (m, 2) as in ``BreakCells``. ``u``, ``f``, ``g`` (2 q,):
    wall, beta', phi'; ``curve`` (q,) as in ``WallCells``, ``depth_of_walls`` (q, 2). ``thin``, ``thick``
    (steps - 1, m, 2) as in ``Part``. ``row`` (steps - 1, m): where the costs of steps that end in a cell begin in the
    array of all costs; ``row_last``: of the last step. ``b_last``, ``s_last``, ``least_last`` at the middle of the bar,
    ``most_first`` at its end.
    """

    t: Array
    b: Array
    s: Array
    least: Array
    most: Array
    sag: Array
    depth: Array
    u: Array
    f: Array
    g: Array
    curve: Indices
    depth_of_walls: Array
    thin: Indices
    thick: Indices
    row: Indices
    row_last: int
    b_last: float
    s_last: float
    least_last: float
    most_first: float


@kernel
def _end_loss(lat: Lattice, i: int, j: int) -> float:
    """Return the loss of a step that ends at i with wall j."""
    c, v = i // 2, j - j % 2
    if lat.curve[j // 2] != c or lat.sag[c] == np.inf:
        return 0.0
    return 0.25 * (lat.u[v + 1] - lat.u[v]) * (lat.t[2 * c + 1] - lat.t[2 * c]) + lat.sag[c] * lat.t[i]


@kernel
def _begin_loss(lam: float, lat: Lattice, i: int, j: int) -> float:
    """Return the loss of a step that begins at i with wall j."""
    c, v = i // 2, j - j % 2
    if lat.curve[j // 2] != c or lat.sag[c] == np.inf:
        return 0.0
    bent = (lat.f[v] - lat.f[v + 1]) * (lat.b[2 * c + 1] - lat.b[2 * c])
    return 0.25 * lam * (bent + (lat.g[v] - lat.g[v + 1]) * (lat.s[2 * c + 1] - lat.s[2 * c]))


@kernel
def _until(lam: float, lat: Lattice, i: int, j: int) -> float:
    """Return G at i for wall j."""
    return lat.t[i] * lat.u[j] + lam * (lat.b[i] * lat.f[j] + lat.s[i] * lat.g[j])


@kernel
def _last(lam: float, lat: Lattice, j: int) -> float:
    """Return G at the middle of the bar for wall j; inf if that is too thin."""
    if lat.u[j] < lat.least_last:
        return np.inf
    return lat.u[j] + lam * (lat.b_last * lat.f[j] + lat.s_last * lat.g[j])


@kernel
def _row(lat: Lattice, k: int, i: int) -> int:
    """Return where the cost of steps that end at i would be for the first of all walls."""
    low, high = lat.thin[k, i // 2, 0], lat.thin[k, i // 2, 1]
    return lat.row[k, i // 2] + (2 * (high - low) if i % 2 else 0) - 2 * low


@kernel
def forward(lam: float, lat: Lattice, come: Array) -> float:
    """Fill ``come`` with the costs of the cheapest steps from the end of the bar to break point i, with wall j before
    it, and to the middle. Return the least cost."""
    breaks, nj, cheapest = lat.thin.shape[0], lat.u.size, np.inf
    run = np.empty(nj)
    for k in range(breaks + 1):
        for j in range(nj):
            run[j] = 0.0 if k == 0 and lat.u[j] <= lat.most_first else np.inf
        for i in range(lat.t.size):
            c = i // 2
            if k > 0:
                row, before = _row(lat, k - 1, i), np.inf
                thinner, last = 2 * lat.thin[k - 1, c, 0], 2 * lat.thin[k - 1, c, 1]
                for j in range(2 * lat.thick[k - 1, c, 0], 2 * lat.thick[k - 1, c, 1]):
                    while thinner <= j and thinner < last:
                        before = min(before, come[row + thinner])
                        thinner += 1
                    if before < np.inf and lat.u[j] <= lat.most[i]:
                        value = before - _until(lam, lat, i, j)
                        if lat.curve[j // 2] == c:
                            value -= _begin_loss(lam, lat, i, j)
                        run[j] = min(run[j], value)
            if k < breaks:
                row = _row(lat, k, i)
                for j in range(2 * lat.thin[k, c, 0], 2 * lat.thin[k, c, 1]):
                    value = np.inf
                    if lat.u[j] >= lat.least[i]:
                        value = run[j] + _until(lam, lat, i, j)
                        if lat.curve[j // 2] == c:
                            value -= _end_loss(lat, i, j)
                    come[row + j] = value
    for j in range(nj):
        come[lat.row_last + j] = run[j] + _last(lam, lat, j)
        cheapest = min(cheapest, come[lat.row_last + j])
    return cheapest


@kernel
def _include(spans: Indices, k: int, c: int, cell: int) -> None:
    """Extend a range of ``spans``, given by its first cell and the one past its last, to include a cell."""
    spans[k, c, 0] = min(spans[k, c, 0], cell) if spans[k, c, 1] else cell
    spans[k, c, 1] = max(spans[k, c, 1], cell + 1)


@kernel
def prune(lam: float, lat: Lattice, come: Array, worst: float, thin: Indices, thick: Indices) -> None:
    """Write into ``thin`` and ``thick``, as in ``Part``, the cells that some steps of cost at most ``worst`` pass."""
    breaks, nj = lat.thin.shape[0], lat.u.size
    run, befores, go = np.empty(nj), np.empty(nj), np.empty(lat.row_last + nj)
    thin[:, :, :], thick[:, :, :] = 0, 0
    for j in range(nj):
        run[j] = _last(lam, lat, j)
    for k in range(breaks - 1, -1, -1):
        for i in range(lat.t.size - 1, -1, -1):
            c = i // 2
            if k + 1 < breaks:
                row = _row(lat, k + 1, i)
                for j in range(2 * lat.thin[k + 1, c, 0], 2 * lat.thin[k + 1, c, 1]):
                    if go[row + j] < np.inf and lat.u[j] >= lat.least[i]:
                        value = go[row + j] + _until(lam, lat, i, j)
                        if lat.curve[j // 2] == c:
                            value -= _end_loss(lat, i, j)
                        run[j] = min(run[j], value)
            row, before, after = _row(lat, k, i), np.inf, np.inf
            low, high = 2 * lat.thin[k, c, 0], 2 * lat.thin[k, c, 1]
            first, other = 2 * lat.thick[k, c, 0], 2 * lat.thick[k, c, 1] - 1
            thinner = low
            for j in range(first, other + 1):
                while thinner <= j and thinner < high:
                    before = min(before, come[row + thinner])
                    thinner += 1
                befores[j] = before
            for j in range(high - 1, low - 1, -1):
                while other >= j and other >= first:
                    if lat.u[other] <= lat.most[i]:
                        value = run[other] - _until(lam, lat, i, other)
                        if lat.curve[other // 2] == c:
                            value -= _begin_loss(lam, lat, i, other)
                        if value + befores[other] <= worst:
                            _include(thick, k, c, other // 2)
                        after = min(after, value)
                    other -= 1
                go[row + j] = after
                if after + come[row + j] <= worst:
                    _include(thin, k, c, j // 2)
        run[:] = np.inf


@kernel
def trace(lam: float, lat: Lattice, come: Array, path: Indices) -> float:
    """Write the cheapest steps into ``path`` (2, steps): indices of their ends, the last being -1, and of their walls.
    Return the derivative of their cost in lambda."""
    breaks = lat.thin.shape[0]
    end, j = lat.t.size - 1, int(np.argmin(come[lat.row_last :]))
    path[0, breaks], path[1, breaks] = -1, j
    total = lat.b_last * lat.f[j] + lat.s_last * lat.g[j]
    for k in range(breaks - 1, -1, -1):
        cheapest, at, thinner = np.inf, 0, 0
        for i in range(end + 1):
            c = i // 2
            if not lat.thick[k, c, 0] <= j // 2 < lat.thick[k, c, 1] or lat.u[j] > lat.most[i]:
                continue
            before, wall, row = np.inf, 0, _row(lat, k, i)
            for other in range(2 * lat.thin[k, c, 0], min(j + 1, 2 * lat.thin[k, c, 1])):
                if come[row + other] < before:
                    before, wall = come[row + other], other
            value = before - _until(lam, lat, i, j) - _begin_loss(lam, lat, i, j)
            if value < cheapest:
                cheapest, at, thinner = value, i, wall
        total += lat.b[at] * (lat.f[thinner] - lat.f[j]) + lat.s[at] * (lat.g[thinner] - lat.g[j])
        total -= _begin_loss(1.0, lat, at, j)
        j, end = thinner, at
        path[0, k], path[1, k] = at, j
    return total


@kernel
def dues(lam: float, lat: Lattice, path: Indices, out: Array) -> None:
    """Write into ``out`` (2, steps) by how much the cells of a path's break points and walls may lower its cost."""
    steps, b, s = path.shape[1], 0.0, 0.0
    out[:, :] = 0.0
    for k in range(steps):
        i, j = path[0, k], path[1, k]
        b_next, s_next, v = lat.b_last, lat.s_last, j // 2
        if k < steps - 1:
            c, after = i // 2, path[1, k + 1]
            b_next, s_next = lat.b[i], lat.s[i]
            out[0, k] = lat.depth[c, 0] * (lat.f[j] - lat.f[after]) + lat.depth[c, 1] * (lat.g[j] - lat.g[after])
            out[0, k] *= lam
            if lat.curve[v] == c:
                rise = lat.u[2 * v + 1] - lat.u[2 * v]
                loss = 0.25 * rise * (lat.t[2 * c + 1] - lat.t[2 * c]) + min(lat.sag[c], rise) * lat.t[i]
                out[0, k] += loss
                out[1, k] += loss
        if lat.u[2 * v + 1] > lat.u[2 * v]:
            out[1, k] += lam * ((b_next - b) * lat.depth_of_walls[v, 0] + (s_next - s) * lat.depth_of_walls[v, 1])
        b, s = b_next, s_next


@kernel
def maximise_dual(
    lat: Lattice, come: Array, start: float, tolerance: float, target: float, soft: Indices, stiff: Indices
) -> tuple[float, float, int]:
    """Maximise the dual bound over the multiplier, from ``start``; return (multiplier, bound, number of trials).

    Ends once the bound is known to ``tolerance`` or has reached ``target``. ``soft`` and ``stiff`` (2, steps) receive
    the cheapest paths on either side of the maximum (or the same one), as in ``trace``, and ``come`` the costs at the
    multiplier returned.
    """
    low, low_value, low_slope, high, high_value, high_slope = 0.0, 0.0, 0.0, np.inf, 0.0, 0.0
    lam, best, value, trials = start, start, -np.inf, 0
    path = np.empty(soft.shape, dtype=np.int64)
    for _ in range(_MAX_TRIALS):
        trials += 1
        dual_value = forward(lam, lat, come) - lam
        if dual_value == np.inf:
            return lam, np.inf, trials
        slope = trace(lam, lat, come, path) - 1.0
        if dual_value > value:
            best, value = lam, dual_value
        to_soft = slope > 0.0
        if to_soft or low == 0.0:
            soft[:] = path
        if not to_soft or high == np.inf:
            stiff[:] = path
        if to_soft:
            low, low_value, low_slope = lam, dual_value, slope
        else:
            high, high_value, high_slope = lam, dual_value, slope
        # The tangent bounds what is missing: the best multiplier lies between lam and ``high``, or ``low``.
        farthest = high if to_soft else low
        if value >= target or slope * (farthest - lam) <= tolerance:
            break
        if low == 0.0 or high == np.inf:
            # The deflection of thin walls is inversely proportional to the root of the multiplier.
            lam *= min(max((1.0 + slope) * (1.0 + slope), 0.0625), 16.0) * (1.1 if to_soft else 1.0 / 1.1)
            continue
        meet = (high_value - low_value + low_slope * low - high_slope * high) / (low_slope - high_slope)
        if low_value + low_slope * (meet - low) - value <= tolerance:
            break
        lam = meet if high <= _WIDE * low else math.sqrt(low * high)
        if not low < lam < high:
            break
    if best != lam:
        forward(best, lat, come)
    return best, value, trials
