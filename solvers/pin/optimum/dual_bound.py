"""A lower bound of the mass that trusts nobody: tangents of the Lagrangian at the answer, and its levels.

For multipliers that are not negative the Lagrangian, with every flexibility replaced by its convex envelope, is nowhere
above the objective on feasible pins, and being convex and separable it lies above its tangents. So for any u^ whatever

    sum s_i u_i  >=  sum s_i (u^_i + lambda g_i(u^_i)) - lambda + sum of min over [l_i, 1] of h_i (u - u^_i),

h_i = d/du_i of the Lagrangian. Only the multipliers come from a solver; bad ones make the bound loose, not wrong.

Where u must not fall toward the middle, envelopes of single stations give too much away: they mix thin walls with solid
ones side by side. There a station's term f_i = s_i (u + lambda g_i) is split at the level c from which phi is concave,
f_i(u) = f_i(min(u, c)) + [f_i(max(u, c)) - f_i(c)]. The first part is convex, and the tangent's minimum runs over u
that do not fall, which on a block of equal u^ is a threshold: a sum of suffixes. The second part, summed, is the
integral over the levels z from c to 1 of the sum of f_i'(z) over all stations whose u is above z: a suffix t(z).
Whatever u is, that is no less than the integral of M(z) = min over t of sum_{i >= t} f_i'(z). Third derivatives of 1/v
and phi are negative, so every such sum is concave in z, hence M as well, and the trapezoidal rule lies below its
integral.

A slope limit |u_{i+1} - u_i| <= k_i (sqrt(1-u_i) + sqrt(1-u_{i+1})) is separable as well, and its multipliers join h_i.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.optimum.lagrangian import monotone_at
from solvers.pin.optimum.program import Program
from solvers.pin.section.flexibility import bending, chord, inflection, line_from, phi, phi_slope

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
_LEVELS, _CELLS = 513, 128
_TIGHT, _AROUND, _TRIES, _GOLDEN = 1e-7, 0.2, 14, 0.5 * (math.sqrt(5.0) - 1.0)
"""Below which gap no better multiplier is looked for; where and how often otherwise."""
_SAME, _WORTH = 1e-8, 8.0
"""Deflections that agree as well as this, or as the accuracy asked for, are the same; what a share of the deflection is
worth in the mass at most, relative."""


def told_apart(deflection: float | None, constrained_um: object, accuracy: float) -> float:
    """What a bound must give way, relative to the mass, where the deflection told [m] is not the one searched with
    [um].

    Both are one formula, so this is 0 but for rounding; were they not, a pin that uses the limit up by the one would
    miss it or leave room by the other, and each per cent of the deflection is worth some per cents of the mass.
    """
    if deflection is None or not isinstance(constrained_um, float) or constrained_um == 0.0:
        return 0.0
    apart = abs(1e6 * deflection / constrained_um - 1.0)
    return _WORTH * apart if apart > max(_SAME, accuracy) else 0.0


@kernel
def _envelope(u: float, bend: float, shear: float, a: float, b: float, line: float) -> tuple[float, float]:
    """g = bend/v + shear phi up to ``line``, from there on straight to (1, g(1)), and its slope."""
    at = min(u, line)
    value, slope, _ = bending(at)
    g = bend * value + shear * phi(at, a, b)
    if u > line:
        fall = chord(line, bend, shear, a, b)
        return bend + shear * a + fall * (1.0 - u), -fall
    return g, bend * slope + shear * phi_slope(at, a, b)


@kernel
def _tangents(
    scale: float, share: Array, bend: Array, shear: Array, a: float, b: float, enveloped: bool, u: Array,
    value: Array, slope: Array,
) -> None:  # fmt: skip
    for i in range(u.size):
        value[i], slope[i] = share[i] * u[i], share[i]
        if scale > 0.0 and (bend[i] > 0.0 or shear[i] > 0.0):
            line = line_from(bend[i], shear[i], a, b) if enveloped else 1.0
            g, fall = _envelope(u[i], bend[i], shear[i], a, b, line)
            value[i] += share[i] * scale * g
            slope[i] += share[i] * scale * fall


def lagrangian(program: Program, multiplier: float, u: Array, enveloped: bool = True) -> tuple[Array, Array]:
    """Terms s_i (u_i + lambda g_i(u_i)) and their slopes at u; stations without deflection need no wall for it.

    ``enveloped`` replaces g_i by its convex envelope.
    """
    value, slope, law = np.empty_like(u), np.empty_like(u), program.law
    scale = multiplier / program.limit if multiplier > 0.0 else 0.0
    _tangents(
        scale, program.share, program.bending, program.shear, law.a, law.b, enveloped, u, value, slope
    )  # fmt: skip
    return value, slope


def least_walls_bound(program: Program, low: Array) -> float:
    """Volume of walls thinner than ``low`` by 1e-12 (relative; more where rounding hides that), each shown not to hold.

    Where ``low`` comes from a neighbour (no widening toward the middle, a slope, one bore for all), the neighbour's
    wall is what cannot be thinner, so the whole profile shrinks in proportion.
    """
    wall = program.sought.wall_of(program.lower)
    shrink = np.zeros_like(wall)
    bound_by_strength = wall > program.floor * (1.0 + 4e-16)
    for margin in (1e-12, 1e-10, 1e-8, 1e-6, 1e-4):
        fails = program.uses(wall * (1.0 - margin)).max(axis=0) > 1.0
        shrink = np.where(bound_by_strength & ~fails, np.maximum(shrink, 100.0 * margin), shrink)
        if not np.any(bound_by_strength & ~fails):
            break
    loss = np.maximum(shrink, 1e-12) if np.array_equal(low, program.lower) else max(float(shrink.max()), 1e-12)
    return program.volume(low * (1.0 - 2.0 * loss))


def pointwise_bound(program: Program, low: Array, multiplier: float, u: Array) -> float:
    """Lower bound of the volume over all u in [low, 1] that keep the deflection limit."""
    if math.isinf(multiplier):
        return program.volume(np.where((program.bending > 0) | (program.shear > 0), 1.0, low))
    value, slope = lagrangian(program, multiplier, u)
    return float(np.sum(value + np.where(slope > 0.0, slope * (low - u), slope * (1.0 - u)))) - multiplier


def monotone_bound(program: Program, low: Array, multiplier: float, u: Array) -> float:
    """The same over u that also do not fall toward the middle; ``low`` does not fall either."""
    if math.isinf(multiplier):
        return program.volume(u)
    knee = inflection(program.scene.material.poisson)
    capped, held = np.minimum(u, knee), np.minimum(low, knee)
    value, slope = lagrangian(program, multiplier, capped, enveloped=False)
    slope = np.where(low >= knee, 0.0, slope)
    total = float(np.sum(value)) - multiplier
    for half in halves(program):
        total += least_rising(capped[half], slope[half], held[half], knee)
        total += _above(program, multiplier, low[half], half, knee)
    return total


def halves(program: Program) -> list[Indices]:
    """The stations from one end to the middle, and from the other end back to it, where they are looked at."""
    stations = np.arange(program.lower.size)
    return [half for half in (stations[: program.anchor], stations[program.anchor :][::-1]) if half.size]


def least_rising(u: Array, slope: Array, low: Array, top: float) -> float:
    """The least of sum slope (v - u) over v in [low, ``top``] that do not fall along the stations, from below: u does
    not fall either, and on each of its blocks of equal u a v is looked for by itself."""
    total = 0.0
    starts = np.flatnonzero(np.concatenate([[True], u[1:] != u[:-1]]))
    for begin, end in zip(starts, np.append(starts[1:], u.size), strict=True):
        # v = top from some station of the block on, its low before it: the extreme points of rising sequences.
        suffix = np.concatenate([np.cumsum(slope[begin:end][::-1])[::-1], [0.0]])
        total += float(np.min((low[begin] - u[begin]) * (suffix[0] - suffix) + (top - u[begin]) * suffix))
    return total


def _above(program: Program, multiplier: float, low: Array, order: NDArray[np.int64], knee: float) -> float:
    """The integral of M(z) over the levels from ``knee`` to 1, from below; one half's stations in their order."""
    scale = multiplier / program.limit

    def suffixes(of: Array) -> Array:
        return np.concatenate([np.cumsum(of[order][::-1])[::-1], [0.0]])

    share = program.share
    sums = np.stack(
        [suffixes(share), scale * suffixes(share * program.bending), scale * suffixes(share * program.shear)]
    )
    ends = np.array([knee, 1.0])
    # A wall that must be above some level must be so from its own station on.
    beyond = low[(low > knee) & (low < 1.0)]
    if (
        not beyond.size
        and low[-1] < 1.0
        and _levels(ends, np.array([low.size]), sums, program.law.a, program.law.b) == 0.0
    ):
        return 0.0
    levels = np.unique(np.concatenate([np.linspace(knee, 1.0, _LEVELS), beyond]))
    latest = np.searchsorted(low, levels[1:], side="left")
    return _levels(levels, latest, sums, program.law.a, program.law.b)


@kernel
def _levels(levels: Array, latest: Indices, sums: Array, a: float, b: float) -> float:
    """Trapezoidal rule for min over t <= latest of sums[0] + sums[1] (1/v)' + sums[2] phi'."""
    total = 0.0
    for k in range(latest.size):
        for end in range(2):
            z, least = levels[k + end], np.inf
            bent, sheared = bending(z)[1], phi_slope(z, a, b)
            for t in range(latest[k] + 1):
                least = min(least, sums[0, t] + sums[1, t] * bent + sums[2, t] * sheared)
            total += 0.5 * (levels[k + 1] - levels[k]) * least
    return total


def monotone_bound_around(program: Program, low: Array, multiplier: float, u: Array) -> float:
    """``monotone_bound`` at the answer's multiplier; where a jump to the solid section has kept that from being the
    best one, at others around it (golden section: the bound is concave in the multiplier)."""
    bound = monotone_bound(program, low, multiplier, u)
    if math.isinf(multiplier) or bound >= program.volume(u) * (1.0 - _TIGHT):
        return bound

    def at(factor: float) -> float:
        price = factor * multiplier
        return monotone_bound(program, low, price, monotone_at(program, low, price, u))

    left, right = 1.0 - _AROUND, 1.0 + _AROUND
    ahead, behind = right - _GOLDEN * (right - left), left + _GOLDEN * (right - left)
    one, other = at(ahead), at(behind)
    for _ in range(_TRIES):
        bound = max(bound, one, other)
        if one > other:
            right, behind, other = behind, ahead, one
            ahead = right - _GOLDEN * (right - left)
            one = at(ahead)
        else:
            left, ahead, one = ahead, behind, other
            behind = left + _GOLDEN * (right - left)
            other = at(behind)
    return max(bound, one, other)


@dataclass(frozen=True)
class Neighbours:
    """Multipliers between stations i and i + 1, (n - 1,) each: of the rise and the fall of u beyond the slope limit,
    with its ``reach`` k_i, and of falling (before the middle) or rising (behind it) where the bore must narrow."""

    rise: Array
    fall: Array
    reach: Array
    order: Array


def coupled_bound(program: Program, low: Array, multiplier: float, between: Neighbours) -> float:
    """Lower bound of the volume for constraints u_{i+1} - u_i <= k_i r_i, u_i - u_{i+1} <= k_i r_i with
    r_i = sqrt(1-u_i) + sqrt(1-u_{i+1}), and u not falling toward the middle.

    With all multipliers given, the Lagrangian is a sum of one function per station, s (u + lambda g) + c u - k
    sqrt(1-u), each bounded from below over the whole of [l, 1]; the solver's own u does not enter. Up to the knee, from
    which phi is concave, it is convex: a tangent where bisection finds it least. Beyond, on each of some intervals, phi
    lies above its chord and 1/v above its tangent in the middle, and what is left has its least value in closed form.
    """
    pull, net = np.zeros_like(low), np.zeros_like(low)
    flow = between.rise - between.fall + between.order
    net[:-1] -= flow
    net[1:] += flow
    pull[:-1] += (between.rise + between.fall) * between.reach
    pull[1:] += (between.rise + between.fall) * between.reach
    knee = inflection(program.scene.material.poisson)
    convex = np.where(low < knee, _least_to_knee(program, np.minimum(low, knee), knee, multiplier, net, pull), np.inf)
    beyond = _least_beyond(program, np.maximum(low, knee), multiplier, net, pull)
    return float(np.sum(np.minimum(convex, beyond))) - multiplier


def _least_to_knee(
    program: Program, low: Array, knee: float, multiplier: float, net: Array, pull: Array
) -> Array:  # fmt: skip
    """A lower bound of every station's term over [low, knee]."""

    def at(u: Array) -> tuple[Array, Array]:
        value, slope = lagrangian(program, multiplier, u, enveloped=False)
        root = np.sqrt(1.0 - u)
        return value + net * u - pull * root, slope + net + 0.5 * pull / root

    left, right = low.copy(), np.full_like(low, knee)
    left = np.where((program.bending > 0.0) | (program.shear > 0.0), np.maximum(left, 1e-12), left)
    for _ in range(60):
        middle = 0.5 * (left + right)
        falling = at(middle)[1] < 0.0
        left, right = np.where(falling, middle, left), np.where(falling, right, middle)
    u = 0.5 * (left + right)
    value, slope = at(u)
    return value + np.where(slope > 0.0, slope * (low - u), slope * (knee - u))


def _least_beyond(program: Program, low: Array, multiplier: float, net: Array, pull: Array) -> Array:
    """A lower bound of every station's term over [low, 1], low at the knee or beyond."""
    share, law = program.share[:, None], program.law
    scale = multiplier / program.limit if multiplier > 0.0 else 0.0
    z = low[:, None] + (1.0 - low[:, None]) * np.linspace(0.0, 1.0, _CELLS + 1)
    z0, z1 = z[:, :-1], z[:, 1:]
    middle, wide = 0.5 * (z0 + z1), np.maximum(z1 - z0, 1e-300)
    bent, bent_slope = 1.0 / (middle * (2.0 - middle)), 0.5 * (1.0 / (2.0 - middle) ** 2 - 1.0 / middle**2)
    sheared = law.a / z + law.b * (1.0 - z) / (z * (2.0 - z) ** 2)
    rise = np.diff(sheared, axis=1) / wide
    slope = share * (1.0 + scale * (program.bending[:, None] * bent_slope + program.shear[:, None] * rise))
    value = share * (middle + scale * program.bending[:, None] * bent)
    value += share * scale * program.shear[:, None] * (sheared[:, :-1] + rise * (middle - z0))
    slope, held = slope + net[:, None], pull[:, None]
    # value + slope (u - middle) + net middle - pull sqrt(1 - u) is convex: least at an end or where its slope is 0.
    root = np.where(slope < 0.0, -0.5 * held / np.minimum(slope, -1e-300), np.inf)
    turn = np.clip(1.0 - root * root, z0, z1)
    least = np.inf
    for u in (z0, turn, z1):
        least = np.minimum(least, slope * (u - middle) - held * np.sqrt(np.maximum(1.0 - u, 0.0)))
    return np.min(value + net[:, None] * middle + least, axis=1)
