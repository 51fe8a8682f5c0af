"""The search that proves: boxes of (ln tau, ln l), the most promising first, until none can hold anything better.

Bounds of a box come from ``solvers.rod.relaxation``; near a known optimum also from its Lagrangian: for multipliers
>= 0 the weighted sum of objective and constraints is nowhere on the admissible set greater than the objective, and
since its gradient vanishes at the optimum, its range over a small box is as narrow as the square of the box's size.
That is what lets a proof come to 1e-6 in about a thousand boxes.
"""

from __future__ import annotations

import heapq
import math

import numpy as np

from solvers.numerics.jit import kernel
from solvers.rod.enclosures import critical_parameter, product
from solvers.rod.relaxation import (
    Array,
    Cuts,
    Relaxation,
    Work,
    box_bound,
    point_value,
)


@kernel
def cut_thickness(
    work: Work, p: Relaxation, cuts: Cuts, n: int, tau1: float, tau2: float, which: int
) -> tuple[float, float, float]:
    """Direct part D, and the range of W, of the functional h^2 tau D + h W of a cut; which = 0 centre, 1 range."""
    i1, i2, j = cuts.angles[n, 0], cuts.angles[n, 1], cuts.section[n]
    fibre, pull, push = cuts.factors[n, 0], cuts.factors[n, 1], cuts.factors[n, 2]
    D = pull * p.force[i1] + push * p.force[i2]
    f1 = 0.5 * p.modulus * fibre * pull * p.stroke[i1]
    f2 = 0.5 * p.modulus * fibre * push * p.stroke[i2]
    if which == 0:
        W = f1 * work.centre[i1, j] + f2 * work.centre[i2, j]
        return D, W, W
    a1, a2 = product(f1, f1, work.low[i1, j], work.high[i1, j])
    b1, b2 = product(f2, f2, work.low[i2, j], work.high[i2, j])
    return D, a1 + b1, a2 + b2


@kernel
def root_thickness(D: float, W: float, limit: float) -> float:
    """h with h^2 D + h W = limit; inf where there is none."""
    discriminant = W * W + 4.0 * D * limit
    if discriminant < 0.0:
        return np.inf
    below = W + math.sqrt(discriminant)
    return 2.0 * limit / below if below > 0.0 else np.inf


@kernel
def lagrangian(
    p: Relaxation, cuts: Cuts, slice_: Array, x1: float, x2: float, l1: float, l2: float, work: Work, gradient: Array
) -> float:
    """The Lagrangian's lower bound over the box in ``work``; -inf where its derivatives are not bounded.

    ``gradient`` receives the ranges of its derivatives by ln tau and ln l.
    """
    x, y = 0.5 * (x1 + x2), 0.5 * (math.log(l1) + math.log(l2))
    rx, ry = 0.5 * (x2 - x1), 0.5 * (math.log(l2) - math.log(l1))
    tau, tau1, tau2 = math.exp(x), math.exp(x1), math.exp(x2)
    value = cuts.linear[0] * x + cuts.linear[1] * y
    gx1 = gx2 = cuts.linear[0]
    gy1 = gy2 = cuts.linear[1]
    # ln u, in stability and in the sideways cap, with its slope's range from the ends: the slope is monotone in l.
    ln_u, _ = critical_parameter(math.exp(y), p.rod_length)
    _, s1 = critical_parameter(l1, p.rod_length)
    _, s2 = critical_parameter(l2, p.rod_length)
    s1, s2 = min(s1, s2), max(s1, s2)
    if cuts.linear[2] > 0.0:
        constant = math.log(12.0 * p.rod_length * p.rod_length * p.compression / p.modulus)
        value += cuts.linear[2] * (x - 2.0 * ln_u + constant)
        gx1, gx2 = gx1 + cuts.linear[2], gx2 + cuts.linear[2]
        gy1, gy2 = gy1 - 2.0 * cuts.linear[2] * s2, gy2 - 2.0 * cuts.linear[2] * s1
    fixed, width = math.log(slice_[2]), math.log(slice_[1])
    value += cuts.floors[0] * fixed - cuts.floors[1] * (x + width) / 3.0
    value += -cuts.caps[0] * math.log(slice_[3]) + cuts.caps[1] * (x + math.log(slice_[0])) / 3.0
    own = (cuts.caps[1] - cuts.floors[1]) / 3.0
    gx1, gx2 = gx1 + own, gx2 + own
    if cuts.caps[2] > 0.0:
        constant = math.log(p.modulus / (12.0 * p.rod_length**2 * p.compression))
        value -= cuts.caps[2] * 0.125 * (constant + 2.0 * ln_u - 3.0 * x)
        gx1, gx2 = gx1 + 0.375 * cuts.caps[2], gx2 + 0.375 * cuts.caps[2]
        gy1, gy2 = gy1 - 0.25 * cuts.caps[2] * s2, gy2 - 0.25 * cuts.caps[2] * s1
    for n in range(cuts.section.size):
        i1, i2, j = cuts.angles[n, 0], cuts.angles[n, 1], cuts.section[n]
        if not (work.bounded[i1] and work.bounded[i2]):
            return -np.inf
        fibre, pull, push, limit = cuts.factors[n]
        D, W, _ = cut_thickness(work, p, cuts, n, tau1, tau2, 0)
        _, W1, W2 = cut_thickness(work, p, cuts, n, tau1, tau2, 1)
        D1, D2 = product(tau1, tau2, D, D)
        f1 = 0.5 * p.modulus * fibre * pull * p.stroke[i1]
        f2 = 0.5 * p.modulus * fibre * push * p.stroke[i2]
        a, b = work.slope[i1, j], work.slope[i2, j]
        u1, u2 = product(f1, f1, a[0], a[1])
        v1, v2 = product(f2, f2, b[0], b[1])
        wx1, wx2 = u1 + v1, u2 + v2
        u1, u2 = product(f1, f1, a[2], a[3])
        v1, v2 = product(f2, f2, b[2], b[3])
        wy1, wy2 = u1 + v1, u2 + v2
        ceiling, share = cuts.ceiling[n], cuts.share[n]
        if ceiling > 0.0:
            # H = ln h on h^2 tau D + h W = limit: (1 + s) dH = -s dX - (h/limit) dW with s = h^2 tau D/limit.
            h1, h2 = root_thickness(D2, W2, limit), root_thickness(D1, W1, limit)
            h = root_thickness(tau * D, W, limit)
            if not (h1 > 0.0 and h2 < np.inf):
                return -np.inf
            part1, part2 = product(h1 * h1, h2 * h2, D1 / limit, D2 / limit)
            if 1.0 + part1 <= 0.0:
                return -np.inf
            r1, r2 = 1.0 / (1.0 + part2), 1.0 / (1.0 + part1)
            q1, q2 = product(h1 / limit, h2 / limit, wx1, wx2)
            d1, d2 = product(-part2 - q2, -part1 - q1, r1, r2)
            value -= ceiling * math.log(h)
            gx1, gx2 = gx1 - ceiling * d2, gx2 - ceiling * d1
            q1, q2 = product(h1 / limit, h2 / limit, wy1, wy2)
            d1, d2 = product(-q2, -q1, r1, r2)
            gy1, gy2 = gy1 - ceiling * d2, gy2 - ceiling * d1
        if share > 0.0:
            # ln(h^2 tau D + h W) at h = the least thickness: a constant, or exp(-(X + ln b)/3).
            if cuts.thickness == 0:
                h = h1 = h2 = slice_[2]
                turn = 0.0
            else:
                h, turn = math.exp(-(x + width) / 3.0), -1.0 / 3.0
                h1, h2 = math.exp(-(x2 + width) / 3.0), math.exp(-(x1 + width) / 3.0)
            e1, e2 = product(h1 * h1, h2 * h2, D1, D2)
            w1, w2 = product(h1, h2, W1, W2)
            total = h * h * tau * D + h * W
            if e1 + w1 <= 0.0:
                return -np.inf
            i1_, i2_ = 1.0 / (e2 + w2), 1.0 / (e1 + w1)
            q1, q2 = product(h1, h2, wx1, wx2)
            z1, z2 = product(1.0 + 2.0 * turn, 1.0 + 2.0 * turn, e1, e2)
            o1, o2 = product(turn, turn, w1, w2)
            d1, d2 = product(z1 + o1 + q1, z2 + o2 + q2, i1_, i2_)
            value += share * math.log(total)
            gx1, gx2 = gx1 + share * d1, gx2 + share * d2
            q1, q2 = product(h1, h2, wy1, wy2)
            d1, d2 = product(q1, q2, i1_, i2_)
            gy1, gy2 = gy1 + share * d1, gy2 + share * d2
    gradient[0], gradient[1], gradient[2], gradient[3] = gx1, gx2, gy1, gy2
    return value - max(abs(gx1), abs(gx2)) * rx - max(abs(gy1), abs(gy2)) * ry


@kernel
def snapped(l1: float, l2: float, step: float) -> tuple[float, float]:
    """The part of [l1, l2] between its first and last multiple of ``step``; empty when the first exceeds the second."""
    if step <= 0.0:
        return l1, l2
    return math.ceil(l1 / step * (1.0 - 1e-12)) * step, math.floor(l2 / step * (1.0 + 1e-12)) * step


@kernel
def snapped_width(x1: float, x2: float, slice_: Array, step: float) -> tuple[float, float]:
    """The part of [x1, x2] between multiples of ``step`` of b = 1/(tau h^3), where h is fixed."""
    if step <= 0.0 or slice_[2] < slice_[3]:
        return x1, x2
    cube = slice_[2] ** 3
    b1, b2 = snapped(math.exp(-x2) / cube, math.exp(-x1) / cube, step)
    if b1 > b2:
        return 1.0, 0.0
    return -math.log(b2 * cube), -math.log(b1 * cube)


@kernel
def prove(
    p: Relaxation,
    slices: Array,
    length: Array,
    steps: Array,
    cuts: Cuts,
    incumbent: float,
    gap: float,
    nodes: int,
    work: Work,
    tolerance: float,
    best: Array,
) -> tuple[float, int, int]:
    """Branch and bound over every slice (b1, b2, h1, h2 bounds) and ``length`` = (l1, l2); ``steps`` of b and l or 0.

    Stops when nothing can beat ``incumbent`` (or the best centre of a box found on the way) by more than ``gap`` in
    ln objective, or after ``nodes`` boxes. ``best`` receives ln objective, ln tau, l, h and the slice of the best
    centre. Returns the lower bound of ln objective, the number of boxes looked at, and of those left over.
    """
    room = 2 * nodes + slices.shape[0] + 2
    boxes, origin, count = np.empty((room, 4)), np.empty(room, np.int64), 0
    heap = [(np.inf, -1)]
    heap.clear()
    gradient = np.empty(4)
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
        if lower >= target or looked >= nodes:
            break
        heapq.heappop(heap)
        slice_ = slices[origin[node]]
        x1, x2, l1, l2 = boxes[node]
        if lower == -np.inf:
            children, axis = 1, -1
        else:
            # Arguments of the beam go with tau l^2: cut where they change more.
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
            if p.compression > 0.0:
                # Nothing beyond the stability that the shortest strip of the box has.
                ln_u, _ = critical_parameter(m1, p.rod_length)
                most = 2.0 * ln_u - math.log(12.0 * p.rod_length * p.rod_length * p.compression / p.modulus)
                if most < a2:
                    a2 = most + 1e-13
                    a1, a2 = snapped_width(a1, a2, slice_, steps[0])
                if a1 > a2:
                    continue
            looked += 1
            target = min(incumbent, best[0]) - gap
            bound = box_bound(p, slice_, a1, a2, m1, m2, work, target)
            if bound < target and cuts.linear.size > 0:
                bound = max(bound, lagrangian(p, cuts, slice_, a1, a2, m1, m2, work, gradient))
            if bound == np.inf:
                continue
            bound = max(bound, lower)
            # A centre is a candidate only where it lies on the steps that are asked for.
            sized = (steps[1] <= 0.0 or m1 == m2) and (steps[0] <= 0.0 or slice_[2] < slice_[3] or a1 == a2)
            if bound < target and sized:
                middle = 0.5 * (a1 + a2)
                l = m1 if m1 == m2 else math.sqrt(m1 * m2)
                value, h = point_value(p, slice_, middle, l, work, tolerance)
                if value < best[0]:
                    best[0], best[1], best[2], best[3], best[4] = value, middle, l, h, origin[node]
            target = min(incumbent, best[0]) - gap
            point = a2 - a1 < 1e-13 and m2 - m1 < 1e-13 * m2
            if bound >= target or point:
                pruned = min(pruned, bound)
                continue
            boxes[count, 0], boxes[count, 1], boxes[count, 2], boxes[count, 3] = a1, a2, m1, m2
            origin[count] = origin[node]
            heapq.heappush(heap, (bound, count))
            count += 1
    lower = heap[0][0] if len(heap) > 0 else np.inf
    return min(min(lower, pruned), min(incumbent, best[0])), looked, len(heap)
