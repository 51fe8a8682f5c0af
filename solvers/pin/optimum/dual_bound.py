"""Lower bounds of the mass, independent of the solver: from tangents of the Lagrangian and from its level sets.

For non-negative multipliers the Lagrangian, with every flexibility replaced by its convex envelope, is a lower bound of
the objective on feasible pins; being convex and separable it lies above its tangents. So for any u^ (the point of
tangency)

    sum s_i u_i  >=  sum s_i (u^_i + lambda h_i(u^_i)) - lambda + sum of min over [l_i, 1] of k_i (u - u^_i),

h_i = bend f + shear g of a station and k_i = d/du_i of the Lagrangian. Only the multipliers come from a solver; poor
ones weaken the bound but keep it valid.

If u must not decrease toward the middle, stationwise envelopes are too weak: they mix thin walls and solid sections
in adjacent stations. There a station's term t_i = s_i (u + lambda h_i) is split at the level c above which g is
concave, t_i(u) = t_i(min(u, c)) + [t_i(max(u, c)) - t_i(c)]. The first part is convex, and the tangent is minimised
over non-decreasing u, whose minimiser on a block of equal u^ is a threshold: a sum of suffixes. The second part,
summed, is the integral over the levels z from c to 1 of the sum of t_i'(z) over all stations with u above z: a
suffix k(z). For every u it is at least the integral of M(z) = min over k of sum_{i >= k} t_i'(z). Third derivatives
of f and g are negative, so every such sum is concave in z, hence M as well, and the trapezoidal rule underestimates
its integral. A bushing's terms are convex everywhere; their minima lie below a u at which all slopes are positive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.pin.optimum.program import Program
from solvers.pin.section.flexibility import (
    Flexibility,
    chord_decrease,
    envelope_line_start,
    flexibilities,
    inflection,
    slopes,
)

Indices = NDArray[np.int64]
_MIN_LEVELS, _SUBINTERVALS = 513, 128


@kernel
def _tangents(
    scale: float, weight: Array, bend: Array, shear: Array, law: Flexibility, enveloped: bool, u: Array
) -> tuple[Array, Array]:
    value, slope = np.empty_like(u), np.empty_like(u)
    for i in range(u.size):
        value[i], slope[i] = weight[i] * u[i], weight[i]
        if not (scale > 0.0 and (bend[i] > 0.0 or shear[i] > 0.0)):
            continue
        line_start = envelope_line_start(bend[i], shear[i], law) if enveloped and law.kappa < 0.0 else np.inf
        if u[i] > line_start:
            # The convex envelope is linear from here to the solid section.
            fall = chord_decrease(line_start, bend[i], shear[i], law)
            h, h_slope = bend[i] + shear[i] * law.a + fall * (1.0 - u[i]), -fall
        else:
            (f, g), (df, dg) = flexibilities(u[i], law), slopes(u[i], law)
            h, h_slope = bend[i] * f + shear[i] * g, bend[i] * df + shear[i] * dg
        value[i] += weight[i] * scale * h
        slope[i] += weight[i] * scale * h_slope
    return value, slope


def lagrangian(program: Program, multiplier: float, u: Array, enveloped: bool = True) -> tuple[Array, Array]:
    """Return the terms s_i (u_i + lambda h_i(u_i)) and their slopes at u; stations without deflection may have no
    wall.

    ``enveloped`` replaces h_i by its convex envelope.
    """
    scale = multiplier / program.limit if multiplier > 0.0 else 0.0
    return _tangents(scale, program.weight, program.bending, program.shear, program.law, enveloped, u)


def _max_u(program: Program, multiplier: float, u: Array) -> float:
    """Return an upper bound of every minimiser: 1 for a pin, for a bushing a u at which all slopes are positive."""
    if program.variable.kappa < 0.0:
        return 1.0
    top = float(u.max())
    while np.any(lagrangian(program, multiplier, np.full_like(u, top))[1] < 0.0):
        top *= 1.5
    return top


def least_walls_bound(program: Program, low: Array) -> float:
    """Return the volume of walls thinner than ``low`` by 1e-12 (relative; more if required by rounding), after
    verifying that they violate the strength constraints wherever the floor does not set them.

    Where ``low`` is determined by another station (monotone or slope-limited bore), that station's wall is binding, so
    the whole profile is reduced in proportion; u decreases at most as the wall.
    """
    wall = program.variable.wall_of(program.lower)
    loss, by_strength = np.full_like(wall, 1e-12), program.lower > program.variable.solidity_of(program.floor)
    for margin in (1e-12, 1e-10, 1e-8, 1e-6, 1e-4):
        holds = by_strength & (program.utilisations(wall * (1.0 - margin)).max(axis=0) <= 1.0)
        if not holds.any():
            break
        loss[holds] = 100.0 * margin
    return program.volume(low * (1.0 - 2.0 * (loss if low is program.lower else loss.max())))


def pointwise_bound(program: Program, low: Array, multiplier: float, u: Array) -> float:
    """Return a lower bound of the volume over all u >= low that satisfy the deflection limit."""
    if math.isinf(multiplier):
        return program.volume(np.where((program.bending > 0) | (program.shear > 0), 1.0, low))
    value, slope = lagrangian(program, multiplier, u)
    top = _max_u(program, multiplier, u)
    return float(np.sum(value + np.where(slope > 0.0, slope * (low - u), slope * (top - u)))) - multiplier


def monotone_bound(program: Program, low: Array, multiplier: float, u: Array) -> float:
    """Return the bound of ``pointwise_bound`` over u non-decreasing toward the middle, as ``low`` is."""
    if math.isinf(multiplier):
        return program.volume(u)
    is_pin = program.variable.kappa < 0.0
    concave_from = inflection(program.scene.material.poisson) if is_pin else _max_u(program, multiplier, u)
    capped, bounded = np.minimum(u, concave_from), np.minimum(low, concave_from)
    value, slope = lagrangian(program, multiplier, capped, enveloped=False)
    slope = np.where(low >= concave_from, 0.0, slope)
    total = float(np.sum(value)) - multiplier + monotone_minimum(capped, slope, bounded, concave_from)
    return total + (_bound_where_concave(program, multiplier, low, concave_from) if is_pin else 0.0)


def monotone_minimum(u: Array, slope: Array, low: Array, top: float) -> float:
    """Return a lower bound of min sum slope (v - u) over non-decreasing v in [low, ``top``].

    u is non-decreasing too; each of its blocks of equal u is minimised separately.
    """
    total = 0.0
    starts = np.flatnonzero(np.concatenate([[True], u[1:] != u[:-1]]))
    for begin, end in zip(starts, np.append(starts[1:], u.size), strict=True):
        # Extreme points of non-decreasing sequences: v = low before some station of the block, v = top from it on.
        suffix = np.concatenate([np.cumsum(slope[begin:end][::-1])[::-1], [0.0]])
        total += float(np.min((low[begin] - u[begin]) * (suffix[0] - suffix) + (top - u[begin]) * suffix))
    return total


def _bound_where_concave(program: Program, multiplier: float, low: Array, concave_from: float) -> float:
    """Return a lower bound of the integral of M(z) from ``concave_from`` to 1."""
    scale = multiplier / program.limit
    rows = np.stack([program.weight, scale * program.weight * program.bending, scale * program.weight * program.shear])
    sums = np.concatenate([np.cumsum(rows[:, ::-1], axis=1)[:, ::-1], np.zeros((3, 1))], axis=1)
    # A lower bound above some level forces all stations from its own on above that level.
    beyond = low[(low > concave_from) & (low < 1.0)]
    levels = np.unique(np.concatenate([np.linspace(concave_from, 1.0, _MIN_LEVELS), beyond]))
    latest = np.searchsorted(low, levels[1:], side="left")
    return _integral_over_levels(levels, latest, sums, program.law)


@kernel
def _integral_over_levels(levels: Array, latest: Indices, sums: Array, law: Flexibility) -> float:
    """Trapezoidal rule for min over t <= latest of sums[0] + sums[1] f' + sums[2] g'."""
    total = 0.0
    for k in range(latest.size):
        for end in range(2):
            z, least = levels[k + end], np.inf
            bent, sheared = slopes(z, law)
            for t in range(latest[k] + 1):
                least = min(least, sums[0, t] + sums[1, t] * bent + sums[2, t] * sheared)
            total += 0.5 * (levels[k + 1] - levels[k]) * least
    return total


@dataclass(frozen=True)
class NeighbourMultipliers:
    """Lagrange multipliers of the constraints between stations i and i + 1, (n - 1,) each.

    ``rise`` and ``fall``: of the slope limit on an increase and a decrease of u; ``order``: of monotonicity (negative
    in the first half, positive in the second).
    """

    rise: Array
    fall: Array
    order: Array


def slope_steps(program: Program) -> Array:
    """Return k_i = s h_i/l between neighbouring stations, (n - 1,); 0 without a slope limit."""
    return (program.limits.max_slope or 0.0) * np.diff(program.stations.x) / program.variable.unit


def coupled_bound(
    program: Program, low: Array, multiplier: float, multipliers: NeighbourMultipliers, volume: float
) -> float:
    """Return a lower bound of the volume under slope and monotonicity constraints between neighbours.

    The slope constraints are those of ``solvers.pin.optimum.conic``; ``volume`` is that of a feasible part. For fixed
    multipliers the Lagrangian separates into one function per station, s (u + lambda h) + p u - q sqrt(c -+ u), with p
    ``linear`` and q ``radical``, each bounded from below over all u that a lighter part may have; the solver's u is not
    used. Up to the inflection point of a pin's g the function is convex, and is bounded by its tangent at the minimum,
    located by bisection. Above, on each subinterval, g lies above its chord and f above its midpoint tangent, and the
    remainder is minimised in closed form.
    """
    radical, linear = np.zeros_like(low), np.zeros_like(low)
    flow = multipliers.rise - multipliers.fall + multipliers.order
    linear[:-1] -= flow
    linear[1:] += flow
    pull = (multipliers.rise + multipliers.fall) * slope_steps(program)
    radical[:-1] += pull
    radical[1:] += pull
    if program.variable.kappa >= 0.0:
        # In a lighter part no station has more than the whole volume.
        most = np.maximum(volume / program.weight, low)
        return float(np.sum(_coupled_bound_where_convex(program, low, most, multiplier, linear, radical))) - multiplier
    concave_from = inflection(program.scene.material.poisson)
    end = np.full_like(low, concave_from)
    convex_part = _coupled_bound_where_convex(program, np.minimum(low, end), end, multiplier, linear, radical)
    concave_part = _coupled_bound_where_concave(program, np.maximum(low, end), multiplier, linear, radical)
    return float(np.sum(np.minimum(np.where(low < concave_from, convex_part, np.inf), concave_part))) - multiplier


def _coupled_bound_where_convex(
    program: Program, low: Array, high: Array, multiplier: float, linear: Array, radical: Array
) -> Array:  # fmt: skip
    """Return a lower bound of every station's term over [low, high], where it is convex."""
    sign, square = program.variable.sign, (program.variable.given / program.variable.unit) ** 2

    def at(u: Array) -> tuple[Array, Array]:
        value, slope = lagrangian(program, multiplier, u, enveloped=False)
        root = np.sqrt(square + sign * u)
        return value + linear * u - radical * root, slope + linear - 0.5 * sign * radical / root

    left, right = np.where((program.bending > 0.0) | (program.shear > 0.0), np.maximum(low, 1e-12), low), high
    for _ in range(60):
        middle = 0.5 * (left + right)
        falling = at(middle)[1] < 0.0
        left, right = np.where(falling, middle, left), np.where(falling, right, middle)
    u = 0.5 * (left + right)
    value, slope = at(u)
    return value + np.where(slope > 0.0, slope * (low - u), slope * (high - u))


def _coupled_bound_where_concave(
    program: Program, low: Array, multiplier: float, linear: Array, radical: Array
) -> Array:
    """Return a lower bound of every station's term over [low, 1], where low is at or above g's inflection point."""
    weight, law = program.weight[:, None], program.law
    scale = multiplier / program.limit if multiplier > 0.0 else 0.0
    z = low[:, None] + (1.0 - low[:, None]) * np.linspace(0.0, 1.0, _SUBINTERVALS + 1)
    z0, z1 = z[:, :-1], z[:, 1:]
    middle, wide = 0.5 * (z0 + z1), np.maximum(z1 - z0, 1e-300)
    bent, bent_slope = 1.0 / (middle * (2.0 - middle)), 0.5 * (1.0 / (2.0 - middle) ** 2 - 1.0 / middle**2)
    sheared = law.a / z + law.b * (1.0 - z) / (z * (2.0 - z) ** 2)
    rise = np.diff(sheared, axis=1) / wide
    slope = weight * (1.0 + scale * (program.bending[:, None] * bent_slope + program.shear[:, None] * rise))
    value = weight * (middle + scale * program.bending[:, None] * bent)
    value += weight * scale * program.shear[:, None] * (sheared[:, :-1] + rise * (middle - z0))
    slope, bounded = slope + linear[:, None], radical[:, None]
    # value + slope (u - middle) + p middle - q sqrt(1 - u) is convex: minimum at an end or a stationary point.
    root = np.where(slope < 0.0, -0.5 * bounded / np.minimum(slope, -1e-300), np.inf)
    stationary_point = np.clip(1.0 - root * root, z0, z1)
    least = np.inf
    for u in (z0, stationary_point, z1):
        least = np.minimum(least, slope * (u - middle) - bounded * np.sqrt(np.maximum(1.0 - u, 0.0)))
    return np.min(value + linear[:, None] * middle + least, axis=1)
