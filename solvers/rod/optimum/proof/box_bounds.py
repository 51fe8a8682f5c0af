"""Lower bounds of an objective over a box of strips: the kernels of the branch and bound.

A relaxation includes only selected crank angles and sections. Omitting angles can only lower the maximum and raise the
minimum stress, hence lower a utilisation, a side force or a contact pressure: infeasibility of the relaxation implies
that of the problem. (Friction power is a mean, not a maximum; see
``solvers.rod.optimum.proof.outer_approximation``.)

Over a box of ln tau and ln l the stress of a strip is h^2 tau P +- h (E/2) V'' s, with V'' in the ranges of
``solvers.rod.optimum.proof.intervals``. The utilisation increases with h at every section (it is convex in the stress
cycle, both fibres count, and the bending stress passes through zero), so the thickness at which its lower bound reaches
the limit is an upper bound of the thickness of all strips in the box.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solvers.fatigue.kernels import utilisation_of
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.rod.optimum.proof.intervals import bending_over
from solvers.rod.optimum.rows_at_samples import finite_log
from solvers.rod.rows import (
    FIRST_PART,
    NEVER_COMPRESSED,
    POWER,
    PRESSURE,
    SIDE,
    STABILITY,
    STRESS,
    THICKNESS,
    UTILISATION,
)
from solvers.rod.strip.buckling import log_critical_parameter

_STEPS = 14
"""Iterations for the maximum thickness."""
_SLACK = 1e-12
CLAMP = np.ones(1)
"""eta of the only section relevant to reactions."""


class Relaxation(NamedTuple):
    """A problem at selected angles and sections, as arrays for the kernels. SI units.

    force, lateral, speed  axial force [N], lateral displacement [m] and |piston speed|/angles [m/s] at the selected
                           angles; speed is 0 at angles that do not contribute to the mean of friction power
    stress_angles          number of leading angles at which stresses are evaluated; at the others, only reactions
    eta                    distance of sections from the head over l; the first is the clamp, eta = 1
    lines, parabola        fatigue criterion: (corners, lines, 3) and (3,) as in ``solvers.fatigue.kernels.Diagram``
    limits                 maximum of ln of each result, by the indices of ``rows``; inf: no limit
    objective              the row to be minimised, or THICKNESS for the mass
    compression            maximum over the cycle [N]
    guide                  clamp offset, diameter, skirt length [m], friction coefficient
    """

    force: Array
    lateral: Array
    speed: Array
    stress_angles: int
    eta: Array
    lines: Array
    parabola: Array
    limits: Array
    objective: int
    compression: float
    guide: Array
    modulus: float
    rod_length: float


@kernel
def workspace(p: Relaxation) -> Array:
    """Workspace for the bounds of V'' by ``bending_over``, shape (angles, 6, sections)."""
    return np.empty((p.force.size, 6, p.eta.size))


@kernel
def fill_curvatures(p: Relaxation, box: Array, curvatures: Array) -> None:
    """Bound V'' over a box (ln tau, ln tau, l, l) at every angle; at angles for reactions, at the clamp only."""
    tau, l = np.empty(3), np.empty(3)
    tau[0], tau[1], tau[2] = math.exp(box[0]), math.exp(0.5 * (box[0] + box[1])), math.exp(box[1])
    l[0], l[1], l[2] = box[2], math.sqrt(box[2] * box[3]), box[3]
    for i in range(p.force.size):
        eta = p.eta if i < p.stress_angles else CLAMP
        bending_over(p.force[i], p.modulus, p.rod_length, tau, l, eta, curvatures[i])


@kernel
def utilisation_and_stress(
    p: Relaxation, curvatures: Array, low: int, high: int, tau1: float, tau2: float, h: float
) -> tuple[float, float]:
    """Lower bounds of utilisation and stress [Pa] at thickness h; V'' lies between rows ``low`` and ``high``."""
    worst, greatest, half = 0.0, 0.0, 0.5 * p.modulus * h
    for j in range(p.eta.size):
        up_high, up_low, down_high, down_low = -np.inf, np.inf, -np.inf, np.inf
        for i in range(p.stress_angles):
            force = p.force[i] * h * h
            d1 = force * tau1 if force > 0.0 else force * tau2
            d2 = force * tau2 if force > 0.0 else force * tau1
            scale = half * p.lateral[i]
            w1 = scale * curvatures[i, low, j] if scale > 0.0 else scale * curvatures[i, high, j]
            w2 = scale * curvatures[i, high, j] if scale > 0.0 else scale * curvatures[i, low, j]
            up_high, up_low = max(up_high, d1 + w1), min(up_low, d2 + w2)
            down_high, down_low = max(down_high, d1 - w2), min(down_low, d2 - w1)
        if up_high > up_low:
            worst = max(worst, utilisation_of(up_high, up_low, p.lines, p.parabola))
        if down_high > down_low:
            worst = max(worst, utilisation_of(down_high, down_low, p.lines, p.parabola))
        greatest = max(greatest, max(max(up_high, -up_low), max(down_high, -down_low)))
    return worst, greatest


@kernel
def severity(p: Relaxation, curvatures: Array, low: int, high: int, tau1: float, tau2: float, h: float) -> float:
    """ln of the larger of utilisation and stress, relative to their limits."""
    utilisation, stress = utilisation_and_stress(p, curvatures, low, high, tau1, tau2, h)
    return max(finite_log(utilisation) - p.limits[UTILISATION], finite_log(stress) - p.limits[STRESS])


@kernel
def max_thickness_by_strength(
    p: Relaxation, curvatures: Array, low: int, high: int, tau1: float, tau2: float, h1: float, h2: float
) -> float:
    """Upper bound, at most h2, of the thickness at which the severity reaches its limit; it is below it at h1."""
    a, b = math.log(h1), math.log(h2)
    fb = severity(p, curvatures, low, high, tau1, tau2, h2)
    if fb <= _SLACK or not a < b:
        return h2
    fa = min(severity(p, curvatures, low, high, tau1, tau2, h1), 0.0)
    for _ in range(_STEPS):
        share = fa / (fa - fb)
        # Aim slightly beyond the root, so that the upper end moves; keep away from the ends of the bracket.
        guess = a + min(max(share + 0.02 * (1.0 - share) * share, 0.002), 0.998) * (b - a)
        value = severity(p, curvatures, low, high, tau1, tau2, math.exp(guess))
        if value > 0.0:
            b, fb = guess, value
        else:
            a, fa = guess, value
        if b - a < 1e-9 or fb < 1e-7:
            break
    return math.exp(b)


@kernel
def min_magnitude(a: float, b: float) -> float:
    """Minimum of |x| for x in [a, b]."""
    return a if a > 0.0 else (-b if b < 0.0 else 0.0)


@kernel
def reactions(
    p: Relaxation, curvatures: Array, low: int, high: int, tau1: float, tau2: float
) -> tuple[float, float, float]:
    """Lower bounds of maximum side force [N] and contact pressure [Pa] and of friction power [W]."""
    side, pressure, power = 0.0, 0.0, 0.0
    offset, diameter, skirt, friction = p.guide
    ei1, ei2, arm = p.modulus / (12.0 * tau2), p.modulus / (12.0 * tau1), p.rod_length + offset
    for i in range(p.force.size):
        s, force, c1, c2 = abs(p.lateral[i]), p.force[i], curvatures[i, low, 0], curvatures[i, high, 0]
        k1 = ((ei1 if c1 > 0.0 else ei2) * c1 + force) / p.rod_length
        k2 = ((ei2 if c2 > 0.0 else ei1) * c2 + force) / p.rod_length
        m1, m2 = (arm * k1, arm * k2) if arm > 0.0 else (arm * k2, arm * k1)
        T = s * min_magnitude(k1, k2)
        couple = 6.0 / skirt * s * min_magnitude(m1 - force, m2 - force)
        side, pressure = max(side, T), max(pressure, T + couple)
        power += (0.5 * (couple + T * T / couple) if couple > T else T) * p.speed[i]
    return side, pressure * 4.0 / (math.pi * diameter * skirt), power * friction * 4.0 / math.pi


@kernel
def stability(p: Relaxation, x: float, l: float) -> float:
    """ln(compression/critical force) in the crank's plane."""
    if p.compression <= 0.0:
        return NEVER_COMPRESSED
    ln_u, _ = log_critical_parameter(l, p.rod_length)
    return x + math.log(12.0 * p.rod_length * p.rod_length * p.compression / p.modulus) - 2.0 * ln_u


@kernel
def min_thickness(slice_: Array, x2: float) -> float:
    """Minimum thickness [m] for any tau up to ln tau = x2; ``slice_`` = b, b, h, h bounds."""
    return max(slice_[2], math.exp(-(x2 + math.log(slice_[1])) / 3.0))


@kernel
def max_thickness_by_bounds(p: Relaxation, slice_: Array, x1: float, l1: float) -> float:
    """Maximum thickness [m] by bounds and out-of-plane stability for any tau and l above ln tau = x1 and l1."""
    return min(min(slice_[3], math.exp(-(x1 + math.log(slice_[0])) / 3.0)), out_of_plane_thickness(p, x1, l1))


@kernel
def out_of_plane_thickness(p: Relaxation, x: float, l: float) -> float:
    """Thickness [m] at which out-of-plane stability reaches its limit: that in the plane with 1/tau replaced by
    h b^3 = 1/(tau^3 h^8)."""
    return math.exp(0.125 * (p.limits[STABILITY] - stability(p, x, l) - 2.0 * x))


@kernel
def box_bound(p: Relaxation, slice_: Array, box: Array, curvatures: Array, low: int, high: int) -> tuple[float, float]:
    """Lower bound of ln objective over the box, inf if it is infeasible, and the thickness [m] of that bound.

    V'' lies between rows ``low`` and ``high`` of ``curvatures``. With VALUE for both and a box that is a point, the
    bound is attained: by the best strip with that tau and l.
    """
    x1, x2, l1, _ = box
    h1, h2 = min_thickness(slice_, x2), max_thickness_by_bounds(p, slice_, x1, l1)
    if h1 > h2 * (1.0 + _SLACK):
        return np.inf, np.nan
    tau1, tau2, results = math.exp(x1), math.exp(x2), np.full(FIRST_PART, -np.inf)
    results[STABILITY] = stability(p, x1, l1)
    utilisation, stress = utilisation_and_stress(p, curvatures, low, high, tau1, tau2, h1)
    results[UTILISATION], results[STRESS] = finite_log(utilisation), finite_log(stress)
    side, pressure, power = reactions(p, curvatures, low, high, tau1, tau2)
    results[SIDE], results[PRESSURE], results[POWER] = finite_log(side), finite_log(pressure), finite_log(power)
    for row in range(FIRST_PART):
        if results[row] > p.limits[row] + _SLACK:
            return np.inf, np.nan
    if p.objective != THICKNESS:
        return results[p.objective], h1
    h = max_thickness_by_strength(p, curvatures, low, high, tau1, tau2, h1, max(h1, h2))
    return math.log(l1) - x2 - 2.0 * math.log(h), h
