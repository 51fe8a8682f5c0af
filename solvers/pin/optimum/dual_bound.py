"""Lower bound of the mass that does not rely on the solver: tangents of the Lagrangian, and its level sets.

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

A slope limit |u_{i+1} - u_i| <= k_i (sqrt(1-u_i) + sqrt(1-u_{i+1})) is separable as well; its multipliers enter k_i.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.optimum.program import Program
from solvers.pin.section.flexibility import chord, flexibilities, inflection, line_from, slopes

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
_MIN_LEVELS, _SUBINTERVALS = 513, 128
_DEFLECTION_TOLERANCE, _MASS_PER_DEFLECTION = 1e-8, 8.0
"""Relative agreement below which two deflections are equal; upper estimate of the relative mass change per relative
deflection change."""


def bound_reduction(deflection: float | None, constrained_um: object, accuracy: float) -> float:
    """Return the relative reduction of the bound for a difference of the reported deflection [m] from the constrained
    one [um].

    Both use the same formula and differ by rounding only, so the result is normally 0. A real difference would mean
    that the reported pin violates the limit or leaves slack, where each per cent of the deflection is worth a few per
    cent of mass.
    """
    if deflection is None or not isinstance(constrained_um, float) or constrained_um == 0.0:
        return 0.0
    apart = abs(1e6 * deflection / constrained_um - 1.0)
    return _MASS_PER_DEFLECTION * apart if apart > max(_DEFLECTION_TOLERANCE, accuracy) else 0.0


@kernel
def _tangents(
    scale: float, share: Array, bend: Array, shear: Array, kappa: float, a: float, b: float, enveloped: bool, u: Array,
    value: Array, slope: Array,
) -> None:  # fmt: skip
    for i in range(u.size):
        value[i], slope[i] = share[i] * u[i], share[i]
        if not (scale > 0.0 and (bend[i] > 0.0 or shear[i] > 0.0)):
            continue
        line = line_from(bend[i], shear[i], a, b) if enveloped and kappa < 0.0 else np.inf
        if u[i] > line:
            # The convex envelope is linear from here to the solid section.
            fall = chord(line, bend[i], shear[i], a, b)
            own, change = bend[i] + shear[i] * a + fall * (1.0 - u[i]), -fall
        else:
            (f, g), (df, dg) = flexibilities(u[i], kappa, a, b), slopes(u[i], kappa, a, b)
            own, change = bend[i] * f + shear[i] * g, bend[i] * df + shear[i] * dg
        value[i] += share[i] * scale * own
        slope[i] += share[i] * scale * change


def lagrangian(program: Program, multiplier: float, u: Array, enveloped: bool = True) -> tuple[Array, Array]:
    """Return the terms s_i (u_i + lambda h_i(u_i)) and their slopes at u; stations without deflection may have no
    wall.

    ``enveloped`` replaces h_i by its convex envelope.
    """
    value, slope, law = np.empty_like(u), np.empty_like(u), program.law
    scale = multiplier / program.limit if multiplier > 0.0 else 0.0
    _tangents(
        scale, program.share, program.bending, program.shear, program.sought.kappa, law.a, law.b, enveloped, u, value,
        slope,
    )  # fmt: skip
    return value, slope


def _thickest(program: Program, multiplier: float, u: Array) -> float:
    """Return a u beyond which no term has its minimum: 1 for a pin, for a bushing where every slope is positive."""
    if program.sought.kappa < 0.0:
        return 1.0
    top = float(u.max())
    while np.any(lagrangian(program, multiplier, np.full_like(u, top))[1] < 0.0):
        top *= 1.5
    return top


def least_walls_bound(program: Program, low: Array) -> float:
    """Return the volume of walls thinner than ``low`` by 1e-12 (relative; more if required by rounding), verified to
    fail.

    Where ``low`` is inherited from a neighbour (monotone, slope-limited or uniform bore), the neighbour's wall is
    the binding one, so the whole profile is scaled in proportion.
    """
    wall = program.sought.wall_of(program.lower)
    loss = np.full_like(wall, 1e-12)
    bound_by_strength = program.lower > program.sought.solidity_of(np.array([program.floor]))
    for margin in (1e-12, 1e-10, 1e-8, 1e-6, 1e-4):
        holds = bound_by_strength & (program.uses(wall * (1.0 - margin)).max(axis=0) <= 1.0)
        if not holds.any():
            break
        loss[holds] = 100.0 * margin
    if not np.array_equal(low, program.lower):
        loss = float(loss.max())
    return program.volume(low * (1.0 - 2.0 * loss))


def pointwise_bound(program: Program, low: Array, multiplier: float, u: Array) -> float:
    """Return a lower bound of the volume over all u >= low that satisfy the deflection limit."""
    if math.isinf(multiplier):
        return program.volume(np.where((program.bending > 0) | (program.shear > 0), 1.0, low))
    value, slope = lagrangian(program, multiplier, u)
    top = _thickest(program, multiplier, u)
    return float(np.sum(value + np.where(slope > 0.0, slope * (low - u), slope * (top - u)))) - multiplier


def monotone_bound(program: Program, low: Array, multiplier: float, u: Array) -> float:
    """As ``pointwise_bound``, over u non-decreasing toward the middle; ``low`` is non-decreasing as well."""
    if math.isinf(multiplier):
        return program.volume(u)
    is_pin = program.sought.kappa < 0.0
    knee = inflection(program.scene.material.poisson) if is_pin else _thickest(program, multiplier, u)
    capped, held = np.minimum(u, knee), np.minimum(low, knee)
    value, slope = lagrangian(program, multiplier, capped, enveloped=False)
    slope = np.where(low >= knee, 0.0, slope)
    total = float(np.sum(value)) - multiplier
    for half in halves(program):
        total += least_rising(capped[half], slope[half], held[half], knee)
        if is_pin:
            total += _bound_above_knee(program, multiplier, low[half], half, knee)
    return total


def halves(program: Program) -> list[Indices]:
    """Return the station indices of each half, from the end toward the middle."""
    stations = np.arange(program.lower.size)
    return [half for half in (stations[: program.anchor], stations[program.anchor :][::-1]) if half.size]


def least_rising(u: Array, slope: Array, low: Array, top: float) -> float:
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


def _bound_above_knee(program: Program, multiplier: float, low: Array, order: NDArray[np.int64], knee: float) -> float:
    """Return a lower bound of the integral of M(z) over the levels from ``knee`` to 1, for one half in station
    order."""
    scale = multiplier / program.limit

    def suffixes(of: Array) -> Array:
        return np.concatenate([np.cumsum(of[order][::-1])[::-1], [0.0]])

    share = program.share
    sums = np.stack(
        [suffixes(share), scale * suffixes(share * program.bending), scale * suffixes(share * program.shear)]
    )
    ends = np.array([knee, 1.0])
    # A lower bound above some level forces all stations from its own on above that level.
    beyond = low[(low > knee) & (low < 1.0)]
    if (
        not beyond.size
        and low[-1] < 1.0
        and _integral_over_levels(ends, np.array([low.size]), sums, program.law.a, program.law.b) == 0.0
    ):
        return 0.0
    levels = np.unique(np.concatenate([np.linspace(knee, 1.0, _MIN_LEVELS), beyond]))
    latest = np.searchsorted(low, levels[1:], side="left")
    return _integral_over_levels(levels, latest, sums, program.law.a, program.law.b)


@kernel
def _integral_over_levels(levels: Array, latest: Indices, sums: Array, a: float, b: float) -> float:
    """Trapezoidal rule for min over t <= latest of sums[0] + sums[1] f' + sums[2] g'."""
    total = 0.0
    for k in range(latest.size):
        for end in range(2):
            z, least = levels[k + end], np.inf
            bent, sheared = slopes(z, -1.0, a, b)
            for t in range(latest[k] + 1):
                least = min(least, sums[0, t] + sums[1, t] * bent + sums[2, t] * sheared)
            total += 0.5 * (levels[k + 1] - levels[k]) * least
    return total


@dataclass(frozen=True)
class Neighbours:
    """Multipliers between stations i and i + 1, (n - 1,) each.

    Of the rise and the fall of u beyond the slope limit with ``reach`` k_i, and of the monotonicity constraint
    (falling before the middle, rising beyond it).
    """

    rise: Array
    fall: Array
    reach: Array
    order: Array


def coupled_bound(program: Program, low: Array, multiplier: float, between: Neighbours, volume: float) -> float:
    """Return a lower bound of the volume under slope and monotonicity constraints between neighbours.

    Constraints u_{i+1} - u_i <= k_i r_i, u_i - u_{i+1} <= k_i r_i with r_i = sqrt(c -+ u_i) + sqrt(c -+ u_{i+1}), c =
    (G/l)^2, and u non-decreasing toward the middle; ``volume`` is that of a feasible part. For fixed multipliers the
    Lagrangian separates into one function per station, s (u + lambda g) + net u - pull sqrt(c -+ u), each bounded from
    below over all u that a lighter part may have; the solver's u is not used. Up to a pin's knee, above which g is
    concave, the function is convex: tangent at the minimum located by bisection. Beyond, on each subinterval, g lies
    above its chord and f above its midpoint tangent, and the remainder is minimised in closed form.
    """
    pull, net = np.zeros_like(low), np.zeros_like(low)
    flow = between.rise - between.fall + between.order
    net[:-1] -= flow
    net[1:] += flow
    pull[:-1] += (between.rise + between.fall) * between.reach
    pull[1:] += (between.rise + between.fall) * between.reach
    if program.sought.kappa >= 0.0:
        # No station of a lighter part exceeds its whole volume.
        most = np.maximum(volume / program.share, low)
        return float(np.sum(_bound_where_convex(program, low, most, multiplier, net, pull))) - multiplier
    knee = inflection(program.scene.material.poisson)
    up_to_knee = _bound_where_convex(program, np.minimum(low, knee), np.full_like(low, knee), multiplier, net, pull)
    beyond = _bound_beyond_knee(program, np.maximum(low, knee), multiplier, net, pull)
    return float(np.sum(np.minimum(np.where(low < knee, up_to_knee, np.inf), beyond))) - multiplier


def _bound_where_convex(
    program: Program, low: Array, most: Array, multiplier: float, net: Array, pull: Array
) -> Array:  # fmt: skip
    """Return a lower bound of every station's term over [low, most], where it is convex."""
    sign, square = program.sought.sign, (program.sought.given / program.sought.unit) ** 2

    def at(u: Array) -> tuple[Array, Array]:
        value, slope = lagrangian(program, multiplier, u, enveloped=False)
        root = np.sqrt(square + sign * u)
        return value + net * u - pull * root, slope + net - 0.5 * sign * pull / root

    left = np.where((program.bending > 0.0) | (program.shear > 0.0), np.maximum(low, 1e-12), low)
    right = most
    for _ in range(60):
        middle = 0.5 * (left + right)
        falling = at(middle)[1] < 0.0
        left, right = np.where(falling, middle, left), np.where(falling, right, middle)
    u = 0.5 * (left + right)
    value, slope = at(u)
    return value + np.where(slope > 0.0, slope * (low - u), slope * (most - u))


def _bound_beyond_knee(program: Program, low: Array, multiplier: float, net: Array, pull: Array) -> Array:
    """Return a lower bound of every station's term over [low, 1], low at the knee or beyond."""
    share, law = program.share[:, None], program.law
    scale = multiplier / program.limit if multiplier > 0.0 else 0.0
    z = low[:, None] + (1.0 - low[:, None]) * np.linspace(0.0, 1.0, _SUBINTERVALS + 1)
    z0, z1 = z[:, :-1], z[:, 1:]
    middle, wide = 0.5 * (z0 + z1), np.maximum(z1 - z0, 1e-300)
    bent, bent_slope = 1.0 / (middle * (2.0 - middle)), 0.5 * (1.0 / (2.0 - middle) ** 2 - 1.0 / middle**2)
    sheared = law.a / z + law.b * (1.0 - z) / (z * (2.0 - z) ** 2)
    rise = np.diff(sheared, axis=1) / wide
    slope = share * (1.0 + scale * (program.bending[:, None] * bent_slope + program.shear[:, None] * rise))
    value = share * (middle + scale * program.bending[:, None] * bent)
    value += share * scale * program.shear[:, None] * (sheared[:, :-1] + rise * (middle - z0))
    slope, held = slope + net[:, None], pull[:, None]
    # value + slope (u - middle) + net middle - pull sqrt(1 - u) is convex: minimum at an end or a stationary point.
    root = np.where(slope < 0.0, -0.5 * held / np.minimum(slope, -1e-300), np.inf)
    turn = np.clip(1.0 - root * root, z0, z1)
    least = np.inf
    for u in (z0, turn, z1):
        least = np.minimum(least, slope * (u - middle) - held * np.sqrt(np.maximum(1.0 - u, 0.0)))
    return np.min(value + net[:, None] * middle + least, axis=1)
