"""Guide loads of the piston over one revolution: maximum side force, clamp moment, contact load; mean friction power.

    |T| + 6 |M|/Lp is the maximum of the four sums +-T +- 6 M/Lp,  M = M0 + T e,
    power = mean of (4/pi) mu int |q| ds |v|

A magnitude has kinks at sign changes, so each is computed as a maximum of smooth quantities. The friction power has
kinks at the dead centres and where contact switches between one and both walls, |T| = 6 |M|/Lp; between them it is
integrated by Gauss quadrature, with bisection where that is not enough: with both walls in contact, the wall force has
a pole at M = 0, which may lie just beyond a switch.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.panels import Rule, greatest, largest, panel_error, zeros
from solvers.numerics.periodic import TURN
from solvers.numerics.ripple import Ripple, amplitude_bounds
from solvers.numerics.ripple_peaks import greatest_with_ripple
from solvers.rod.cycle.section import RingingShape
from solvers.rod.piston.friction import power_per_wall, travel
from solvers.rod.piston.skirt import both_walls, couple_of
from solvers.rod.scene import Scene

SIDE_FORCE, CLAMP_MOMENT, CONTACT_LOAD, GUIDE_RESULTS = range(4)
"""Maximum |T| [N], |M0| [N m] and |T| + 6 |M0 + T e|/Lp [N] over the revolution, and their number."""

_ORDERS = (3, 6, 10, 16)
_GAUSS = np.concatenate([np.stack(legendre.leggauss(order)) for order in _ORDERS], axis=1)
"""Points and weights of Gauss rules of increasing order, concatenated."""
_MAX_BISECTIONS = 12
"""Maximum number of bisections of an interval between kinks."""
_EIGHTHS = 0.125 * TURN * np.arange(8)


class Guide(NamedTuple):
    """The guide and its loads, SI units.

    side, moment  T [N] and M0 [N m] at the panels' points, (n,)
    lever         6/Lp [1/m] of the skirt
    offset        clamp offset e [m]
    per_wall      ``power_per_wall`` [m/s]
    ratio         r/L
    """

    side: Array
    moment: Array
    lever: float
    offset: float
    per_wall: float
    ratio: float


def guide_of(scene: Scene, side: Array, moment: Array) -> Guide:
    """The guide of a machine."""
    mechanism, piston = scene.mechanism, scene.piston
    ratio = mechanism.crank_radius / mechanism.rod_length
    return Guide(side, moment, 6.0 / piston.skirt_length, piston.clamp_offset, power_per_wall(scene), ratio)


@kernel
def larger_with_error(one: float, one_error: float, other: float, other_error: float) -> tuple[float, float]:
    """The larger of two values, and its error including the possible excess of the other."""
    if one >= other:
        return one, max(one_error, other + other_error - one)
    return other, max(other_error, one + one_error - other)


@kernel
def magnitude(
    edges: Array, rule: Rule, quantity: Array, ripple: Ripple | None, weights: Array, tolerance: float
) -> tuple[float, float]:
    """Maximum magnitude over the revolution, to relative ``tolerance``, and an estimate of its absolute error, of a
    quantity at the panels' points plus a ripple whose parts have the ``weights``."""
    target = tolerance * largest(quantity)
    if ripple is None:
        upper, upper_error, _ = greatest(edges, rule, quantity, 1.0, target)
        lower, lower_error, _ = greatest(edges, rule, quantity, -1.0, target)
    else:
        reach = amplitude_bounds(ripple, weights)
        upper, upper_error, _ = greatest_with_ripple(edges, rule, quantity, 1.0, target, ripple, weights, reach)
        lower, lower_error, _ = greatest_with_ripple(edges, rule, quantity, -1.0, target, ripple, weights, reach)
    return larger_with_error(upper, upper_error, lower, lower_error)


@kernel
def guide_results(
    edges: Array, rule: Rule, guide: Guide, ringing: RingingShape | None, contact: bool, tolerance: float, out: Array
) -> float:
    """Write maximum side force, clamp moment and, on request, contact load to ``out`` (GUIDE_RESULTS,); return the
    maximum relative error."""
    if ringing is None:
        ripple, side_weights, moment_weights = None, np.empty(0), np.empty(0)
    else:
        ripple, side_weights, moment_weights = ringing.ripple, ringing.side, ringing.moment
    out[SIDE_FORCE], absolute_error = magnitude(edges, rule, guide.side, ripple, side_weights, tolerance)
    error = relative(absolute_error, out[SIDE_FORCE])
    out[CLAMP_MOMENT], absolute_error = magnitude(edges, rule, guide.moment, ripple, moment_weights, tolerance)
    error = max(error, relative(absolute_error, out[CLAMP_MOMENT]))
    if contact:
        couple = couple_of(guide.side, guide.moment, guide.lever, guide.offset)
        couple_weights = couple_of(side_weights, moment_weights, guide.lever, guide.offset)
        plus, plus_error = magnitude(
            edges, rule, guide.side + couple, ripple, side_weights + couple_weights, tolerance
        )  # fmt: skip
        minus, minus_error = magnitude(
            edges, rule, guide.side - couple, ripple, side_weights - couple_weights, tolerance
        )  # fmt: skip
        out[CONTACT_LOAD], absolute_error = larger_with_error(plus, plus_error, minus, minus_error)
        error = max(error, relative(absolute_error, out[CONTACT_LOAD]))
    return error


@kernel
def relative(error: float, value: float) -> float:
    """Absolute error relative to a value; 0 if the value is 0."""
    return error / abs(value) if value != 0.0 else 0.0


@kernel
def _reactions_at(edges: Array, rule: Rule, guide: Guide, angle: float) -> tuple[float, float]:
    """T [N] and M0 [N m] at an angle, interpolated in their panel (``numerics.panels.interpolate``)."""
    n = rule.points.size
    p = min(max(np.searchsorted(edges, angle, side="right") - 1, 0), edges.size - 2)
    x = (2.0 * angle - edges[p] - edges[p + 1]) / (edges[p + 1] - edges[p])
    side, moment, denominator = 0.0, 0.0, 0.0
    for j in range(n):
        distance = x - rule.points[j]
        if distance == 0.0:
            return guide.side[p * n + j], guide.moment[p * n + j]
        weight = rule.weights[j] / distance
        denominator += weight
        side += weight * guide.side[p * n + j]
        moment += weight * guide.moment[p * n + j]
    return side / denominator, moment / denominator


@kernel
def _gauss_power(edges: Array, rule: Rule, guide: Guide, left: float, right: float, first: int, order: int) -> float:
    """Contribution to the mean friction power [W] of the interval between two angles, by the Gauss rule of an order,
    whose points begin at ``first``."""
    half_width, middle, total = 0.5 * (right - left), 0.5 * (right + left), 0.0
    for j in range(first, first + order):
        angle = middle + half_width * _GAUSS[0, j]
        side, moment = _reactions_at(edges, rule, guide, angle)
        wall = both_walls(abs(side), abs(couple_of(side, moment, guide.lever, guide.offset)))
        total += _GAUSS[1, j] * (wall * travel(guide.ratio, angle))
    return guide.per_wall * half_width * total / TURN


@kernel
def _power_to_tolerance(
    edges: Array, rule: Rule, guide: Guide, left: float, right: float, tolerance: float
) -> tuple[float, float]:
    """``_gauss_power`` by the lowest sufficient order for an error of ``tolerance`` [W], and its difference from the
    previous order."""
    last_value, value, first = np.inf, np.inf, 0
    for order in _ORDERS:
        last_value, value = value, _gauss_power(edges, rule, guide, left, right, first, order)
        if abs(value - last_value) <= tolerance:
            break
        first += order
    return value, abs(value - last_value)


@kernel
def friction_power(edges: Array, rule: Rule, guide: Guide, tolerance: float) -> tuple[float, float]:
    """Mean friction power [W] and its relative error, with the orders and bisections that ``tolerance`` requires."""
    n, couple = rule.points.size, couple_of(guide.side, guide.moment, guide.lever, guide.offset)
    # The dead centres, and further angles so that |v| is nearly polynomial in between.
    switches = zeros(edges, rule, couple - guide.side), zeros(edges, rule, couple + guide.side)
    kinks = np.concatenate((_EIGHTHS, switches[0], switches[1]))
    for k in range(kinks.size):
        kinks[k] = edges[0] + (kinks[k] - edges[0]) % TURN
    ends = np.sort(np.concatenate((edges, kinks)))
    estimate, power, error, pending = 0.0, 0.0, 0.0, np.empty(_MAX_BISECTIONS + 2)
    for k in range(ends.size - 1):
        estimate += _gauss_power(edges, rule, guide, ends[k], ends[k + 1], 0, _ORDERS[0])
    density = tolerance * estimate / TURN
    for k in range(ends.size - 1):
        # Intervals from left to right; ``pending`` is the stack of right ends of those not yet integrated.
        left, depth, min_width = ends[k], 0, (ends[k + 1] - ends[k]) / 2.0**_MAX_BISECTIONS
        pending[0] = ends[k + 1]
        while depth >= 0:
            width = pending[depth] - left
            part, part_error = _power_to_tolerance(edges, rule, guide, left, pending[depth], density * width)
            if part_error > density * width and width > 1.5 * min_width:
                depth += 1
                pending[depth] = left + 0.5 * width
            else:
                power, error, left, depth = power + part, error + part_error, pending[depth], depth - 1
    if power == 0.0:
        return 0.0, 0.0
    # The mean of |v| is two strokes per revolution. An interpolant's error oscillates n times in a panel: against a
    # weight that changes its sign once it integrates to at most 2/n of its bound.
    sampling_error = 0.0
    for p in range(edges.size - 1):
        points = slice(p * n, (p + 1) * n)
        panel_errors = panel_error(guide.side[points], rule) + panel_error(couple[points], rule)
        sampling_error += panel_errors * (edges[p + 1] - edges[p])
    bound = 2.0 / n * guide.per_wall * 4.0 / TURN
    return power, (error + sampling_error / TURN * bound) / power
