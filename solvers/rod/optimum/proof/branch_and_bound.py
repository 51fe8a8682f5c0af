"""Best-first branch and bound over boxes of (ln tau, ln l).

Bounds of a box come from ``solvers.rod.optimum.proof.box_bounds``; before bisection a box is contracted to the part
that may improve on the incumbent (``solvers.rod.optimum.proof.bound_tightening``).
"""

from __future__ import annotations

import heapq
import math

import numpy as np

from solvers.numerics.jit import kernel
from solvers.rod.optimum.proof.bound_tightening import contract
from solvers.rod.optimum.proof.box_bounds import Array, Relaxation, Work, box_bound, point_value
from solvers.rod.strip.buckling import log_critical_parameter

_NEARLY = 1e-2
"""In ln objective: to divide boxes farther than that from being ruled out, a look at few angles is enough."""
_POINT = 1e-11
"""A box with shorter sides, in ln tau and ln l, is a point."""
_CONTRACTION_RATIO = 0.6
"""A box is contracted again before bisection if a side shrank below this fraction of its length."""


@kernel
def snapped(l1: float, l2: float, step: float) -> tuple[float, float]:
    """The part of [l1, l2] between its first and last multiple of ``step``; empty if the first exceeds the second."""
    if step <= 0.0:
        return l1, l2
    return math.ceil(l1 / step * (1.0 - 1e-12)) * step, math.floor(l2 / step * (1.0 + 1e-12)) * step


@kernel
def snapped_width(x1: float, x2: float, slice_: Array, step: float) -> tuple[float, float]:
    """The part of [x1, x2] between multiples of ``step`` of b = 1/(tau h^3), for fixed h."""
    if step <= 0.0 or slice_[2] < slice_[3]:
        return x1, x2
    cube = slice_[2] ** 3
    b1, b2 = snapped(math.exp(-x2) / cube, math.exp(-x1) / cube, step)
    if b1 > b2:
        return 1.0, 0.0
    return -math.log(b2 * cube), -math.log(b1 * cube)


@kernel
def sized_centre(slice_: Array, x1: float, x2: float, l1: float, l2: float, steps: Array) -> tuple[float, float]:
    """ln tau and l of the available sizes nearest to a box's centre; the box begins and ends at such sizes."""
    x, l = 0.5 * (x1 + x2), math.sqrt(l1 * l2)
    if steps[0] > 0.0 and slice_[2] == slice_[3]:
        cube = slice_[2] ** 3
        x = min(max(-math.log(max(round(math.exp(-x) / cube / steps[0]), 1) * steps[0] * cube), x1), x2)
    if steps[1] > 0.0:
        l = min(max(round(l / steps[1]) * steps[1], l1), l2)
    return x, l


@kernel
def thickness(slice_: Array, x: float) -> float:
    """h of the widest strip of a slice of ln tau = x."""
    return min(max((math.exp(-x) / slice_[1]) ** (1.0 / 3.0), slice_[2]), slice_[3])


@kernel
def prove(
    p: Relaxation,
    quick: Relaxation,
    slices: Array,
    length: Array,
    steps: Array,
    incumbent: float,
    gap: float,
    nodes: int,
    work: Work,
    tolerance: float,
    best: Array,
) -> tuple[float, int, int]:
    """Branch and bound over every slice (b1, b2, h1, h2 bounds) and ``length`` = (l1, l2); ``steps`` of b and l or 0.

    ``quick`` is ``p`` with a mean over fewer angles that bounds its own from below, or ``p`` itself.
    Stops when ``incumbent`` (or the best box centre found) is optimal within ``gap`` in ln objective, or after
    ``nodes`` boxes, or where a box of the least bound has become a point. ``best`` receives ln objective, ln tau, l, h
    and the slice of the best centre; without an admissible one, all but the objective of such a point. Returns the
    lower bound of ln objective, the number of boxes evaluated, and that of boxes left.
    """
    room = 2 * nodes + slices.shape[0] + 2
    boxes, origin, count = np.empty((room, 4)), np.empty(room, np.int64), 0
    heap = [(np.inf, -1)]
    heap.clear()
    box = np.empty(4)
    best[0] = np.inf
    pruned, looked = np.inf, 0
    for s in range(slices.shape[0]):
        x1, x2 = -math.log(slices[s, 1] * slices[s, 3] ** 3), -math.log(slices[s, 0] * slices[s, 2] ** 3)
        x1, x2 = snapped_width(x1, x2, slices[s], steps[0])
        l1, l2 = snapped(length[0], length[1], steps[1])
        if x1 <= x2 and l1 <= l2:
            boxes[count, 0], boxes[count, 1], boxes[count, 2], boxes[count, 3] = x1, x2, l1, l2
            origin[count] = s
            heapq.heappush(heap, (-np.inf, count))
            count += 1
    while len(heap) > 0:
        lower, node = heap[0]
        target = min(incumbent, best[0]) - gap
        # A bound that is that of a point cannot be raised.
        if lower >= min(target, pruned) or looked >= nodes:
            break
        heapq.heappop(heap)
        slice_ = slices[origin[node]]
        x1, x2, l1, l2 = boxes[node]
        if lower == -np.inf:
            children, axis = 1, -1
        else:
            # The beam's arguments depend on tau l^2: bisect the side along which it varies more.
            children, axis = 2, 1 if 2.0 * math.log(l2 / l1) > x2 - x1 else 0
        for child in range(children):
            a1, a2, m1, m2 = x1, x2, l1, l2
            if axis == 0:
                middle = 0.5 * (x1 + x2)
                a1, a2 = (x1, middle) if child == 0 else (middle, x2)
                a1, a2 = snapped_width(a1, a2, slice_, steps[0])
            elif axis == 1:
                middle = math.sqrt(l1 * l2)
                m1, m2 = (l1, middle) if child == 0 else (middle, l2)
                m1, m2 = snapped(m1, m2, steps[1])
            if a1 > a2 or m1 > m2:
                continue
            while a1 <= a2 and m1 <= m2:
                if p.compression > 0.0:
                    # Restrict tau to the stability of the shortest strip in the box.
                    ln_u, _ = log_critical_parameter(m1, p.rod_length)
                    most = 2.0 * ln_u - math.log(12.0 * p.rod_length * p.rod_length * p.compression / p.modulus)
                    if most < a2:
                        a2 = most + 1e-13
                        a1, a2 = snapped_width(a1, a2, slice_, steps[0])
                    if a1 > a2:
                        break
                # A centre is a candidate if its sizes are available; without an incumbent, the nearest available ones.
                sized = (steps[1] <= 0.0 or m1 == m2) and (steps[0] <= 0.0 or slice_[2] < slice_[3] or a1 == a2)
                if not sized and min(incumbent, best[0]) == np.inf:
                    middle, l = sized_centre(slice_, a1, a2, m1, m2, steps)
                    if box_bound(p, slice_, middle, middle, l, l, work, np.inf) < np.inf:
                        value, h = point_value(p, slice_, middle, l, work, tolerance)
                        if value < best[0]:
                            best[0], best[1], best[2], best[3], best[4] = value, middle, l, h, origin[node]
                looked += 1
                target = min(incumbent, best[0]) - gap
                few = quick.react_force.size < p.react_force.size and target < np.inf
                bound = box_bound(quick if few else p, slice_, a1, a2, m1, m2, work, target)
                middle, l = 0.5 * (a1 + a2), m1 if m1 == m2 else math.sqrt(m1 * m2)
                if few and bound < target:
                    better = sized and point_value(quick, slice_, middle, l, work, tolerance)[0] < target
                    if better or bound >= target - _NEARLY:
                        few, bound = False, box_bound(p, slice_, a1, a2, m1, m2, work, target)
                if bound == np.inf:
                    break
                bound = max(bound, lower)
                if bound < target and sized and not few:
                    value, h = point_value(p, slice_, middle, l, work, tolerance)
                    if value < best[0]:
                        best[0], best[1], best[2], best[3], best[4] = value, middle, l, h, origin[node]
                target = min(incumbent, best[0]) - gap
                point = a2 - a1 < _POINT and m2 - m1 < _POINT * m2
                if bound >= target or point:
                    if point and best[0] == np.inf and bound < pruned:
                        # Strips that meet the limits of the relaxation may be as few as a corner of their region.
                        best[1], best[2], best[3], best[4] = middle, l, thickness(slice_, middle), origin[node]
                    pruned = min(pruned, bound)
                    break
                # Parts cut off from here on are infeasible or not better than the target.
                pruned = min(pruned, target)
                if not contract(quick if few else p, slice_, a1, a2, m1, m2, work, target, box):
                    break
                narrow = box[1] - box[0] < _CONTRACTION_RATIO * (a2 - a1)
                short = math.log(box[3] / box[2]) < _CONTRACTION_RATIO * math.log(m2 / m1)
                a1, a2 = snapped_width(box[0], box[1], slice_, steps[0])
                m1, m2 = snapped(box[2], box[3], steps[1])
                if a1 > a2 or m1 > m2:
                    break
                if not (narrow or short):
                    boxes[count, 0], boxes[count, 1], boxes[count, 2], boxes[count, 3] = a1, a2, m1, m2
                    origin[count] = origin[node]
                    heapq.heappush(heap, (bound, count))
                    count += 1
                    break
    lower = heap[0][0] if len(heap) > 0 else np.inf
    return min(min(lower, pruned), min(incumbent, best[0])), looked, len(heap)
