"""Dual (Lagrangian) method for the deflection limit: one multiplier, one one-dimensional minimisation per station.

For a multiplier lambda the Lagrangian sum s_i (u_i + lambda (B_i/v + S_i phi)) - lambda separates into sections (or,
if the bore must narrow toward the middle, into blocks of equal u, found by pooling adjacent violators), each
minimised over all u (``solvers.pin.optimum.station_minimum``). The deflection decreases with lambda; 1/deflection^2
is nearly linear in it, so a safeguarded Newton method converges in a few iterations. The method is one compiled
function.

A station may jump to the solid section at a critical lambda. The stations that jump at the final lambda take an
intermediate value; panels are refined around them as around any kink.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.pin.load.macaulay import LIMIT_TOLERANCE
from solvers.pin.optimum.program import Program
from solvers.pin.optimum.station_minimum import STEP_TOLERANCE, minimiser, solid_threshold, stationary
from solvers.pin.section.flexibility import Flexibility, curvatures, densities, flexibilities, slopes

_EPS = float(np.finfo(float).eps)
_MAX_ITERATIONS = 200
MAX_SLACK = 4e-14
"""Maximum relative margin of the converged deflection below its limit."""
_ROUNDING = 1e-14
"""Relative rounding error of a sum over stations."""
_FIRST_TOLERANCE = 1e-2
"""Relative step tolerance of the stations in the first iteration; later a thousandth of the deflection's relative
excess over its limit."""
_JUMP_TOLERANCE = 1e-10
"""Relative bracket width of the multiplier at which the search ends if stations jump there, so that no multiplier gives
the limit exactly."""


class Segments(NamedTuple):
    """Segments coupled by a deflection limit, from the end to the middle: stations, or segments of uniform wall.

    ``weight``, and the coefficients B and S (``bending``, ``shear``) over the limit, (n,) each; ``law`` of the
    flexibilities.
    """

    weight: Array
    bending: Array
    shear: Array
    law: Flexibility


@dataclass(frozen=True)
class DualSolution:
    """Solution u of the sections, Lagrange multiplier of the deflection limit, and number of iterations.

    The multiplier refers to the relative deflection; 0: the limit is not binding, inf: only the solid section
    satisfies it.
    """

    solidity: Array
    multiplier: float
    iterations: int


def multiplier_evidence(multiplier: float) -> float | str:
    """Return the multiplier of a solution as evidence of its bound."""
    return multiplier if math.isfinite(multiplier) else "unbounded: only the solid span"


@kernel
def minimise_stations(
    lam: float, segments: Segments, low: Array, thresholds: Array, pooled: bool, tolerance: float, u: Array
) -> tuple[float, float]:
    """Minimise the Lagrangian of every section for multiplier ``lam``, in place with initial values ``u``.

    For a pin the last relative step is at most ``tolerance``, so that the error is about its square. Returns the
    deflection sum s h, h = bend f + shear g, and its derivative in lambda, excluding sections that become solid.
    ``pooled``: u (and low) non-decreasing. ``thresholds`` (n, 2): ``solid_threshold`` of a pin's sections, unused for a
    bushing.
    """
    n, law = u.size, segments.law
    w, wb, ws, lo, at = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    count = np.empty(n, dtype=np.int64)
    top, k = -1, 1.0 / lam
    for i in range(n):
        top += 1
        weight, bend, shear = segments.weight[i], segments.bending[i], segments.shear[i]
        w[top], wb[top], ws[top], lo[top], count[top] = weight, weight * bend, weight * shear, low[i], 1
        if bend == 0.0 and shear == 0.0:
            at[top] = low[i]
        elif law.kappa >= 0.0:
            at[top] = minimiser(lam, 1.0, bend, shear, low[i], u[i], law)
        elif k < thresholds[i, 1]:
            at[top] = 1.0
        else:
            at[top] = stationary(k, low[i], thresholds[i, 0], bend, shear, u[i], law, tolerance)
        while pooled and top > 0 and at[top - 1] > at[top]:
            w[top - 1] += w[top]
            wb[top - 1] += wb[top]
            ws[top - 1] += ws[top]
            lo[top - 1] = lo[top]
            count[top - 1] += count[top]
            top -= 1
            at[top] = minimiser(lam, w[top], wb[top], ws[top], lo[top], at[top], law)
    total, derivative, i = 0.0, 0.0, 0
    for block in range(top + 1):
        x = at[block]
        for _ in range(count[block]):
            u[i] = x
            i += 1
        if wb[block] == 0.0 and ws[block] == 0.0:
            continue
        f, g = flexibilities(x, law)
        total += wb[block] * f + ws[block] * g
        if lo[block] < x and (law.kappa >= 0.0 or x < 1.0):
            (df, dg), (d2f, d2g) = slopes(x, law), curvatures(x, law)
            slope, curve = wb[block] * df + ws[block] * dg, max(wb[block] * d2f + ws[block] * d2g, 1e-300)
            derivative -= slope * slope / (lam * curve)
    return total, derivative


@kernel
def solid_thresholds(segments: Segments, low: Array) -> Array:
    """Return ``solid_threshold`` of a pin's sections, (n, 2); empty for a bushing."""
    found = np.empty((low.size if segments.law.kappa < 0.0 else 0, 2))
    for i in range(found.shape[0]):
        found[i, 0], found[i, 1] = solid_threshold(low[i], segments.bending[i], segments.shear[i], segments.law)
    return found


@kernel
def _copy_to(values: Array, to: Array) -> None:
    # An explicit loop: whole-array assignment adds seconds of compile time, mostly for its error message.
    for i in range(to.size):
        to[i] = values[i]


@kernel
def _deflection(segments: Segments, u: Array) -> float:
    """Return the deflection sum s h over the loaded sections; inf if one of them has no wall."""
    total = 0.0
    for i in range(u.size):
        if segments.bending[i] > 0.0 or segments.shear[i] > 0.0:
            if u[i] <= 0.0:
                return np.inf
            f, g = flexibilities(u[i], segments.law)
            total += segments.weight[i] * (segments.bending[i] * f + segments.shear[i] * g)
    return total


@kernel
def _find_multiplier(
    weight: Array, bending: Array, shearing: Array, kappa: float, a: float, b: float, low: Array, monotone: bool,
    best: Array, soft: Array,
) -> tuple[float, int, float]:  # fmt: skip
    """Return (multiplier, iterations, deflection relative to its limit) of the minimum-volume solution.

    ``best`` receives its u, ``soft`` the u of the greatest multiplier found too small. The multiplier is NaN if even
    solid sections are too soft, and inf if only they are stiff enough; a bushing is always feasible.
    """
    law = Flexibility(kappa, a, b)
    segments = Segments(weight, bending, shearing, law)
    _copy_to(low, best)
    _copy_to(low, soft)
    total = _deflection(segments, low)
    if total <= 1.0 + _ROUNDING:
        return 0.0, 0, total
    least = 0.0
    if law.kappa < 0.0:
        for i in range(low.size):
            if segments.bending[i] > 0.0 or segments.shear[i] > 0.0 or (monotone and i > 0 and best[i - 1] == 1.0):
                best[i] = 1.0
        least = _deflection(segments, best)
    if least > 1.0 + LIMIT_TOLERANCE:
        return np.nan, 0, least
    if least >= 1.0 - LIMIT_TOLERANCE:
        return np.inf, 0, least
    # Exact for thin walls without lower bounds; an initial guess otherwise.
    lam = 0.0
    for i in range(low.size):
        shear = segments.shear[i] * (law.a + 0.25 * law.b * abs(law.kappa))
        lam += segments.weight[i] * math.sqrt(0.5 * segments.bending[i] + shear)
    lam *= lam
    u = low.copy()
    lower, upper, found, deflection = 0.0, np.inf, np.inf, least
    thresholds, iterations, tolerance = solid_thresholds(segments, low), 0, _FIRST_TOLERANCE
    while iterations < _MAX_ITERATIONS:
        iterations += 1
        total, derivative = minimise_stations(lam, segments, low, thresholds, monotone, tolerance, u)
        tolerance = max(STEP_TOLERANCE, min(_FIRST_TOLERANCE, 1e-3 * abs(total - 1.0)))
        if total <= 1.0:
            _copy_to(u, best)
            found = upper = lam
            deflection = total
            if total >= 1.0 - MAX_SLACK:
                break
        else:
            lower = lam
            _copy_to(u, soft)
        if upper < np.inf and upper - lower <= _JUMP_TOLERANCE * upper:
            break
        # 1/total^2 is nearly linear in lambda; aim slightly inside the limit.
        new = np.nan
        if derivative < 0.0:
            aim = 1.0 - 0.4 * MAX_SLACK
            new = lam + (1.0 / (aim * aim) - 1.0 / (total * total)) / (-2.0 * derivative / (total * total * total))
        if not lower < new < upper:
            if lower > 0.0 and upper < np.inf:
                new = math.sqrt(lower * upper)
            else:
                new = 16.0 * lam if upper == np.inf else 0.0625 * upper
        lam = new
    return found, iterations, deflection


def minimum_volume(program: Program, low: Array, monotone: bool) -> DualSolution | None:
    """Minimise the volume of u >= ``low`` at a program's stations (see ``minimum_segment_volume``)."""
    p = program
    if p.limit is None:
        return DualSolution(low, 0.0, 0)
    # Stations in the boss, the first ones, do not contribute to the deflection: they keep their lower bounds.
    rest = slice(np.searchsorted(p.stations.side, p.scene.geometry.boss_length), None)
    segments = Segments(p.weight[rest], p.bending[rest] / p.limit, p.shear[rest] / p.limit, p.law)
    found = minimum_segment_volume(segments, low[rest], monotone)
    return found and replace(found, solidity=np.concatenate([low[: rest.start], found.solidity]))


def minimum_segment_volume(segments: Segments, low: Array, monotone: bool) -> DualSolution | None:
    """Minimise the volume over u >= ``low`` under the deflection limit; None if even the solid pin exceeds it.

    With ``monotone`` u and ``low`` are non-decreasing. The solution is feasible, with a relative slack of at most
    MAX_SLACK.
    """
    best, soft = np.empty((2, low.size))
    multiplier, iterations, total = _find_multiplier(*segments[:3], *segments.law, low, monotone, best, soft)
    if math.isnan(multiplier):
        return None
    if 0.0 < multiplier < math.inf and total < 1.0 - LIMIT_TOLERANCE:
        best = _interpolated(segments, soft, best)
    return DualSolution(best, multiplier, iterations)


def _interpolated(segments: Segments, soft: Array, stiff: Array) -> Array:
    """Interpolate between a too soft and a feasible solution so that the deflection lies slightly inside the limit."""
    from scipy.optimize import brentq

    def slack(fraction: float) -> float:
        found = densities(soft + fraction * (stiff - soft), segments.bending, segments.shear, segments.law)
        return 1.0 / float(segments.weight @ found) - 1.0 - 0.4 * MAX_SLACK

    least, most = slack(0.0), slack(1.0)
    if not least < 0.0 < most:
        return stiff
    step = max(0.1 * MAX_SLACK / (most - least), _EPS)
    fraction = brentq(slack, 0.0, 1.0, xtol=step, rtol=4.0 * _EPS)
    while slack(fraction) < -0.4 * MAX_SLACK:
        # Where the slack is steeper than on average.
        fraction, step = min(fraction + step, 1.0), 2.0 * step
    return soft + fraction * (stiff - soft)
