"""Ranges of side force, contact pressure and friction power over a box of designs, to second order in its size.

Per unit stroke the side force is k = (EI C + P)/L, C = V''(0) per unit stroke, because C + L D + q = 0 for the two
constants of the beam; the moment that tilts the piston is (L + e) k - P. With EI = E/(12 tau),

    dk/dX = EI (dC/dX - C)/L,    dk/dY = EI (dC/dY)/L,    X = ln tau, Y = ln l,

and the ranges of C's derivatives over the box are those of ``solvers.rod.optimum.proof.intervals``. A magnitude has a
kink where its argument changes sign: there its derivative ranges over both signs, and the mean value theorem still
holds.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.numerics.jit import kernel
from solvers.rod.optimum.proof.box_bounds import Array, Relaxation, Work
from solvers.rod.optimum.proof.intervals import product
from solvers.rod.rows import POWER, PRESSURE, SIDE


@kernel
def magnitude(low: float, high: float, slope: Array) -> tuple[float, float]:
    """The range of |v| for v in [low, high]; ``slope``, the ranges of v's two derivatives, becomes those of |v|."""
    if low >= 0.0:
        return low, high
    for k in range(2):
        d1, d2 = slope[2 * k], slope[2 * k + 1]
        if high <= 0.0:
            slope[2 * k], slope[2 * k + 1] = -d2, -d1
        else:
            slope[2 * k], slope[2 * k + 1] = min(d1, -d2), max(d2, -d1)
    return (-high, -low) if high <= 0.0 else (0.0, max(-low, high))


@kernel
def force_and_couple(p: Relaxation, work: Work, i: int, tau1: float, tau2: float, force: Array, couple: Array) -> None:
    """|T| and 6 |M0 + T e|/Lp [N] at one angle: value at the centre, range, ranges of derivatives by X and Y."""
    s, arm, per_length = abs(p.react_stroke[i]), p.rod_length + p.guide[0], 6.0 / p.guide[2]
    ei1, ei2 = p.modulus / (12.0 * tau2), p.modulus / (12.0 * tau1)
    slope = work.clamp.slope[i, 0]
    force[3], force[4] = product(ei1, ei2, slope[0] - work.clamp.high[i, 0], slope[1] - work.clamp.low[i, 0])
    force[5], force[6] = product(ei1, ei2, slope[2], slope[3])
    for k in range(3, 7):
        force[k] /= p.rod_length
    for k in range(2):
        couple[3 + 2 * k], couple[4 + 2 * k] = product(arm, arm, force[3 + 2 * k], force[4 + 2 * k])
    k1, middle, k2 = work.stiffness[i, 0], work.stiffness[i, 1], work.stiffness[i, 2]
    a1, a2 = product(arm, arm, k1, k2)
    force[0], couple[0] = abs(middle), abs(arm * middle - p.react_force[i])
    force[1], force[2] = magnitude(k1, k2, force[3:])
    couple[1], couple[2] = magnitude(a1 - p.react_force[i], a2 - p.react_force[i], couple[3:])
    for k in range(7):
        force[k] *= s
        couple[k] *= s * per_length


@kernel
def add_wall(force: Array, couple: Array, speed: float, total: Array) -> None:
    """Add speed times the wall force, (c + T^2/c)/2, or T where T exceeds c, to ``total``; layout as above."""
    T, c = force[0], couple[0]
    total[0] += speed * (0.5 * (c + T * T / c) if c > T else T)
    # By T: min(1, T/c); by c: (1 - min(1, T/c)^2)/2.
    by1 = 1.0 if force[1] >= couple[2] else force[1] / couple[2]
    by2 = 1.0 if force[2] >= couple[1] else force[2] / couple[1]
    low = 0.5 * (couple[1] + force[1] * force[1] / couple[1]) if couple[1] > force[1] else force[1]
    high = 0.5 * (couple[2] + force[2] * force[2] / couple[2]) if couple[2] > force[2] else force[2]
    total[1] += speed * low
    total[2] += speed * high
    for k in range(2):
        d1, d2 = product(by1, by2, force[3 + 2 * k], force[4 + 2 * k])
        e1, e2 = product(0.5 * (1.0 - by2 * by2), 0.5 * (1.0 - by1 * by1), couple[3 + 2 * k], couple[4 + 2 * k])
        total[3 + 2 * k] += speed * (d1 + e1)
        total[4 + 2 * k] += speed * (d2 + e2)


@kernel
def reaction_row(p: Relaxation, work: Work, which: int, tau1: float, tau2: float, out: Array) -> bool:
    """ln of the maximum side force or contact pressure, or of power: value at the centre, ranges of derivatives.

    A maximum is represented by its angle at the box's centre: a lower bound. False if no range is known.
    """
    force, couple, total = np.empty(7), np.empty(7), np.zeros(7)
    if which == POWER:
        for i in range(p.react_force.size):
            if p.react_speed[i] == 0.0 or p.react_stroke[i] == 0.0:
                continue
            if not work.clamp.bounded[i]:
                return False
            force_and_couple(p, work, i, tau1, tau2, force, couple)
            add_wall(force, couple, p.react_speed[i], total)
    else:
        worst, at = 0.0, -1
        arm, per_length = p.rod_length + p.guide[0], 6.0 / p.guide[2]
        for i in range(p.react_force.size):
            k, s = work.stiffness[i, 1], abs(p.react_stroke[i])
            value = s * abs(k) if which == SIDE else s * (abs(k) + per_length * abs(arm * k - p.react_force[i]))
            if value > worst and work.clamp.bounded[i]:
                worst, at = value, i
        if at < 0:
            return False
        force_and_couple(p, work, at, tau1, tau2, force, couple)
        for k in range(7):
            total[k] = force[k] if which == SIDE else force[k] + couple[k]
    if not (total[1] > 0.0 and total[2] < 1e150):
        return False
    scale = 1.0
    if which == PRESSURE:
        scale = 4.0 / (math.pi * p.guide[1] * p.guide[2])
    elif which == POWER:
        scale = p.guide[3] * 4.0 / math.pi
    if scale <= 0.0:
        return False
    out[0] = math.log(total[0] * scale)
    for k in range(2):
        out[1 + 2 * k], out[2 + 2 * k] = product(1.0 / total[2], 1.0 / total[1], total[3 + 2 * k], total[4 + 2 * k])
    return True
