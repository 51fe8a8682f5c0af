"""Bound tightening: contraction of a box of designs to the part that may contain an improvement of the incumbent.

Over a box of X = ln tau and Y = ln l every requirement, and every limit on an improvement, is a function
phi(X, Y) <= 0 with known value at the centre and known ranges of its derivatives
(``solvers.rod.optimum.proof.intervals``). By the mean value theorem

    phi >= phi_c + g_x dX + g_y dY - (w_x r_x + w_y r_y),

g the midpoint and w the half-width of a derivative's range, r the half-size of the box: a half-plane, with an error
quadratic in the box's size. The intersection of all half-planes with the box is a convex polygon. If it is empty the
box is discarded; otherwise it shrinks to the polygon's bounding rectangle. Near an optimum, at a vertex of the feasible
set or not, boxes shrink faster than by bisection, which is why a proof to 1e-6 takes only a few hundred boxes.

The functions: upper limits H_k of ln h (bounds of h and b, sideways buckling, and for every fibre and section the
thickness at which the functional p sigma(i1) + m sigma(i2) of its stresses at two angles reaches the limit), lower
limits F_m of ln h, stability S, and the objective. Utilisation increases with h, so that ln h <= H_k, F_m <= H_k, and a
utilisation to be minimised is least at the lower limits. Any two angles give a valid relaxation of the whole
revolution.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.numerics.jit import kernel
from solvers.rod.optimum.proof.box_bounds import (
    Array,
    Relaxation,
    Work,
    least_thickness,
    reactions,
    sideways_thickness,
    stability_row,
    upper_thickness,
)
from solvers.rod.optimum.proof.intervals import product
from solvers.rod.optimum.proof.reaction_intervals import reaction_row
from solvers.rod.rows import LENGTH, POWER, PRESSURE, SIDE, STABILITY, TAU, THICKNESS, UTILISATION
from solvers.rod.strip.buckling import log_critical_parameter

_SLACK = 1e-12
_MAX_CORNERS = 64


@kernel
def root_thickness(D: float, W: float, limit: float) -> float:
    """h with h^2 D + h W = limit; inf if there is none."""
    discriminant = W * W + 4.0 * D * limit
    if discriminant < 0.0:
        return np.inf
    below = W + math.sqrt(discriminant)
    return 2.0 * limit / below if below > 0.0 else np.inf


@kernel
def ruling_line(p: Relaxation, high: float, low: float) -> tuple[float, float, float]:
    """The line p high + m low of the fatigue criterion that governs a stress cycle, and its value there; 0 if none.

    A corner of several lines is their minimum, for which no single line is a lower bound: none is returned. A parabola
    is convex, so its tangent is one.
    """
    a, m = 0.5 * (high - low), 0.5 * (high + low)
    best, alpha, beta = 0.0, 0.0, 0.0
    for c in range(p.lines.shape[0]):
        single = True
        for k in range(1, p.lines.shape[1]):
            single = single and p.lines[c, k, 0] == p.lines[c, 0, 0] and p.lines[c, k, 1] == p.lines[c, 0, 1]
        value = p.lines[c, 0, 0] * a + p.lines[c, 0, 1] * m
        if single and value > best:
            best, alpha, beta = value, p.lines[c, 0, 0], p.lines[c, 0, 1]
    if p.parabola[0] > 0.0:
        pa, pm = p.parabola[0] * a, 2.0 * p.parabola[1] * max(m, 0.0)
        root = math.sqrt(pa * pa + pm * pm)
        if 0.5 * (pa + root) > best and root > 0.0:
            best = 0.5 * (pa + root)
            alpha, beta = 0.5 * p.parabola[0] * (1.0 + pa / root), p.parabola[1] * pm / root
    return 0.5 * (alpha + beta), 0.5 * (beta - alpha), best


@kernel
def extreme_angles(p: Relaxation, work: Work, sign: float, j: int, tau: float, h: float) -> tuple[int, int]:
    """The angles of a fibre's maximum and minimum stress at section j, at the box's centre and thickness h."""
    top, bottom, high, low = 0, 0, -np.inf, np.inf
    for i in range(p.force.size):
        stress = h * tau * p.force[i] + sign * 0.5 * p.modulus * p.stroke[i] * work.bending.centre[i, j]
        if stress > high:
            high, top = stress, i
        if stress < low:
            low, bottom = stress, i
    return top, bottom


@kernel
def bending_part(
    p: Relaxation, work: Work, sign: float, j: int, i1: int, i2: int, pull: float, push: float, out: Array
) -> None:
    """W of the functional h^2 tau D + h W: value at the centre, range, ranges of its derivatives by X and Y."""
    f1, f2 = 0.5 * p.modulus * sign * pull * p.stroke[i1], 0.5 * p.modulus * sign * push * p.stroke[i2]
    out[0] = f1 * work.bending.centre[i1, j] + f2 * work.bending.centre[i2, j]
    a1, a2 = product(f1, f1, work.bending.low[i1, j], work.bending.high[i1, j])
    b1, b2 = product(f2, f2, work.bending.low[i2, j], work.bending.high[i2, j])
    out[1], out[2] = a1 + b1, a2 + b2
    for k in range(2):
        a1, a2 = product(f1, f1, work.bending.slope[i1, j, 2 * k], work.bending.slope[i1, j, 2 * k + 1])
        b1, b2 = product(f2, f2, work.bending.slope[i2, j, 2 * k], work.bending.slope[i2, j, 2 * k + 1])
        out[3 + 2 * k], out[4 + 2 * k] = a1 + b1, a2 + b2


@kernel
def ceiling_of(D: float, W: Array, tau1: float, tau: float, tau2: float, limit: float, out: Array) -> bool:
    """H = ln h on h^2 tau D + h W = limit: value and ranges of derivatives to ``out``; False if unbounded.

    (1 + s) dH = -s dX - (h/limit) dW with s = h^2 tau D/limit.
    """
    D1, D2 = product(tau1, tau2, D, D)
    h1, h2 = root_thickness(D2, W[2], limit), root_thickness(D1, W[1], limit)
    if not (h1 > 0.0 and h2 < np.inf):
        return False
    part1, part2 = product(h1 * h1, h2 * h2, D1 / limit, D2 / limit)
    if 1.0 + part1 <= 0.0:
        return False
    r1, r2 = 1.0 / (1.0 + part2), 1.0 / (1.0 + part1)
    out[0] = math.log(root_thickness(tau * D, W[0], limit))
    q1, q2 = product(h1 / limit, h2 / limit, W[3], W[4])
    out[1], out[2] = product(-part2 - q2, -part1 - q1, r1, r2)
    q1, q2 = product(h1 / limit, h2 / limit, W[5], W[6])
    out[3], out[4] = product(-q2, -q1, r1, r2)
    return True


@kernel
def utilisation_at_floor(
    D: float, W: Array, tau1: float, tau: float, tau2: float, floor: float, turn: float, rx: float, out: Array
) -> bool:
    """T = ln(h^2 tau D + h W) at ln h = floor + turn dX: value, ranges of derivatives; False if unbounded."""
    h, h1, h2 = math.exp(floor), math.exp(floor + turn * rx), math.exp(floor - turn * rx)
    D1, D2 = product(tau1, tau2, D, D)
    e1, e2 = product(h1 * h1, h2 * h2, D1, D2)
    w1, w2 = product(h1, h2, W[1], W[2])
    if e1 + w1 <= 0.0:
        return False
    i1, i2 = 1.0 / (e2 + w2), 1.0 / (e1 + w1)
    out[0] = math.log(h * h * tau * D + h * W[0])
    z1, z2 = product(1.0 + 2.0 * turn, 1.0 + 2.0 * turn, e1, e2)
    o1, o2 = product(turn, turn, w1, w2)
    q1, q2 = product(h1, h2, W[3], W[4])
    out[1], out[2] = product(z1 + o1 + q1, z2 + o2 + q2, i1, i2)
    q1, q2 = product(h1, h2, W[5], W[6])
    out[3], out[4] = product(q1, q2, i1, i2)
    return True


@kernel
def clip(polygon: Array, count: int, c: float, gx: float, gy: float, room: Array) -> int:
    """Intersect a convex polygon with the half-plane c + gx x + gy y <= 0, in place; returns the number of vertices."""
    # Every cut adds at most one vertex; skipping a cut leaves a valid superset.
    if count > _MAX_CORNERS - 2:
        return count
    kept = 0
    for n in range(count):
        m = n + 1 if n + 1 < count else 0
        here = c + gx * polygon[n, 0] + gy * polygon[n, 1] - _SLACK
        there = c + gx * polygon[m, 0] + gy * polygon[m, 1] - _SLACK
        if here <= 0.0:
            room[kept, 0], room[kept, 1] = polygon[n, 0], polygon[n, 1]
            kept += 1
        if (here <= 0.0) != (there <= 0.0):
            share = here / (here - there)
            room[kept, 0] = polygon[n, 0] + share * (polygon[m, 0] - polygon[n, 0])
            room[kept, 1] = polygon[n, 1] + share * (polygon[m, 1] - polygon[n, 1])
            kept += 1
    for n in range(kept):
        polygon[n, 0], polygon[n, 1] = room[n, 0], room[n, 1]
    return kept


@kernel
def cut(
    polygon: Array, count: int, c: float, gx1: float, gx2: float, gy1: float, gy2: float, rx: float, ry: float,
    room: Array,
) -> int:  # fmt: skip
    """``clip`` by phi <= 0, with phi given by its value at the centre and the ranges of its derivatives."""
    gx, gy = 0.5 * (gx1 + gx2), 0.5 * (gy1 + gy2)
    return clip(polygon, count, c - 0.5 * (gx2 - gx1) * rx - 0.5 * (gy2 - gy1) * ry, gx, gy, room)


@kernel
def ceilings(
    p: Relaxation, slice_: Array, x: float, y: float, tau1: float, tau2: float, l1: float, l2: float, work: Work,
    out: Array,
) -> int:  # fmt: skip
    """All upper limits of ln h over the box, as rows of value and ranges of derivatives; returns their number."""
    tau, l = math.exp(x), math.exp(y)
    out[0, :] = 0.0
    out[0, 0] = math.log(slice_[3])
    out[1, :] = 0.0
    out[1, 0], out[1, 1], out[1, 2] = -(x + math.log(slice_[0])) / 3.0, -1.0 / 3.0, -1.0 / 3.0
    n = 2
    if p.compression > 0.0:
        _, s1 = log_critical_parameter(l1, p.rod_length)
        _, s2 = log_critical_parameter(l2, p.rod_length)
        out[2, 0] = math.log(sideways_thickness(p, x, l))
        out[2, 1] = out[2, 2] = -0.375
        out[2, 3], out[2, 4] = 0.25 * min(s1, s2), 0.25 * max(s1, s2)
        n = 3
    least, most = least_thickness(slice_, x), upper_thickness(p, slice_, x, l)
    start, bending = math.sqrt(least * max(most, least)), np.empty(7)
    for kind in range(2):
        limit = p.limits[kind]
        if not limit < 1e299:
            continue
        for fibre in range(2):
            sign = 1.0 - 2.0 * fibre
            for j in range(p.eta.size):
                h = start
                for _ in range(2):
                    i1, i2 = extreme_angles(p, work, sign, j, tau, h)
                    scale = sign * 0.5 * p.modulus * h
                    high = h * h * tau * p.force[i1] + scale * p.stroke[i1] * work.bending.centre[i1, j]
                    low = h * h * tau * p.force[i2] + scale * p.stroke[i2] * work.bending.centre[i2, j]
                    if kind == 0:
                        pull, push, _ = ruling_line(p, high, low)
                    else:
                        pull, push = (1.0, 0.0) if high > -low else (0.0, -1.0)
                    D = pull * p.force[i1] + push * p.force[i2]
                    bending_part(p, work, sign, j, i1, i2, pull, push, bending)
                    h = root_thickness(tau * D, bending[0], limit)
                    if not h < 10.0 * most:
                        break
                if not (work.bending.bounded[i1] and work.bending.bounded[i2]) or pull == push or not h < 10.0 * most:
                    continue
                if ceiling_of(D, bending, tau1, tau, tau2, limit, out[n]):
                    n += 1
    return n


@kernel
def contract(
    p: Relaxation, slice_: Array, x1: float, x2: float, l1: float, l2: float, work: Work, target: float, box: Array
) -> bool:
    """Shrink ``box`` (x1, x2, l1, l2), the one in ``work``, to the part that may have an objective below ``target``.

    False if it is empty.
    """
    x, y = 0.5 * (x1 + x2), 0.5 * (math.log(l1) + math.log(l2))
    rx, ry = 0.5 * (x2 - x1), 0.5 * (math.log(l2) - math.log(l1))
    tau, tau1, tau2 = math.exp(x), math.exp(x1), math.exp(x2)
    polygon, room = np.empty((_MAX_CORNERS, 2)), np.empty((_MAX_CORNERS, 2))
    polygon[0, 0], polygon[1, 0], polygon[2, 0], polygon[3, 0] = -rx, rx, rx, -rx
    polygon[0, 1], polygon[1, 1], polygon[2, 1], polygon[3, 1] = -ry, -ry, ry, ry
    corners, w = 4, p.weights
    value, gx1, gx2 = w[TAU] * x + w[LENGTH] * y, w[TAU], w[TAU]
    gy1, gy2 = w[LENGTH], w[LENGTH]
    if p.compression > 0.0:
        _, s1 = log_critical_parameter(l1, p.rod_length)
        _, s2 = log_critical_parameter(l2, p.rod_length)
        s1, s2 = -2.0 * max(s1, s2), -2.0 * min(s1, s2)
        stability = stability_row(p, x, math.exp(y))
        corners = cut(polygon, corners, stability, 1.0, 1.0, s1, s2, rx, ry, room)
        if w[STABILITY] != 0.0:
            value += w[STABILITY] * stability
            gx1, gx2 = gx1 + w[STABILITY], gx2 + w[STABILITY]
            gy1, gy2 = gy1 + w[STABILITY] * s1, gy2 + w[STABILITY] * s2
    row = np.empty(5)
    for which in (SIDE, PRESSURE, POWER):
        limit = np.inf if which == SIDE else p.limits[which - PRESSURE + 2]
        if w[which] == 0.0 and not limit < np.inf:
            continue
        if not reaction_row(p, work, which, tau1, tau2, row):
            if w[which] == 0.0:
                continue
            bounds = reactions(p, work.stiffness[:, 0], work.stiffness[:, 2])
            row[:] = 0.0
            row[0] = math.log(max(bounds[which - SIDE], 1e-300))
        elif limit < np.inf:
            corners = cut(polygon, corners, row[0] - math.log(limit), row[1], row[2], row[3], row[4], rx, ry, room)
        value, gx1, gx2 = value + w[which] * row[0], gx1 + w[which] * row[1], gx2 + w[which] * row[2]
        gy1, gy2 = gy1 + w[which] * row[3], gy2 + w[which] * row[4]
    floor = np.empty(2)
    floor[0], floor[1] = math.log(slice_[2]), -(x + math.log(slice_[1])) / 3.0
    high = np.empty((3 + 4 * p.eta.size, 5))
    count = ceilings(p, slice_, x, y, tau1, tau2, l1, l2, work, high)
    for k in range(count):
        for m in range(2):
            turn = 0.0 if m == 0 else -1.0 / 3.0
            corners = cut(
                polygon, corners, floor[m] - high[k, 0], turn - high[k, 2], turn - high[k, 1], -high[k, 4],
                -high[k, 3], rx, ry, room,
            )  # fmt: skip
        if w[THICKNESS] < 0.0 and target < np.inf:
            wh = w[THICKNESS]
            corners = cut(
                polygon, corners, value + wh * high[k, 0] - target, gx1 + wh * high[k, 2], gx2 + wh * high[k, 1],
                gy1 + wh * high[k, 4], gy2 + wh * high[k, 3], rx, ry, room,
            )  # fmt: skip
    if w[THICKNESS] == 0.0 and w[UTILISATION] == 0.0 and target < np.inf:
        corners = cut(polygon, corners, value - target, gx1, gx2, gy1, gy2, rx, ry, room)
    if w[UTILISATION] != 0.0 and target < np.inf:
        bending = np.empty(7)
        for m in range(2):
            turn, h = 0.0 if m == 0 else -1.0 / 3.0, math.exp(floor[m])
            for fibre in range(2):
                sign = 1.0 - 2.0 * fibre
                for j in range(p.eta.size):
                    i1, i2 = extreme_angles(p, work, sign, j, tau, h)
                    if not (work.bending.bounded[i1] and work.bending.bounded[i2]):
                        continue
                    scale = sign * 0.5 * p.modulus * h
                    pull, push, _ = ruling_line(
                        p,
                        h * h * tau * p.force[i1] + scale * p.stroke[i1] * work.bending.centre[i1, j],
                        h * h * tau * p.force[i2] + scale * p.stroke[i2] * work.bending.centre[i2, j],
                    )
                    if pull == push:
                        continue
                    bending_part(p, work, sign, j, i1, i2, pull, push, bending)
                    D = pull * p.force[i1] + push * p.force[i2]
                    if utilisation_at_floor(D, bending, tau1, tau, tau2, floor[m], turn, rx, row):
                        wu = w[UTILISATION]
                        corners = cut(
                            polygon, corners, value + wu * row[0] - target, gx1 + wu * row[1], gx2 + wu * row[2],
                            gy1 + wu * row[3], gy2 + wu * row[4], rx, ry, room,
                        )  # fmt: skip
    if corners == 0:
        return False
    left, right, down, up = np.inf, -np.inf, np.inf, -np.inf
    for n in range(corners):
        left, right = min(left, polygon[n, 0]), max(right, polygon[n, 0])
        down, up = min(down, polygon[n, 1]), max(up, polygon[n, 1])
    box[0], box[1] = max(x1, x + left - _SLACK), min(x2, x + right + _SLACK)
    box[2], box[3] = max(l1, math.exp(y + down - _SLACK)), min(l2, math.exp(y + up + _SLACK))
    return True
