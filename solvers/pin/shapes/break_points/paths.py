"""Minimum-cost steps over cells of break points by dynamic programming, for a given deflection multiplier.

The cost of a step from t0 to t1 is, with f(t) the lower bound of u, B and S the cumulative deflection coefficients,
and beta and phi the flexibilities in bending and shear,

    psi(t0, t1) = min over u >= f(t1) of u (t1 - t0) + lambda ((B(t1) - B(t0)) beta(u) + (S(t1) - S(t0)) phi(u)).

If B and S are linear in both cells and f is ignored, psi is a minimum of functions that are linear in each of t0
and t1: concave, so its minimum is at the cells' ends. B and S are replaced by linear lower bounds, the same for the
steps on both sides of a break point: with B' for B, the sum over all steps changes by

    lambda sum (B'(t_k) - B(t_k)) (beta(u_k) - beta(u_{k+1})) <= 0

where u increases, and only slightly where neighbouring walls are similar. f is replaced by a linear lower bound L: for
u that increases with L, the curvature of psi in t1 is at most

    k = 2 L' + lambda L'^2 (B beta'' + S phi''),

so that in the cell psi is at most k h^2/8 below its end values (beta'' and phi'' decrease with u, so those of the
minimum of L apply). If no wall at the ends lies on L or has jumped to the solid section, L is not binding and the
loss is zero. Dynamic programming over the ends of cells, minus these losses, therefore bounds all break points in
the cells.

The bound is concave in lambda, with the derivative (cheapest steps' deflection - limit)/limit. So its values and
slopes at two multipliers on either side of the maximum enclose the maximum between the larger value and the
intersection of the two tangents.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.pin.optimum.station_minimum import minimiser_below
from solvers.pin.section.flexibility import Flexibility, curvatures, flexibilities

Indices = NDArray[np.int64]

POSITION, FLOOR, BENDING, SHEAR = 0, 2, 4, 6
COLUMNS = 8
"""Columns of a table of cells: position, L, and the lower bounds of B and S, at both ends of every cell."""
_MAX_TRIALS = 60
_WIDE = 4.0
"""Ratio of the multiplier's bracket above which its geometric mean is tried."""


class Layers(NamedTuple):
    """Layers of cells in one ``table`` (total, COLUMNS), the first and the last being single points.

    ``starts`` (layers + 1,): first row of each layer. ``blocks`` (layers - 1,): first index of the costs of the steps
    between two layers; equal indices: equal steps. ``max_u`` (layers - 1,): greatest u of each step. ``law`` of the
    flexibilities.
    """

    table: Array
    starts: Indices
    blocks: Indices
    max_u: Array
    law: Flexibility


class Costs(NamedTuple):
    """Costs of dynamic programming.

    ``step`` (sum of products of neighbouring layers' sizes, 2, 2): cost between ends of cells. ``cost_to_come`` and
    ``cost_to_go`` (total, 2): cost of the cheapest path from the first layer to an end of a cell, and from there to
    the last layer. ``predecessor`` (total, 2): 2 i + e for end e of row i, the one before it on that path.
    """

    step: Array
    cost_to_come: Array
    cost_to_go: Array
    predecessor: Indices


@kernel
def _loss(lam: float, after: Array, fixed: bool, bend: float, shear: float, law: Flexibility) -> float:
    """Return an upper bound of psi's depth below its values at the ends of two cells, the second being ``after``; inf:
    unbounded.

    ``fixed``: whether L is binding at some end; ``bend`` and ``shear`` are the maximum coefficients.
    """
    low, rise = after[FLOOR], after[FLOOR + 1] - after[FLOOR]
    loss = 0.25 * rise * max(after[POSITION + 1] - after[POSITION], 0.0) if fixed else 0.0
    if lam > 0.0 and fixed and rise > 0.0 and (bend > 0.0 or shear > 0.0):
        if low <= 0.0:
            return np.inf
        curve, shear_curve = curvatures(low, law)
        loss += 0.125 * lam * rise * rise * (bend * curve + shear * max(shear_curve, 0.0))
    return loss


@kernel
def _step_cost(
    lam: float, before: Array, after: Array, max_u: float, start: float, law: Flexibility, out: Array
) -> tuple[float, int]:
    """Write into out[e, f] the cost of a step from end e of one cell to end f of another, minus its loss inside the
    cells.

    Cells of zero width have one end only. Return the last wall, and how many walls required a minimisation.
    """
    minimisations, u = 0, start
    for e in range(2):
        for f in range(2):
            out[e, f] = np.inf
    # Coincident break points are in the same cell; otherwise a step backward and forward would gain the difference of
    # two cells' lines.
    if before[POSITION] > after[POSITION]:
        return u, minimisations
    ends = 2 if before[POSITION + 1] > before[POSITION] else 1
    after_ends = 2 if after[POSITION + 1] > after[POSITION] else 1
    if after_ends == 1 and after[FLOOR] > max_u:
        return u, minimisations
    fixed, bend_most, shear_most, least = False, 0.0, 0.0, after[FLOOR]
    for e in range(ends):
        for f in range(after_ends):
            if before[POSITION + e] > after[POSITION + f]:
                continue
            width = after[POSITION + f] - before[POSITION + e]
            more_bend, more_shear = after[BENDING + f] - before[BENDING + e], after[SHEAR + f] - before[SHEAR + e]
            bend, shear = max(more_bend, 0.0), max(more_shear, 0.0)
            floor = min(after[FLOOR + f], max_u)
            loaded = lam > 0.0 and (bend > 0.0 or shear > 0.0)
            minimisations += 1 if loaded else 0
            u = minimiser_below(lam, width, bend, shear, floor, max_u, u, law)
            # A step may be solid only because the floor excludes a thinner one of lower cost.
            fixed = fixed or u <= floor or (law.kappa < 0.0 and u >= max_u)
            bend_most, shear_most = max(bend_most, bend), max(shear_most, shear)
            cost = u * width if u < np.inf else 0.0
            if loaded and u < np.inf:
                beta, sheared = flexibilities(max(u, 1e-300), law)
                cost += lam * (bend * beta + shear * sheared)
            if lam > 0.0 and (more_bend < 0.0 or more_shear < 0.0):
                # Lines of adjacent cells may decrease from one to the next: a gain, greatest for the thinnest wall.
                if least <= 0.0:
                    cost = -np.inf
                else:
                    beta, sheared = flexibilities(least, law)
                    cost += lam * (min(more_bend, 0.0) * beta + min(more_shear, 0.0) * sheared)
            out[e, f] = cost
    if ends == 1 and after_ends == 1:
        return u, minimisations
    loss = _loss(lam, after, fixed, bend_most, shear_most, law)
    for e in range(ends):
        for f in range(after_ends):
            if out[e, f] < np.inf and loss < np.inf:
                out[e, f] -= loss
            elif out[e, f] < np.inf:
                # The only valid bound is that of the minimum wall, at the thin end.
                out[e, f] = least * max(after[POSITION + f] - before[POSITION + e], 0.0)
    return u, minimisations


@kernel
def forward(lam: float, layers: Layers, costs: Costs) -> int:
    """Fill ``step``, ``cost_to_come`` and ``predecessor``; return the number of walls that required a minimisation."""
    minimisations, starts = 0, layers.starts
    costs.cost_to_come[0, 0], costs.cost_to_come[0, 1] = 0.0, np.inf
    for k in range(starts.size - 2):
        begin, middle, end, block = starts[k], starts[k + 1], starts[k + 2], layers.blocks[k]
        if k == 0 or block != layers.blocks[k - 1]:
            for i in range(begin, middle):
                u = 0.5
                for j in range(middle, end):
                    u, more = _step_cost(
                        lam, layers.table[i], layers.table[j], layers.max_u[k], u, layers.law,
                        costs.step[block + (i - begin) * (end - middle) + j - middle],
                    )  # fmt: skip
                    minimisations += more
        for j in range(middle, end):
            for f in range(2):
                least, at = np.inf, -1
                for i in range(begin, middle):
                    for e in range(2):
                        step = costs.step[block + (i - begin) * (end - middle) + j - middle, e, f]
                        value = costs.cost_to_come[i, e] + step
                        if value < least:
                            least, at = value, 2 * i + e
                costs.cost_to_come[j, f], costs.predecessor[j, f] = least, at
    return minimisations


@kernel
def backward(layers: Layers, costs: Costs) -> None:
    """Fill ``cost_to_go`` from the costs of the steps."""
    starts = layers.starts
    for i in range(starts[-1]):
        costs.cost_to_go[i, 0] = costs.cost_to_go[i, 1] = np.inf
    costs.cost_to_go[starts[-1] - 1, 0] = 0.0
    for k in range(starts.size - 3, -1, -1):
        begin, middle, end, block = starts[k], starts[k + 1], starts[k + 2], layers.blocks[k]
        for i in range(begin, middle):
            for j in range(middle, end):
                step = costs.step[block + (i - begin) * (end - middle) + j - middle]
                for e in range(2):
                    for f in range(2):
                        costs.cost_to_go[i, e] = min(costs.cost_to_go[i, e], step[e, f] + costs.cost_to_go[j, f])


@kernel
def trace(lam: float, layers: Layers, costs: Costs, path: Array) -> float:
    """Write the cheapest path's break points and walls into ``path`` (2, steps); return its relative deflection."""
    at, total = 2 * (layers.starts[-1] - 1), 0.0
    for k in range(path.shape[1] - 1, -1, -1):
        j, f, before = at // 2, at % 2, costs.predecessor[at // 2, at % 2]
        after, previous, e = layers.table[j], layers.table[before // 2], before % 2
        width = max(after[POSITION + f] - previous[POSITION + e], 0.0)
        bend = max(after[BENDING + f] - previous[BENDING + e], 0.0)
        shear = max(after[SHEAR + f] - previous[SHEAR + e], 0.0)
        u = min(after[FLOOR + f], layers.max_u[k])
        if lam > 0.0 and (bend > 0.0 or shear > 0.0):
            u = minimiser_below(lam, width, bend, shear, u, layers.max_u[k], 0.5, layers.law)
            beta, phi = flexibilities(max(u, 1e-300), layers.law)
            total += bend * beta + shear * phi
        path[0, k], path[1, k] = after[POSITION + f], u
        at = before
    return total


@kernel
def maximise_dual(
    layers: Layers, costs: Costs, start: float, tolerance: float, target: float, soft: Array, stiff: Array
) -> tuple[float, float, int]:
    """Maximise the dual bound over the multiplier, from ``start``; return (multiplier, bound, number of minimisations).

    All layers are points. Ends once the bound is known to ``tolerance`` or has reached ``target``. ``soft`` and
    ``stiff`` (2, steps) receive the cheapest paths on either side of the maximum (or the same one), as in ``trace``.
    """
    low, low_value, low_slope, high, high_value, high_slope = 0.0, 0.0, 0.0, np.inf, 0.0, 0.0
    lam, best, value, work = start, start, -np.inf, 0
    path = np.empty(soft.shape)
    for _ in range(_MAX_TRIALS):
        work += forward(lam, layers, costs)
        dual_value = costs.cost_to_come[layers.starts[-1] - 1, 0] - lam
        slope = trace(lam, layers, costs, path) - 1.0
        if dual_value > value:
            best, value = lam, dual_value
        to_soft = slope > 0.0
        for i in range(2):
            for k in range(path.shape[1]):
                if to_soft or low == 0.0:
                    soft[i, k] = path[i, k]
                if not to_soft or high == np.inf:
                    stiff[i, k] = path[i, k]
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
    return best, value, work
