"""Lower bounds of an objective over a box of strips: the kernels of the branch and bound.

A relaxation includes only some crank angles and sections. Omitting angles can only lower the maximum and raise the
minimum stress, hence lower a utilisation, a side force or a contact pressure: infeasibility of the relaxation implies
that of the problem. (Friction power is a mean, not a maximum; see
``solvers.rod.optimum.proof.outer_approximation``.)

Over a box of ln tau and ln l, every strip's stress is h^2 tau P +- h (E/2) V'' s, within the ranges of
``solvers.rod.optimum.proof.intervals``. The utilisation increases with h at every section (it is convex in the stress
cycle, both fibres count, and the bending stress passes through zero), so the thickness at which its lower bound reaches
the limit is an upper bound of the thickness of all strips in the box.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue.kernels import utilisation_of
from solvers.numerics.jit import kernel
from solvers.rod.optimum.proof.intervals import bending_ranges
from solvers.rod.rows import (
    COUNT,
    LENGTH,
    NEVER_COMPRESSED,
    POWER,
    PRESSURE,
    SIDE,
    STABILITY,
    TAU,
    THICKNESS,
    UTILISATION,
)
from solvers.rod.strip.buckling import log_critical_parameter

Array = NDArray[np.float64]

_BOX_STEPS, _POINT_STEPS = 3, 14
"""Iterations for the maximum thickness: for a box, whose bound only determines its priority, and for a strip."""
CLAMP = np.ones(1)
"""The only section relevant to reactions."""


class Relaxation(NamedTuple):
    """A problem at selected angles and sections, in kernel representation. SI units; inf: no limit.

    force, stroke          axial force [N] and lateral stroke [m] at the angles selected for stresses
    react_force, react_stroke, react_speed   the same at those selected for reactions, and |piston speed|/angles [m/s]
    eta                    sections by distance from the head over l; the first is the clamp, eta = 1
    lines, parabola        the fatigue criterion: (corners, lines, 3) and (3,) as in ``solvers.fatigue.kernels.Diagram``
    limits                 maximum utilisation, stress [Pa], contact pressure [Pa], friction power [W]
    compression            maximum compression times the minimum stability safety [N], sideways too
    guide                  clamp offset, diameter, skirt length [m], friction coefficient
    weights                the objective's weights, by the indices of ``rows``
    """

    force: Array
    stroke: Array
    react_force: Array
    react_stroke: Array
    react_speed: Array
    eta: Array
    lines: Array
    parabola: Array
    limits: Array
    compression: float
    guide: Array
    weights: Array
    modulus: float
    rod_length: float


class Ranges(NamedTuple):
    """V'' at angles and sections: centre values, ranges, ranges of derivatives, and whether these are bounded."""

    centre: Array
    low: Array
    high: Array
    slope: Array
    bounded: NDArray[np.bool_]


class Work(NamedTuple):
    """Work space for the ranges over one box: values (angles, sections) and derivatives (angles, sections, 4).

    ``clamp`` has those of the reaction angles, at the clamp only, and ``stiffness`` their k: minimum, centre, maximum.
    """

    bending: Ranges
    clamp: Ranges
    stiffness: Array


def workspace(relaxation: Relaxation) -> Work:
    reacting = relaxation.react_force.size
    return Work(
        _ranges(relaxation.force.size, relaxation.eta.size), _ranges(reacting, CLAMP.size), np.empty((reacting, 3))
    )


def _ranges(n: int, m: int) -> Ranges:
    return Ranges(np.empty((n, m)), np.empty((n, m)), np.empty((n, m)), np.empty((n, m, 4)), np.empty(n, np.bool_))


@kernel
def utilisation_and_stress(
    p: Relaxation, low: Array, high: Array, tau1: float, tau2: float, h: float
) -> tuple[float, float]:
    """Lower bounds of utilisation and, if it is limited, stress [Pa] at thickness h for ranges of V''."""
    worst, greatest, half = 0.0, 0.0, 0.5 * p.modulus * h
    for j in range(p.eta.size):
        up_high, up_low, down_high, down_low = -np.inf, np.inf, -np.inf, np.inf
        for i in range(p.force.size):
            force = p.force[i] * h * h
            d1 = force * tau1 if force > 0.0 else force * tau2
            d2 = force * tau2 if force > 0.0 else force * tau1
            scale = half * p.stroke[i]
            w1 = scale * low[i, j] if scale > 0.0 else scale * high[i, j]
            w2 = scale * high[i, j] if scale > 0.0 else scale * low[i, j]
            if scale == 0.0:
                w1 = w2 = 0.0
            up_high, up_low = max(up_high, d1 + w1), min(up_low, d2 + w2)
            down_high, down_low = max(down_high, d1 - w2), min(down_low, d2 - w1)
        if up_high > up_low:
            worst = max(worst, utilisation_of(up_high, up_low, p.lines, p.parabola))
        if down_high > down_low:
            worst = max(worst, utilisation_of(down_high, down_low, p.lines, p.parabola))
        if p.limits[1] < np.inf:
            greatest = max(greatest, max(max(up_high, -up_low), max(down_high, -down_low)))
    return worst, greatest


@kernel
def severity(p: Relaxation, low: Array, high: Array, tau1: float, tau2: float, h: float) -> float:
    """The larger of utilisation and stress, relative to their limits."""
    utilisation, stress = utilisation_and_stress(p, low, high, tau1, tau2, h)
    return max(utilisation / p.limits[0], stress / p.limits[1])


@kernel
def greatest_thickness(
    p: Relaxation,
    low: Array,
    high: Array,
    tau1: float,
    tau2: float,
    h1: float,
    h2: float,
    h2_severity: float,
    steps: int,
) -> float:
    """Upper bound of the thickness at which the severity reaches 1; severity(h1) <= 1 < severity(h2).

    Valid for any number of ``steps``.
    """
    a, b = math.log(h1), math.log(h2)
    fa, fb = math.log(max(severity(p, low, high, tau1, tau2, h1), 1e-300)), math.log(min(h2_severity, 1e300))
    for _ in range(steps):
        if b - a < 1e-9:
            break
        share = fa / (fa - fb)
        # Aim slightly beyond the root, so that the upper end moves; keep away from the ends of the bracket.
        guess = a + min(max(share + 0.02 * (1.0 - share) * share, 0.002), 0.998) * (b - a)
        value = math.log(max(severity(p, low, high, tau1, tau2, math.exp(guess)), 1e-300))
        if value > 0.0:
            b, fb = guess, value
            if value < 1e-7:
                break
        else:
            a, fa = guess, value
    return math.exp(b)


@kernel
def fill(p: Relaxation, tau: Array, l: Array, work: Work) -> None:
    """Compute the ranges at every angle over the box."""
    for i in range(p.force.size):
        over = work.bending
        over.bounded[i], _, _, _ = bending_ranges(
            p.force[i], p.modulus, p.rod_length, tau, l, p.eta,
            over.centre[i], over.slope[i], over.low[i], over.high[i],
        )  # fmt: skip
    ei = p.modulus / 12.0
    for i in range(p.react_force.size):
        over = work.clamp
        over.bounded[i], middle, least, stout = bending_ranges(
            p.react_force[i], p.modulus, p.rod_length, tau, l, CLAMP,
            over.centre[i], over.slope[i], over.low[i], over.high[i],
        )  # fmt: skip
        work.stiffness[i, 0] = ei * (least / tau[2] if least > 0.0 else least / tau[0])
        work.stiffness[i, 1] = ei * middle / tau[1]
        work.stiffness[i, 2] = ei * (stout / tau[0] if stout > 0.0 else stout / tau[2])


@kernel
def least_magnitude(a: float, b: float) -> float:
    return a if a > 0.0 else (-b if b < 0.0 else 0.0)


@kernel
def reactions(p: Relaxation, stiffness_low: Array, stiffness_high: Array) -> tuple[float, float, float]:
    """Lower bounds of maximum side force [N] and contact pressure [Pa] and of friction power [W]."""
    side, pressure, power = 0.0, 0.0, 0.0
    offset, diameter, skirt, friction = p.guide
    for i in range(p.react_force.size):
        s = abs(p.react_stroke[i])
        k1, k2 = stiffness_low[i], stiffness_high[i]
        T = s * least_magnitude(k1, k2)
        arm = p.rod_length + offset
        m1, m2 = (arm * k1, arm * k2) if arm > 0.0 else (arm * k2, arm * k1)
        couple = 6.0 / skirt * s * least_magnitude(m1 - p.react_force[i], m2 - p.react_force[i])
        side, pressure = max(side, T), max(pressure, T + couple)
        wall = 0.5 * (couple + T * T / couple) if couple > T else T
        power += wall * p.react_speed[i]
    return side, pressure * 4.0 / (math.pi * diameter * skirt), power * friction * 4.0 / math.pi


@kernel
def stability_row(p: Relaxation, x: float, l: float) -> float:
    """S = ln(required/available safety) in the crank's plane: feasible if not positive."""
    if p.compression <= 0.0:
        return NEVER_COMPRESSED
    ln_u, _ = log_critical_parameter(l, p.rod_length)
    return x + math.log(12.0 * p.rod_length * p.rod_length * p.compression / p.modulus) - 2.0 * ln_u


@kernel
def least_thickness(slice_: Array, x2: float) -> float:
    """Minimum thickness [m] for any tau up to ln tau = x2; ``slice_`` = b, b, h, h bounds."""
    return max(slice_[2], math.exp(-(x2 + math.log(slice_[1])) / 3.0))


@kernel
def upper_thickness(p: Relaxation, slice_: Array, x1: float, l1: float) -> float:
    """Maximum thickness [m] by bounds and sideways stability for any tau and l above ln tau = x1 and l1."""
    cap = min(slice_[3], math.exp(-(x1 + math.log(slice_[0])) / 3.0))
    if p.compression > 0.0:
        cap = min(cap, sideways_thickness(p, x1, l1))
    return cap


@kernel
def sideways_thickness(p: Relaxation, x: float, l: float) -> float:
    """The thickness at which h b^3 = 1/(tau^3 h^8) is critical: E u^2/(12 L^2) h b^3 = compression."""
    ln_u, _ = log_critical_parameter(l, p.rod_length)
    return math.exp(0.125 * (math.log(p.modulus / (12.0 * p.rod_length**2 * p.compression)) + 2.0 * ln_u - 3.0 * x))


@kernel
def weigh(weights: Array, rows: Array) -> float:
    total = 0.0
    for r in range(weights.size):
        if weights[r] != 0.0:
            total += weights[r] * rows[r]
    return total


@kernel
def box_bound(
    p: Relaxation, slice_: Array, x1: float, x2: float, l1: float, l2: float, work: Work, wanted: float
) -> float:
    """Lower bound of ln objective over the box, inf if it is infeasible.

    Fills ``work``. ``wanted`` is the value above which the box is discarded: higher bounds need not be sharp.
    """
    tau, l, rows = np.empty(3), np.empty(3), np.empty(COUNT)
    tau[0], tau[1], tau[2] = math.exp(x1), math.exp(0.5 * (x1 + x2)), math.exp(x2)
    l[0], l[1], l[2] = l1, math.sqrt(l1 * l2), l2
    if stability_row(p, x1, l1) > 1e-13:
        return np.inf
    h1, h2 = least_thickness(slice_, x2), upper_thickness(p, slice_, x1, l1)
    if h1 > h2 * (1.0 + 1e-13):
        return np.inf
    h2 = max(h1, h2)
    fill(p, tau, l, work)
    w, low, high = p.weights, work.bending.low, work.bending.high
    rows[TAU] = x1 if w[TAU] > 0.0 else x2
    rows[LENGTH] = math.log(l1 if w[LENGTH] > 0.0 else l2)
    rows[STABILITY] = stability_row(p, x1, l1)
    rows[UTILISATION] = rows[SIDE] = rows[PRESSURE] = rows[POWER] = 0.0
    if p.limits[2] < np.inf or p.limits[3] < np.inf or w[SIDE] != 0.0 or w[PRESSURE] != 0.0 or w[POWER] != 0.0:
        side, pressure, power = reactions(p, work.stiffness[:, 0], work.stiffness[:, 2])
        if pressure > p.limits[2] * (1.0 + 1e-12) or power > p.limits[3] * (1.0 + 1e-12):
            return np.inf
        rows[SIDE], rows[PRESSURE] = math.log(max(side, 1e-300)), math.log(max(pressure, 1e-300))
        rows[POWER] = math.log(max(power, 1e-300))
    utilisation, stress = utilisation_and_stress(p, low, high, tau[0], tau[2], h1)
    if utilisation > p.limits[0] * (1.0 + 1e-12) or stress > p.limits[1] * (1.0 + 1e-12):
        return np.inf
    rows[UTILISATION] = math.log(max(utilisation, 1e-300))
    rows[THICKNESS] = math.log(h1)
    if w[THICKNESS] < 0.0:
        # The thickness that would reach the target; if it is infeasible, so is any larger one.
        rows[THICKNESS] = 0.0
        needed = math.exp(min((weigh(w, rows) - wanted) / -w[THICKNESS], 700.0))
        if needed > h2:
            return wanted
        if needed > h1 and severity(p, low, high, tau[0], tau[2], needed) > 1.0 + 1e-12:
            return wanted
        greatest = severity(p, low, high, tau[0], tau[2], h2)
        if greatest > 1.0 + 1e-12 and h2 > h1:
            h2 = greatest_thickness(p, low, high, tau[0], tau[2], h1, h2, greatest, _BOX_STEPS)
        rows[THICKNESS] = math.log(h2)
    return weigh(w, rows)


@kernel
def point_value(p: Relaxation, slice_: Array, x: float, l: float, work: Work, tolerance: float) -> tuple[float, float]:
    """ln objective and thickness of the best strip at (tau, l), from the centre values in ``work``; inf if none."""
    rows, bending = np.empty(COUNT), work.bending.centre
    tau = math.exp(x)
    rows[TAU], rows[LENGTH], rows[STABILITY] = x, math.log(l), stability_row(p, x, l)
    if rows[STABILITY] > tolerance:
        return np.inf, np.nan
    h1, h2 = least_thickness(slice_, x), upper_thickness(p, slice_, x, l)
    if h1 > h2 * (1.0 + 1e-12):
        return np.inf, np.nan
    h2 = max(h1, h2)
    side, pressure, power = reactions(p, work.stiffness[:, 1], work.stiffness[:, 1])
    if pressure > p.limits[2] * (1.0 + tolerance) or power > p.limits[3] * (1.0 + tolerance):
        return np.inf, np.nan
    rows[SIDE], rows[PRESSURE] = math.log(max(side, 1e-300)), math.log(max(pressure, 1e-300))
    rows[POWER] = math.log(max(power, 1e-300))
    utilisation, stress = utilisation_and_stress(p, bending, bending, tau, tau, h1)
    if utilisation > p.limits[0] * (1.0 + tolerance) or stress > p.limits[1] * (1.0 + tolerance):
        return np.inf, np.nan
    rows[UTILISATION] = math.log(max(utilisation, 1e-300))
    h = h1
    if p.weights[THICKNESS] < 0.0:
        h, greatest = h2, severity(p, work.bending.centre, work.bending.centre, tau, tau, h2)
        if greatest > 1.0 + tolerance and h2 > h1:
            h = greatest_thickness(
                p, work.bending.centre, work.bending.centre, tau, tau, h1, h2, greatest, _POINT_STEPS
            ) * (1.0 - 1e-9)
    rows[THICKNESS] = math.log(h)
    return weigh(p.weights, rows), h
