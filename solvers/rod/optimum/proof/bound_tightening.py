"""Bound tightening: contraction of a box of designs to the part that may contain an improvement of the incumbent.

Over a box of X = ln tau and Y = ln l every requirement is phi(X, Y) <= 0, phi a sum of bending terms and exponentials:

- Fatigue, stress: h^2 tau (p P1 + m P2) + h (E/2) (p s1 V1'' + m s2 V2'') - limit at the stresses' extremes, 1 and 2.
- Side force, contact pressure, friction power: a sum of w_i k_i - v_i P_i, with 12 tau/E L k = C + 12 tau/E P.

Utilisation, contact pressure and friction (the integral of |load per length| over the skirt) are convex and
homogeneous in stresses and forces. Their tangent plane at the box's centre is therefore a lower bound; its coefficients
are p, m, w, v. Utilisation and stress increase with h, so they are evaluated on lower limits of ln h that are linear in
X and Y: the bounds of h and b and, if mass is minimised, the thickness that a strip must exceed to be lighter than the
target. For any other objective the target is a limit of its row.

V'' has a linear approximation with an error of second order (``solvers.rod.optimum.proof.intervals``). An exponential
lies above its tangent; the difference, also of second order, counts where its factor is negative. Hence
phi >= c + g_x dX + g_y dY - error, and phi <= 0 restricts the box to a half-plane. The intersection of all half-planes
with the box is a convex polygon. If it is empty the box is discarded; otherwise it is contracted to the polygon's
bounding rectangle. Near an optimum, whether or not at a vertex of the feasible set, boxes shrink faster than by
bisection; a proof to 1e-6 therefore takes only a few hundred boxes.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.rod.optimum.proof.box_bounds import Relaxation, out_of_plane_thickness, stability
from solvers.rod.optimum.proof.intervals import BY_X, BY_Y, ERROR, VALUE
from solvers.rod.rows import POWER, PRESSURE, SIDE, STABILITY, STRESS, THICKNESS, UTILISATION
from solvers.rod.strip.buckling import log_critical_parameter

_SLACK = 1e-12
_MAX_CORNERS = 64


@kernel
def governing_line(p: Relaxation, high: float, low: float) -> tuple[float, float]:
    """Coefficients p, m of the line p high + m low of the fatigue criterion that governs a stress cycle; 0 if none.

    A corner of several lines is their minimum, for which no single line is a lower bound, so it is ignored. For a
    parabola, which is convex, it is the tangent.
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
def clip(polygon: Array, count: int, plane: Array, workspace: Array) -> int:
    """Intersect a convex polygon with the half-plane value + g_x x + g_y y <= error, in place.

    Returns the number of vertices.
    """
    # Every half-plane adds at most one vertex; omitting one leaves a valid superset.
    if count > _MAX_CORNERS - 2:
        return count
    kept, c = 0, plane[VALUE] - plane[ERROR] - _SLACK
    for n in range(count):
        m = n + 1 if n + 1 < count else 0
        here = c + plane[BY_X] * polygon[n, 0] + plane[BY_Y] * polygon[n, 1]
        there = c + plane[BY_X] * polygon[m, 0] + plane[BY_Y] * polygon[m, 1]
        if here <= 0.0:
            workspace[kept, 0], workspace[kept, 1] = polygon[n, 0], polygon[n, 1]
            kept += 1
        if (here <= 0.0) != (there <= 0.0):
            share = here / (here - there)
            workspace[kept, 0] = polygon[n, 0] + share * (polygon[m, 0] - polygon[n, 0])
            workspace[kept, 1] = polygon[n, 1] + share * (polygon[m, 1] - polygon[n, 1])
            kept += 1
    for n in range(kept):
        polygon[n, 0], polygon[n, 1] = workspace[n, 0], workspace[n, 1]
    return kept


@kernel
def add_exponential(plane: Array, factor: float, a: float, b: float, rx: float, ry: float) -> None:
    """Add the tangent of factor*exp(a dX + b dY) to a plane that is a lower bound, and its error where it is not."""
    plane[VALUE] += factor
    plane[BY_X] += factor * a
    plane[BY_Y] += factor * b
    if factor < 0.0:
        exponent = abs(a) * rx + abs(b) * ry
        plane[ERROR] -= factor * (math.expm1(min(exponent, 100.0)) - exponent)


@kernel
def add_bending(plane: Array, factor: float, curvatures: Array, j: int) -> None:
    """Add a multiple of V'' at a station to a plane."""
    for k in (VALUE, BY_X, BY_Y):
        plane[k] += factor * curvatures[k, j]
    plane[ERROR] += abs(factor) * curvatures[ERROR, j]


@kernel
def set_plane(plane: Array, value: float, by_x: float, by_y: float, error: float) -> None:
    plane[VALUE], plane[BY_X], plane[BY_Y], plane[ERROR] = value, by_x, by_y, error


@kernel
def stress_plane(
    p: Relaxation, curvatures: Array, row: int, limit: float, fibre: float, j: int, tau: float, floor: Array, rx: float,
    ry: float, plane: Array,
) -> None:  # fmt: skip
    """Plane of (utilisation or stress)/``limit`` - 1 at a fibre and section, with ln h at its lower limit ``floor``."""
    h = math.exp(floor[VALUE])
    direct, bending = h * h * tau, 0.5 * fibre * p.modulus * h
    top, bottom, high, low = 0, 0, -np.inf, np.inf
    for i in range(p.stress_angles):
        stress = direct * p.force[i] + bending * p.lateral[i] * curvatures[i, VALUE, j]
        if stress > high:
            high, top = stress, i
        if stress < low:
            low, bottom = stress, i
    if row == STRESS:
        weight_high, weight_low = (1.0, 0.0) if high > -low else (0.0, -1.0)
    else:
        weight_high, weight_low = governing_line(p, high, low)
    plane[:] = 0.0
    add_bending(plane, weight_high * bending * p.lateral[top] / limit, curvatures[top], j)
    add_bending(plane, weight_low * bending * p.lateral[bottom] / limit, curvatures[bottom], j)
    # The sum over h, times h at the centre: no products of V'' remain.
    force = weight_high * p.force[top] + weight_low * p.force[bottom]
    add_exponential(plane, direct * force / limit, 1.0 + floor[BY_X], floor[BY_Y], rx, ry)
    add_exponential(plane, -1.0, -floor[BY_X], -floor[BY_Y], rx, ry)


@kernel
def reaction_plane(
    p: Relaxation, curvatures: Array, row: int, limit: float, tau: float, rx: float, ry: float, plane: Array
) -> None:
    """Plane of (side force, contact pressure or friction power)/``limit`` - 1, times tau/tau of the centre."""
    offset, diameter, skirt, friction = p.guide
    arm, couple, stiffness = p.rod_length + offset, 6.0 / skirt, p.modulus / (12.0 * tau)
    scale = 1.0
    if row == PRESSURE:
        scale = 4.0 / (math.pi * diameter * skirt)
    elif row == POWER:
        scale = 4.0 / math.pi * friction
    worst, force_factor = 0.0, 0.0
    plane[:] = 0.0
    for i in range(p.force.size):
        if row == POWER and p.speed[i] == 0.0:
            continue
        s, force = abs(p.lateral[i]) * scale / limit, p.force[i]
        k = (stiffness * curvatures[i, VALUE, 0] + force) / p.rod_length
        T, c = abs(k), couple * abs(arm * k - force)
        dT, dc = 1.0, 1.0 if row == PRESSURE else 0.0
        if row == POWER:
            # Friction at one wall, or the integral over both.
            s *= p.speed[i]
            if c > T:
                dT, dc = T / c, 0.5 - 0.5 * (T / c) ** 2
        elif s * (dT * T + dc * c) <= worst:
            continue
        else:
            # The maximum is bounded from below by its value at the angle that governs at the centre.
            worst = s * (dT * T + dc * c)
            plane[:], force_factor = 0.0, 0.0
        dc *= math.copysign(couple, arm * k - force)
        dk = math.copysign(dT, k) + dc * arm
        add_bending(plane, s * dk * stiffness / p.rod_length, curvatures[i], 0)
        force_factor += s * (dk / p.rod_length - dc) * force
    add_exponential(plane, force_factor - 1.0, 1.0, 0.0, rx, ry)


@kernel
def contract(p: Relaxation, slice_: Array, box: Array, curvatures: Array, target: float) -> bool:
    """Contract a box to the part where the objective may be below ``target``; False if that is empty.

    ``curvatures`` are the bounds of V'' over the box.
    """
    x1, x2, l1, l2 = box
    y1, y2 = math.log(l1), math.log(l2)
    x, y, rx, ry = 0.5 * (x1 + x2), 0.5 * (y1 + y2), 0.5 * (x2 - x1), 0.5 * (y2 - y1)
    tau, l = math.exp(x), math.exp(y)
    polygon, workspace, plane = np.empty((_MAX_CORNERS, 2)), np.empty((_MAX_CORNERS, 2)), np.empty(4)
    polygon[0, 0], polygon[1, 0], polygon[2, 0], polygon[3, 0] = -rx, rx, rx, -rx
    polygon[0, 1], polygon[1, 1], polygon[2, 1], polygon[3, 1] = -ry, -ry, ry, ry
    corners, limits = 4, p.limits.copy()
    limits[p.objective] = min(limits[p.objective], target)
    _, s1 = log_critical_parameter(l1, p.rod_length)
    _, s2 = log_critical_parameter(l2, p.rod_length)
    slope, error = 0.5 * (s1 + s2), 0.5 * abs(s1 - s2) * ry
    set_plane(plane, stability(p, x, l) - limits[STABILITY], 1.0, -2.0 * slope, 2.0 * error)
    corners = clip(polygon, corners, plane, workspace)
    for row in (SIDE, PRESSURE, POWER):
        if limits[row] < np.inf:
            reaction_plane(p, curvatures, row, math.exp(limits[row]), tau, rx, ry, plane)
            corners = clip(polygon, corners, plane, workspace)
    floors, ceilings = np.empty((3, 4)), np.empty((3, 4))
    set_plane(floors[0], math.log(slice_[2]), 0.0, 0.0, 0.0)
    set_plane(floors[1], -(x + math.log(slice_[1])) / 3.0, -1.0 / 3.0, 0.0, 0.0)
    # Mass/density is l/(tau h^2).
    set_plane(floors[2], 0.5 * (y - x - target), -0.5, 0.5, 0.0)
    set_plane(ceilings[0], math.log(slice_[3]), 0.0, 0.0, 0.0)
    set_plane(ceilings[1], -(x + math.log(slice_[0])) / 3.0, -1.0 / 3.0, 0.0, 0.0)
    set_plane(ceilings[2], math.log(out_of_plane_thickness(p, x, l)), -0.375, 0.25 * slope, 0.25 * error)
    for n in range(3 if p.objective == THICKNESS and target < np.inf else 2):
        floor = floors[n]
        for m in range(3):
            for k in (VALUE, BY_X, BY_Y):
                plane[k] = floor[k] - ceilings[m, k]
            plane[ERROR] = ceilings[m, ERROR]
            corners = clip(polygon, corners, plane, workspace)
        for row in (UTILISATION, STRESS):
            if limits[row] < np.inf:
                limit = math.exp(limits[row])
                for j in range(p.eta.size):
                    for fibre in (1.0, -1.0):
                        stress_plane(p, curvatures, row, limit, fibre, j, tau, floor, rx, ry, plane)
                        corners = clip(polygon, corners, plane, workspace)
    if corners == 0:
        return False
    left, right, down, up = np.inf, -np.inf, np.inf, -np.inf
    for n in range(corners):
        left, right = min(left, polygon[n, 0]), max(right, polygon[n, 0])
        down, up = min(down, polygon[n, 1]), max(up, polygon[n, 1])
    box[0], box[1] = max(x1, x + left - _SLACK), min(x2, x + right + _SLACK)
    box[2], box[3] = max(l1, math.exp(y + down - _SLACK)), min(l2, math.exp(y + up + _SLACK))
    return True
