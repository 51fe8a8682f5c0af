"""Dual (Lagrangian) method for the deflection limit: one multiplier, one one-dimensional minimisation per station.

For a multiplier lambda the Lagrangian sum s_i (u_i + lambda (B_i/v + S_i phi)) - lambda separates into stations (or,
if the bore must narrow toward the middle, into blocks of equal u, found by pooling adjacent violators), each
minimised over all u (``solvers.pin.optimum.station_minimum``). The deflection decreases with lambda; 1/deflection^2
is nearly linear in it, so a safeguarded Newton method converges in a few iterations. The method is one compiled
function.

A station may jump to the solid section at a critical lambda. The stations that jump at the final lambda take an
intermediate value; panels are refined around them as around any kink.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.pin.optimum.program import DualSolution, Program
from solvers.pin.optimum.station_minimum import STEP_TOLERANCE, minimiser, solid_threshold, stationary
from solvers.pin.section.flexibility import Flexibility, curvatures, densities, flexibilities, slopes

_EPS = float(np.finfo(float).eps)
_MAX_ITERATIONS = 200
MAX_SLACK = 4e-14
"""Maximum relative margin of the converged deflection below its limit."""
_ROUNDING = 1e-14
"""Relative rounding error of a sum over stations."""
_LIMIT_TOLERANCE = 1e-12
"""Relative tolerance within which a deflection equals the limit."""
_FIRST_TOLERANCE = 1e-2
"""Relative step tolerance of the stations in the first iteration; later a thousandth of the deflection's relative
excess over its limit."""
_JUMP_TOLERANCE = 1e-10
"""Relative bracket width of the multiplier at which the search ends if stations jump there, so that no multiplier gives
the limit exactly."""


@kernel
def minimise_stations(
    lam: float, weight: Array, low: Array, bend: Array, shear: Array, thresholds: Array, law: Flexibility, pooled: bool,
    middle_index: int, tolerance: float, u: Array,
) -> tuple[float, float]:  # fmt: skip
    """Minimise the Lagrangian at every station for multiplier ``lam``, in place with initial values ``u``.

    For a pin the last relative step is at most ``tolerance``, so that the error is about its square. Returns the
    deflection sum s h, h = bend f + shear g, and its derivative in lambda, excluding stations that become solid.
    ``pooled``: u (and low) non-decreasing along the stations up to ``middle_index``, and again from there on.
    ``thresholds`` (n, 2): ``solid_threshold`` of a pin's stations, unused for a bushing.
    """
    n = u.size
    w, wb, ws, lo, at = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    count = np.empty(n, dtype=np.int64)
    top, first, k = -1, 0, 1.0 / lam
    for i in range(n):
        top += 1
        if i == middle_index:
            first = top
        w[top], wb[top], ws[top], lo[top], count[top] = weight[i], weight[i] * bend[i], weight[i] * shear[i], low[i], 1
        if law.kappa >= 0.0:
            at[top] = minimiser(lam, 1.0, bend[i], shear[i], low[i], u[i], law)
        elif k < thresholds[i, 1]:
            at[top] = 1.0
        else:
            at[top] = stationary(k, low[i], thresholds[i, 0], bend[i], shear[i], u[i], law, tolerance)
        while pooled and top > first and at[top - 1] > at[top]:
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
def solid_thresholds(low: Array, bend: Array, shear: Array, law: Flexibility) -> Array:
    """Return ``solid_threshold`` of a pin's stations, (n, 2); empty for a bushing."""
    found = np.empty((low.size if law.kappa < 0.0 else 0, 2))
    for i in range(found.shape[0]):
        found[i, 0], found[i, 1] = solid_threshold(low[i], bend[i], shear[i], law)
    return found


@kernel
def _copy_to(values: Array, to: Array) -> None:
    # An explicit loop: whole-array assignment adds seconds of compile time, mostly for its error message.
    for i in range(to.size):
        to[i] = values[i]


@kernel
def _deflection(weight: Array, bend: Array, shear: Array, law: Flexibility, u: Array) -> float:
    """Return the deflection sum s h over the loaded stations; inf if one of them has no wall."""
    total = 0.0
    for i in range(u.size):
        if bend[i] > 0.0 or shear[i] > 0.0:
            if u[i] <= 0.0:
                return np.inf
            f, g = flexibilities(u[i], law)
            total += weight[i] * (bend[i] * f + shear[i] * g)
    return total


@kernel
def _find_multiplier(
    weight: Array, low: Array, bend: Array, shear: Array, law: Flexibility, monotone: bool, middle_index: int,
    solid: Array, best: Array, soft: Array,
) -> tuple[float, int, float]:  # fmt: skip
    """Return (multiplier, iterations, deflection relative to its limit) of the minimum-volume solution.

    ``best`` receives its u, ``soft`` the u of the greatest multiplier found too small. The multiplier is NaN if even
    ``solid`` is too soft, and inf if only ``solid`` is stiff enough; a bushing is always feasible.
    """
    _copy_to(low, best)
    total = _deflection(weight, bend, shear, law, low)
    if total <= 1.0 + _ROUNDING:
        return 0.0, 0, total
    _copy_to(solid, best)
    least = _deflection(weight, bend, shear, law, solid) if law.kappa < 0.0 else 0.0
    if least > 1.0 + _LIMIT_TOLERANCE:
        return np.nan, 0, least
    if least >= 1.0 - _LIMIT_TOLERANCE:
        return np.inf, 0, least
    # Exact for thin walls without lower bounds; an initial guess otherwise.
    lam = 0.0
    for i in range(low.size):
        lam += weight[i] * math.sqrt(0.5 * bend[i] + shear[i] * (law.a + 0.25 * law.b * abs(law.kappa)))
    lam *= lam
    u = np.empty(low.size)
    _copy_to(low, u)
    _copy_to(low, soft)
    lower, upper, found, deflection = 0.0, np.inf, np.inf, least
    thresholds, iterations, tolerance = solid_thresholds(low, bend, shear, law), 0, _FIRST_TOLERANCE
    while iterations < _MAX_ITERATIONS:
        iterations += 1
        total, derivative = minimise_stations(
            lam, weight, low, bend, shear, thresholds, law, monotone, middle_index, tolerance, u
        )
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


class Segments(NamedTuple):
    """Sections coupled by a deflection limit: n stations, or n segments of uniform wall.

    ``weight``, and the coefficients B and S (``bending``, ``shear``) in metres, (n,) each; the ``limit`` [m]; the
    ``law`` of the flexibilities; ``middle_index``, the index of the first section of the second half.
    """

    weight: Array
    bending: Array
    shear: Array
    limit: float
    law: Flexibility
    middle_index: int

    def deflections(self, u: Array) -> Array:
        """Contributions to the deflection [m]."""
        return self.weight * densities(u, self.bending, self.shear, self.law)


@kernel
def _minimum_volume(segments: Segments, low: Array, monotone: bool) -> tuple[float, float, int, Array, Array]:
    """As ``_find_multiplier`` for all segments: deflection relative to its limit, multiplier, iterations, both u.

    Segments without deflection keep their minimum walls, unless walls must not thin toward the middle; the second
    half is traversed from its end.
    """
    n, middle_index = low.size, segments.middle_index
    order = np.empty(n, dtype=np.int64)
    table = np.empty((7, n))
    count = 0
    for k in range(n):
        i = k if k < middle_index else n - 1 + middle_index - k
        loaded = segments.bending[i] > 0.0 or segments.shear[i] > 0.0
        if monotone or loaded:
            order[count] = i
            table[0, count], table[1, count] = segments.weight[i], low[i]
            table[2, count] = segments.bending[i] / segments.limit
            table[3, count] = segments.shear[i] / segments.limit
            before = table[4, count - 1] if count > 0 and k != middle_index else 0.0
            table[4, count] = 1.0 if loaded else max(low[i], before)
            count += 1
    multiplier, iterations, total = _find_multiplier(
        table[0][:count], table[1][:count], table[2][:count], table[3][:count], segments.law,
        monotone, middle_index, table[4][:count], table[5][:count], table[6][:count],
    )  # fmt: skip
    best, soft = low.copy(), low.copy()
    for i in range(count):
        best[order[i]], soft[order[i]] = table[5, i], table[6, i]
    return total, multiplier, iterations, best, soft


def minimum_volume(program: Program, low: Array | None, monotone: bool) -> DualSolution | None:
    """Minimise the volume under the deflection limit; None if even the solid pin exceeds it.

    ``low`` is the lower bound of u at every station, by default the program's (see ``minimum_segment_volume``).
    """
    p, low = program, program.lower if low is None else low
    if p.limit is None:
        return DualSolution(low, 0.0, 0)
    segments = Segments(p.weight, p.bending, p.shear, p.limit, p.law, p.middle_index)
    return minimum_segment_volume(segments, low, monotone)


def minimum_segment_volume(segments: Segments, low: Array, monotone: bool) -> DualSolution | None:
    """Minimise the volume over u >= ``low`` under the deflection limit; None if even the solid pin exceeds it.

    With ``monotone`` u and ``low`` are non-decreasing toward the middle. The solution is feasible, with a relative
    slack of at most MAX_SLACK.
    """
    total, multiplier, iterations, best, soft = _minimum_volume(segments, low, monotone)
    if math.isnan(multiplier):
        return None
    if 0.0 < multiplier < math.inf and total < 1.0 - _LIMIT_TOLERANCE:
        best = _interpolated(segments, soft, best)
    return DualSolution(best, multiplier, iterations)


def _interpolated(segments: Segments, soft: Array, stiff: Array) -> Array:
    """Interpolate between a too soft and a feasible solution so that the deflection lies slightly inside the limit."""
    from scipy.optimize import brentq

    def slack(fraction: float) -> float:
        deflections = segments.deflections(soft + fraction * (stiff - soft))
        return segments.limit / float(deflections.sum()) - 1.0 - 0.4 * MAX_SLACK

    least, most = slack(0.0), slack(1.0)
    if not least < 0.0 < most:
        return stiff
    step = max(0.1 * MAX_SLACK / (most - least), _EPS)
    fraction = brentq(slack, 0.0, 1.0, xtol=step, rtol=4.0 * _EPS)
    while slack(fraction) < -0.4 * MAX_SLACK:
        # Where the slack is steeper than on average.
        fraction, step = min(fraction + step, 1.0), 2.0 * step
    return soft + fraction * (stiff - soft)
