"""Cheapest steps through cells of break points by dynamic programming, for one deflection multiplier.

A step from t0 to t1 costs, with Y the price of length, B and S the cumulative deflection coefficients,

    psi(t0, t1) = min over u >= f(t1) of u (Y(t1) - Y(t0)) + lambda ((B(t1) - B(t0)) beta(u) + (S(t1) - S(t0)) phi(u)).

If Y, B and S are linear in both cells and f is ignored, psi is a minimum of functions that are linear in each of t0
and t1: concave, so its minimum is at the cells' ends. B and S are replaced by linear lower bounds, the same for the
steps on both sides of a break point: with B' for B, the sum over all steps changes by

    lambda sum (B'(t_k) - B(t_k)) (beta(u_k) - beta(u_{k+1})) <= 0

where u increases, and by little where neighbouring walls differ little. f is replaced by a linear lower bound L: for
u that increases with L, the curvature of psi in t1 is at most

    k = 2 L' Y' + lambda L'^2 (B beta'' + S phi''),

so that in the cell psi is at most k h^2/8 below its end values (beta'' and phi'' decrease with u, so those of the
minimum of L apply). If no wall at the ends lies on L or has jumped to the solid section, L is not binding and the
loss is zero. Dynamic programming over the ends of cells, minus these losses, therefore bounds all break points in
the cells.
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
"""Rows of a cell table: position, L, Y, and the lower bounds of B and S, at both ends of every cell."""


@kernel
def _loss(
    lam: float, j: int, after: Array, fixed: bool, bend: float, shear: float,
    kappa: float, a: float, b: float,
) -> float:  # fmt: skip
    """Return by how much psi may be below its values at the ends of two cells, the second being j; inf: unbounded.

    ``fixed``: some wall at the ends lies on L; ``bend`` and ``shear`` are the maximum coefficients.
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
    """out[i, j, e, f]: cost of a step from end e of cell i to end f of cell j, minus its loss inside the cells.

    Cells of zero width have one end only. Returns the number of walls that required a minimisation.
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
            # Coincident breaks share a cell: going back and forth would gain the difference of the cells' lines.
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
                    # A step may be solid only because the floor excludes a thinner, cheaper one.
                    fixed = fixed or u <= floor or (kappa < 0.0 and u >= 1.0)
                    bend_most, shear_most = max(bend_most, bend), max(shear_most, shear)
                    cost = u * width if u < np.inf else 0.0
                    if lam > 0.0 and (bend > 0.0 or shear > 0.0) and u < np.inf:
                        beta, sheared = flexibilities(max(u, 1e-300), kappa, a, b)
                        cost += lam * (bend * beta + shear * sheared)
                    if lam > 0.0 and (more_bend < 0.0 or more_shear < 0.0):
                        # Lines of adjacent cells may decrease from one to the next: a gain, greatest for the
                        # thinnest wall.
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
                            # Only the lower bound of the wall, at the thin end, is certain.
                            width = after[PRICE + f, j] - before[PRICE + e, i]
                            out[i, j, e, f] = after[FLOOR, j] * max(width, 0.0)
    return sought


@kernel
def forward(cost: Array, best0: Array, best1: Array, via: Indices) -> None:
    """best1[j, f] = min over i, e of best0[i, e] + cost[i, j, e, f], with 2 i + e of the minimiser in ``via``."""
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
