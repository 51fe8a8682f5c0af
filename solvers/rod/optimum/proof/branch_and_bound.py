"""Best-first branch and bound over boxes of (ln tau, ln l).

Bounds of a box come from ``solvers.rod.optimum.proof.box_bounds``; before bisection a box is contracted to the part
that may improve on the incumbent (``solvers.rod.optimum.proof.bound_tightening``).
"""

from __future__ import annotations

import heapq
import math

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.rod.optimum.proof.bound_tightening import contract
from solvers.rod.optimum.proof.box_bounds import Relaxation, box_bound, fill_curvatures, min_thickness, workspace
from solvers.rod.optimum.proof.intervals import HIGH, LOW, VALUE

_POINT = 1e-11
"""Side length, in ln tau and ln l, below which a box counts as a point."""


@kernel
def snapped(low: float, high: float, step: float) -> tuple[float, float]:
    """The part of a range between its first and last multiple of ``step``; empty if the first exceeds the second."""
    if step <= 0.0:
        return low, high
    return math.ceil(low / step * (1.0 - 1e-12)) * step, math.floor(high / step * (1.0 + 1e-12)) * step


@kernel
def snap(box: Array, slice_: Array, steps: Array) -> bool:
    """Shrink a box to its first and last available length, and width b = 1/(tau h^3) if h is fixed; False if empty."""
    box[2], box[3] = snapped(box[2], box[3], steps[1])
    if steps[0] > 0.0 and slice_[2] == slice_[3]:
        cube = slice_[2] ** 3
        b1, b2 = snapped(math.exp(-box[1]) / cube, math.exp(-box[0]) / cube, steps[0])
        if b1 > b2:
            return False
        box[0], box[1] = -math.log(b2 * cube), -math.log(b1 * cube)
    return box[0] <= box[1] and box[2] <= box[3]


@kernel
def available(box: Array, slice_: Array, steps: Array) -> bool:
    """Whether the sizes at the centre of a box are available."""
    fixed = slice_[2] == slice_[3]
    return (steps[1] <= 0.0 or box[2] == box[3]) and (steps[0] <= 0.0 or not fixed or box[0] == box[1])


@kernel
def set_half(box: Array, parent: Array, upper: bool) -> None:
    """The lower or upper half of a box, bisected in the direction in which the beam's argument tau l^2 varies more."""
    for k in range(4):
        box[k] = parent[k]
    if 2.0 * math.log(parent[3] / parent[2]) > parent[1] - parent[0]:
        box[2 if upper else 3] = math.sqrt(parent[2] * parent[3])
    else:
        box[0 if upper else 1] = 0.5 * (parent[0] + parent[1])


@kernel
def prove(
    p: Relaxation, slices: Array, length: Array, steps: Array, incumbent: float, gap: float, nodes: int
) -> tuple[float, int, int, Array]:
    """Branch and bound over every slice (b1, b2, h1, h2 bounds) and ``length`` = (l1, l2); ``steps`` of b and l or 0.

    Stops when ``incumbent`` (or the best box centre found) is optimal within ``gap`` in ln objective, after ``nodes``
    boxes, or when a box with the lowest bound has become a point. Returns the lower bound of ln objective, the number
    of boxes evaluated, the number of open boxes, and ln objective, ln tau, l, h of the best centre; if no centre is
    admissible, ln tau, l, h of such a point.
    """
    capacity = 2 * nodes + slices.shape[0] + 2
    boxes, origin, count = np.empty((capacity, 4)), np.empty(capacity, np.int64), 0
    box, centre, curvatures, best = np.empty(4), np.empty(4), workspace(p), np.full(4, np.nan)
    heap = [(np.inf, -1)]
    heap.clear()
    best[0], pruned, evaluated = np.inf, np.inf, 0
    for s in range(slices.shape[0]):
        b1, b2, h1, h2 = slices[s]
        boxes[s, 0], boxes[s, 1] = -math.log(b2 * h2**3), -math.log(b1 * h1**3)
        boxes[s, 2], boxes[s, 3], origin[s] = length[0], length[1], s
        heapq.heappush(heap, (-np.inf, s))
        count += 1
    while len(heap) > 0:
        lower, node = heap[0]
        # The bound of a point cannot be raised.
        if lower >= min(min(incumbent, best[0]) - gap, pruned) or evaluated >= nodes:
            break
        heapq.heappop(heap)
        slice_ = slices[origin[node]]
        for half in range(2):
            set_half(box, boxes[node], half == 1)
            if not snap(box, slice_, steps):
                continue
            evaluated += 1
            fill_curvatures(p, box, curvatures)
            bound, _ = box_bound(p, slice_, box, curvatures, LOW, HIGH)
            if bound == np.inf:
                continue
            bound = max(bound, lower)
            centre[0] = centre[1] = 0.5 * (box[0] + box[1])
            centre[2] = centre[3] = box[2] if box[2] == box[3] else math.sqrt(box[2] * box[3])
            value, h = box_bound(p, slice_, centre, curvatures, VALUE, VALUE)
            if value < best[0] and available(box, slice_, steps):
                best[0], best[1], best[2], best[3] = value, centre[0], centre[2], h
            target = min(incumbent, best[0]) - gap
            point = box[1] - box[0] < _POINT and box[3] - box[2] < _POINT * box[3]
            if bound >= target or point:
                if point and best[0] == np.inf and bound < pruned:
                    # The feasible set of the relaxation may be so small that no centre of a box lies in it.
                    best[1], best[2], best[3] = centre[0], centre[2], min_thickness(slice_, centre[0])
                pruned = min(pruned, bound)
                continue
            # Parts removed by contraction are infeasible or not better than the target.
            pruned = min(pruned, target)
            if contract(p, slice_, box, curvatures, target):
                for k in range(4):
                    boxes[count, k] = box[k]
                origin[count] = origin[node]
                heapq.heappush(heap, (bound, count))
                count += 1
    lower = heap[0][0] if len(heap) > 0 else np.inf
    return min(min(lower, pruned), min(incumbent, best[0])), evaluated, len(heap), best
