"""Bound tightening: contraction of a box of designs to the part that may contain an improvement of the incumbent.

Over a box of X = ln tau and Y = ln l every requirement is a sum phi(X, Y) <= 0 of bending terms and exponentials:

- Fatigue, stress: h^2 tau (p P1 + m P2) + h (E/2) (p s1 V1'' + m s2 V2'') - limit at the stresses' extremes, 1 and 2.
- Side force, contact pressure, friction power: a sum of w_i k_i - v_i P_i, as 12 tau/E L k = C + 12 tau/E P.

Utilisation, contact pressure and friction (the integral of |load per length| over the skirt) are convex and
homogeneous in stresses and forces, so that the plane that touches them at the box's centre bounds them from below: it
supplies p, m, w, v. Utilisation and stress increase with h, so that they are looked at on lower limits of ln h, which
are linear in X and Y: bounds of h and b, and for the least mass, the thickness that a strip must exceed to be lighter
than the target. For any other objective the target is a limit of its row.

V'' has a plane with an error of second order (``solvers.rod.optimum.proof.intervals``); an exponential lies above its
tangent, by a second order that counts where its factor is negative. So phi >= c + g_x dX + g_y dY - error, and
phi <= 0 leaves a half-plane. The intersection of all half-planes with the box is a convex polygon. If it is empty the
box is discarded; otherwise it shrinks to the polygon's bounding rectangle. Near an optimum, at a vertex of the feasible
set or not, boxes shrink faster than by bisection, which is why a proof to 1e-6 takes only a few hundred boxes.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.numerics.jit import kernel
from solvers.rod.optimum.proof.box_bounds import Array, Relaxation, sideways_thickness, stability
from solvers.rod.optimum.proof.intervals import BY_X, BY_Y, ERROR, VALUE
from solvers.rod.rows import POWER, PRESSURE, SIDE, STABILITY, STRESS, THICKNESS, UTILISATION
from solvers.rod.strip.buckling import log_critical_parameter

_SLACK = 1e-12
_MAX_CORNERS = 64


@kernel
def ruling_line(p: Relaxation, high: float, low: float) -> tuple[float, float]:
    """The line p high + m low of the fatigue criterion that governs a stress cycle; 0 if none.

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
    return 0.5 * (alpha + beta), 0.5 * (beta - alpha)


@kernel
def cut(polygon: Array, count: int, plane: Array, room: Array) -> int:
    """Intersect a convex polygon with the half-plane value + g_x x + g_y y <= error, in place.

    Returns the number of vertices.
    """
    # Every cut adds at most one vertex; skipping a cut leaves a valid superset.
    if count > _MAX_CORNERS - 2:
        return count
    kept, c = 0, plane[VALUE] - plane[ERROR] - _SLACK
    for n in range(count):
        m = n + 1 if n + 1 < count else 0
        here = c + plane[BY_X] * polygon[n, 0] + plane[BY_Y] * polygon[n, 1]
        there = c + plane[BY_X] * polygon[m, 0] + plane[BY_Y] * polygon[m, 1]
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
def add_exponential(plane: Array, factor: float, a: float, b: float, rx: float, ry: float) -> None:
    """Add the tangent of factor exp(a dX + b dY) to a plane that bounds from below, and how far below it may be."""
    plane[VALUE] += factor
    plane[BY_X] += factor * a
    plane[BY_Y] += factor * b
    if factor < 0.0:
        most = abs(a) * rx + abs(b) * ry
        plane[ERROR] -= factor * (math.expm1(min(most, 100.0)) - most)


@kernel
def add_bending(plane: Array, factor: float, bent: Array, j: int) -> None:
    """Add a multiple of V'' at a station to a plane."""
    for k in (VALUE, BY_X, BY_Y):
        plane[k] += factor * bent[k, j]
    plane[ERROR] += abs(factor) * bent[ERROR, j]


@kernel
def set_plane(plane: Array, value: float, by_x: float, by_y: float, error: float) -> None:
    plane[VALUE], plane[BY_X], plane[BY_Y], plane[ERROR] = value, by_x, by_y, error


@kernel
def stress_plane(
    p: Relaxation, bent: Array, row: int, limit: float, fibre: float, j: int, tau: float, floor: Array, rx: float,
    ry: float, plane: Array,
) -> None:  # fmt: skip
    """Utilisation or stress at a fibre and section, over its ``limit``, less 1, where ln h is on a ``floor``."""
    h = math.exp(floor[VALUE])
    direct, bending = h * h * tau, 0.5 * fibre * p.modulus * h
    top, bottom, high, low = 0, 0, -np.inf, np.inf
    for i in range(p.stressed):
        stress = direct * p.force[i] + bending * p.stroke[i] * bent[i, VALUE, j]
        if stress > high:
            high, top = stress, i
        if stress < low:
            low, bottom = stress, i
    if row == STRESS:
        pull, push = (1.0, 0.0) if high > -low else (0.0, -1.0)
    else:
        pull, push = ruling_line(p, high, low)
    plane[:] = 0.0
    add_bending(plane, pull * bending * p.stroke[top] / limit, bent[top], j)
    add_bending(plane, push * bending * p.stroke[bottom] / limit, bent[bottom], j)
    # The sum over h, times h at the centre: no products of V'' remain.
    force = pull * p.force[top] + push * p.force[bottom]
    add_exponential(plane, direct * force / limit, 1.0 + floor[BY_X], floor[BY_Y], rx, ry)
    add_exponential(plane, -1.0, -floor[BY_X], -floor[BY_Y], rx, ry)


@kernel
def reaction_plane(
    p: Relaxation, bent: Array, row: int, limit: float, tau: float, rx: float, ry: float, plane: Array
) -> None:
    """Side force, contact pressure or friction power, over its ``limit``, less 1, times tau over that of the centre."""
    offset, diameter, skirt, friction = p.guide
    arm, couple, stiffness = p.rod_length + offset, 6.0 / skirt, p.modulus / (12.0 * tau)
    scale = 1.0
    if row == PRESSURE:
        scale = 4.0 / (math.pi * diameter * skirt)
    elif row == POWER:
        scale = 4.0 / math.pi * friction
    worst, ends = 0.0, 0.0
    plane[:] = 0.0
    for i in range(p.force.size):
        if row == POWER and p.speed[i] == 0.0:
            continue
        s, force = abs(p.stroke[i]) * scale / limit, p.force[i]
        k = (stiffness * bent[i, VALUE, 0] + force) / p.rod_length
        T, c = abs(k), couple * abs(arm * k - force)
        by_T, by_c = 1.0, 1.0 if row == PRESSURE else 0.0
        if row == POWER:
            # The friction of one wall, or the integral over both.
            s *= p.speed[i]
            if c > T:
                by_T, by_c = T / c, 0.5 - 0.5 * (T / c) ** 2
        elif s * (by_T * T + by_c * c) <= worst:
            continue
        else:
            # A maximum is represented by its angle at the centre.
            worst = s * (by_T * T + by_c * c)
            plane[:], ends = 0.0, 0.0
        by_c *= math.copysign(couple, arm * k - force)
        by_k = math.copysign(by_T, k) + by_c * arm
        add_bending(plane, s * by_k * stiffness / p.rod_length, bent[i], 0)
        ends += s * (by_k / p.rod_length - by_c) * force
    add_exponential(plane, ends - 1.0, 1.0, 0.0, rx, ry)


@kernel
def contract(p: Relaxation, slice_: Array, box: Array, bent: Array, target: float) -> bool:
    """Shrink the box that ``bent`` is of to the part that may have an objective below ``target``; False if empty."""
    x1, x2, l1, l2 = box
    y1, y2 = math.log(l1), math.log(l2)
    x, y, rx, ry = 0.5 * (x1 + x2), 0.5 * (y1 + y2), 0.5 * (x2 - x1), 0.5 * (y2 - y1)
    tau, l = math.exp(x), math.exp(y)
    polygon, room, plane = np.empty((_MAX_CORNERS, 2)), np.empty((_MAX_CORNERS, 2)), np.empty(4)
    polygon[0, 0], polygon[1, 0], polygon[2, 0], polygon[3, 0] = -rx, rx, rx, -rx
    polygon[0, 1], polygon[1, 1], polygon[2, 1], polygon[3, 1] = -ry, -ry, ry, ry
    corners, limits = 4, p.limits.copy()
    limits[p.objective] = min(limits[p.objective], target)
    _, s1 = log_critical_parameter(l1, p.rod_length)
    _, s2 = log_critical_parameter(l2, p.rod_length)
    slope, error = 0.5 * (s1 + s2), 0.5 * abs(s1 - s2) * ry
    set_plane(plane, stability(p, x, l) - limits[STABILITY], 1.0, -2.0 * slope, 2.0 * error)
    corners = cut(polygon, corners, plane, room)
    for row in (SIDE, PRESSURE, POWER):
        if limits[row] < np.inf:
            reaction_plane(p, bent, row, math.exp(limits[row]), tau, rx, ry, plane)
            corners = cut(polygon, corners, plane, room)
    floors, ceilings = np.empty((3, 4)), np.empty((3, 4))
    set_plane(floors[0], math.log(slice_[2]), 0.0, 0.0, 0.0)
    set_plane(floors[1], -(x + math.log(slice_[1])) / 3.0, -1.0 / 3.0, 0.0, 0.0)
    # A strip of mass l/(tau h^2).
    set_plane(floors[2], 0.5 * (y - x - target), -0.5, 0.5, 0.0)
    set_plane(ceilings[0], math.log(slice_[3]), 0.0, 0.0, 0.0)
    set_plane(ceilings[1], -(x + math.log(slice_[0])) / 3.0, -1.0 / 3.0, 0.0, 0.0)
    set_plane(ceilings[2], math.log(sideways_thickness(p, x, l)), -0.375, 0.25 * slope, 0.25 * error)
    for n in range(3 if p.objective == THICKNESS and target < np.inf else 2):
        floor = floors[n]
        for m in range(3):
            for k in (VALUE, BY_X, BY_Y):
                plane[k] = floor[k] - ceilings[m, k]
            plane[ERROR] = ceilings[m, ERROR]
            corners = cut(polygon, corners, plane, room)
        for row in (UTILISATION, STRESS):
            if limits[row] < np.inf:
                limit = math.exp(limits[row])
                for j in range(p.eta.size):
                    for fibre in (1.0, -1.0):
                        stress_plane(p, bent, row, limit, fibre, j, tau, floor, rx, ry, plane)
                        corners = cut(polygon, corners, plane, room)
    if corners == 0:
        return False
    left, right, down, up = np.inf, -np.inf, np.inf, -np.inf
    for n in range(corners):
        left, right = min(left, polygon[n, 0]), max(right, polygon[n, 0])
        down, up = min(down, polygon[n, 1]), max(up, polygon[n, 1])
    box[0], box[1] = max(x1, x + left - _SLACK), min(x2, x + right + _SLACK)
    box[2], box[3] = max(l1, math.exp(y + down - _SLACK)), min(l2, math.exp(y + up + _SLACK))
    return True
