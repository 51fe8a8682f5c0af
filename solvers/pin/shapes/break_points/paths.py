"""The cheapest steps through cells of break points, by dynamic programming, for one multiplier of the deflection.

A step from t0 to t1 costs, with Y the price of length, B and S the deflection's coefficients summed up,

    psi(t0, t1) = min over u >= f(t1) of u (Y(t1) - Y(t0)) + lambda ((B(t1) - B(t0)) beta(u) + (S(t1) - S(t0)) phi(u)).

With Y, B and S straight in both cells and without f, psi is a minimum of functions that are linear in each of t0 and
t1: concave, so that it is least at the cells' ends. B and S are replaced by straight lines below them, the same for
the steps on both sides of a break point: with B' for B, the sum over all steps changes by

    lambda sum (B'(t_k) - B(t_k)) (beta(u_k) - beta(u_{k+1})) <= 0

where u rises, and by little where neighbouring walls differ little. f is replaced by a straight line L below it: for
u that rises with L, psi bends upward in t1 by no more than

    k = 2 L' Y' + lambda L'^2 (B beta'' + S phi''),

so that nowhere in the cell it lies more than k h^2/8 below what its ends say (beta'' and phi'' fall with u, so those of
the least L hold). Where no wall at the ends lies on L, nor has jumped to the solid section, L is no bound and this is
nothing. So dynamic programming over the ends of cells, these losses taken off, bounds all break
points in the cells.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.optimum.one_station import curvatures, flexibilities, place

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

AT, FLOOR, PRICE, BENT, SHEARED = 0, 2, 4, 6, 8
ROWS = 10
"""Rows of a table of cells: place, L, Y, and the lines below B and S, at both ends of every cell."""


@kernel
def _loss(
    lam: float, j: int, after: Array, fixed: bool, bend: float, shear: float,
    kappa: float, a: float, b: float,
) -> float:  # fmt: skip
    """What psi may lie below its values at the ends of two cells, the second being j; inf: too much to be told.

    ``fixed`` says whether any wall at the ends lies on L, ``bend`` and ``shear`` are the greatest coefficients.
    """
    low, rise = after[FLOOR, j], after[FLOOR + 1, j] - after[FLOOR, j]
    loss = 0.25 * rise * max(after[PRICE + 1, j] - after[PRICE, j], 0.0) if fixed else 0.0
    if lam > 0.0 and fixed and rise > 0.0 and (bend > 0.0 or shear > 0.0):
        if low <= 0.0:
            return np.inf
        curve, shear_curve = curvatures(low, kappa, a, b)
        loss += 0.125 * lam * rise * rise * (bend * curve + shear * max(shear_curve, 0.0))
    return loss


@kernel
def costs(
    lam: float, before: Array, after: Array, kappa: float, a: float, b: float, out: Array
) -> int:  # fmt: skip
    """out[i, j, e, f]: cost of a step from end e of cell i to end f of cell j, less what it may lie below elsewhere.

    Cells without width have one end only. Returns how many walls had to be sought.
    """
    sought = 0
    n, m = before.shape[1], after.shape[1]
    for i in range(n):
        ends = 2 if before[AT + 1, i] > before[AT, i] else 1
        u = 0.5
        for j in range(m):
            for e in range(2):
                for f in range(2):
                    out[i, j, e, f] = np.inf
            # Two breaks at one place are in one cell: to the next and back again would gain what their lines differ.
            if before[AT, i] > after[AT, j]:
                continue
            tips = 2 if after[AT + 1, j] > after[AT, j] else 1
            fixed, bend_most, shear_most = False, 0.0, 0.0
            least, known = after[FLOOR, j], False
            beta_most, shear_most_each = 0.0, 0.0
            for e in range(ends):
                for f in range(tips):
                    if before[AT + e, i] > after[AT + f, j]:
                        continue
                    width = after[PRICE + f, j] - before[PRICE + e, i]
                    more_bend = after[BENT + f, j] - before[BENT + e, i]
                    more_shear = after[SHEARED + f, j] - before[SHEARED + e, i]
                    bend, shear = max(more_bend, 0.0), max(more_shear, 0.0)
                    floor = after[FLOOR + f, j]
                    sought += 1 if lam > 0.0 and (bend > 0.0 or shear > 0.0) else 0
                    u = place(lam, width, bend, shear, floor, u, kappa, a, b)
                    # A solid step may be so only because the floor lies above a thinner one that costs less.
                    fixed = fixed or u <= floor or (kappa < 0.0 and u >= 1.0)
                    bend_most, shear_most = max(bend_most, bend), max(shear_most, shear)
                    cost = u * width if u < np.inf else 0.0
                    if lam > 0.0 and (bend > 0.0 or shear > 0.0) and u < np.inf:
                        beta, sheared = flexibilities(max(u, 1e-300), kappa, a, b)
                        cost += lam * (bend * beta + shear * sheared)
                    if lam > 0.0 and (more_bend < 0.0 or more_shear < 0.0):
                        # Lines of two cells may fall from one to the next: a gain, greatest for the thinnest wall.
                        if least <= 0.0:
                            cost = -np.inf
                        else:
                            if not known:
                                beta_most, shear_most_each = flexibilities(least, kappa, a, b)
                                known = True
                            cost += lam * (min(more_bend, 0.0) * beta_most + min(more_shear, 0.0) * shear_most_each)
                    out[i, j, e, f] = cost
            if ends == 1 and tips == 1:
                continue
            loss = _loss(lam, j, after, fixed, bend_most, shear_most, kappa, a, b)
            for e in range(ends):
                for f in range(tips):
                    if out[i, j, e, f] < np.inf:
                        if loss < np.inf:
                            out[i, j, e, f] -= loss
                        else:
                            # Nothing but the least wall, and that at the thin end, is sure.
                            width = after[PRICE + f, j] - before[PRICE + e, i]
                            out[i, j, e, f] = after[FLOOR, j] * max(width, 0.0)
    return sought


@kernel
def forward(cost: Array, best0: Array, best1: Array, via: Indices) -> None:
    """best1[j, f] = min over i, e of best0[i, e] + cost[i, j, e, f], and 2 i + e of the least into via."""
    for j in range(cost.shape[1]):
        for f in range(2):
            least, at = np.inf, -1
            for i in range(cost.shape[0]):
                for e in range(2):
                    value = best0[i, e] + cost[i, j, e, f]
                    if value < least:
                        least, at = value, 2 * i + e
            best1[j, f], via[j, f] = least, at


@kernel
def backward(cost: Array, rest1: Array, rest0: Array) -> None:
    """rest0[i, e] = min over j, f of cost[i, j, e, f] + rest1[j, f]."""
    for i in range(cost.shape[0]):
        for e in range(2):
            least = np.inf
            for j in range(cost.shape[1]):
                for f in range(2):
                    least = min(least, cost[i, j, e, f] + rest1[j, f])
            rest0[i, e] = least
