"""Guide loads of the piston over one revolution: maximum side force, clamp moment, contact load; mean friction power.

    |T| + 6 |M|/Lp is the maximum of the four sums +-T +- 6 M/Lp,  M = M0 + T e,
    power = mean of (4/pi) mu int |q| ds |v|

A magnitude has kinks at sign changes, so each is computed as a maximum of smooth quantities. The friction power has
kinks at the dead centres and where contact switches between one and both walls, |T| = 6 |M|/Lp; between them it is
integrated by Gauss quadrature, in ever smaller parts where that is not enough: with both walls in contact, the wall
force has a pole at M = 0, which may lie just beyond a switch.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.numerics.panels import Rule, greatest, largest, panel_error, zeros
from solvers.numerics.ripple import Ripple, amplitude_bounds
from solvers.numerics.ripple_peaks import greatest_with_ripple
from solvers.rod.cycle.sampling import TURN
from solvers.rod.piston.friction import travel
from solvers.rod.piston.skirt import both_walls
from solvers.rod.scene import Scene

Array = NDArray[np.float64]

SIDE_FORCE, CLAMP_MOMENT, CONTACT_LOAD, GUIDE_READINGS = range(4)
"""Maximum |T| [N], |M0| [N m] and |T| + 6 |M0 + T e|/Lp [N] over the revolution, and their number."""

_ORDERS = (3, 6, 10, 16)
_GAUSS = np.concatenate([np.stack(legendre.leggauss(order)) for order in _ORDERS], axis=1)
"""Points and weights of Gauss rules of increasing order, concatenated."""
_MAX_HALVINGS = 12
"""Maximum number of bisections of an interval between kinks."""
_EIGHTHS = 0.125 * TURN * np.arange(8)


class Guide(NamedTuple):
    """The guide and its loads, SI units.

    side, moment  T [N] and M0 [N m] at the panels' points, (n,)
    lever         6/Lp [1/m] of the skirt
    offset        clamp offset e [m]
    per_wall      (4/pi) mu r omega [m/s]: friction power per wall force and |dx/dphi|/r
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
    per_wall = piston.friction_coefficient * (4.0 / math.pi) * mechanism.crank_radius * mechanism.angular_speed
    ratio = mechanism.crank_radius / mechanism.rod_length
    return Guide(side, moment, 6.0 / piston.skirt_length, piston.clamp_offset, per_wall, ratio)


@kernel
def couple_of(side: Array, moment: Array, lever: float, offset: float) -> Array:
    """6 (M0 + T e)/Lp [N] from side forces T and clamp moments M0, or from contributions to them."""
    return lever * (moment + offset * side)


@kernel
def beside(one: Array, share: float, other: Array) -> Array:
    """one + share other."""
    out = np.empty(one.size)
    for i in range(one.size):
        out[i] = one[i] + share * other[i]
    return out


@kernel
def greater(one: float, of_one: float, other: float, of_other: float) -> tuple[float, float]:
    """The larger of two values, and its error including the possible excess of the other."""
    if one >= other:
        return one, max(of_one, other + of_other - one)
    return other, max(of_other, one + of_one - other)


@kernel
def magnitude(
    edges: Array, rule: Rule, quantity: Array, ripple: Ripple | None, parts: Array, tolerance: float
) -> tuple[float, float]:
    """Maximum magnitude over the revolution, to relative ``tolerance``, and an estimate of its absolute error, of a
    quantity at the panels' points plus a ripple with weights ``parts``."""
    wanted = tolerance * largest(quantity)
    if ripple is None:
        above, of_above, _ = greatest(edges, rule, quantity, 1.0, wanted)
        below, of_below, _ = greatest(edges, rule, quantity, -1.0, wanted)
    else:
        reach = amplitude_bounds(ripple, parts)
        above, of_above, _ = greatest_with_ripple(edges, rule, quantity, 1.0, wanted, ripple, parts, reach)
        below, of_below, _ = greatest_with_ripple(edges, rule, quantity, -1.0, wanted, ripple, parts, reach)
    return greater(above, of_above, below, of_below)


@kernel
def read_guide(
    edges: Array, rule: Rule, guide: Guide, ripple: Ripple | None, of_side: Array, of_moment: Array, contact: bool,
    tolerance: float, out: Array,
) -> float:  # fmt: skip
    """Write side force, clamp moment and, on request, contact load to ``out`` (GUIDE_READINGS,); returns the maximum
    relative error. ``of_side`` and ``of_moment`` are the ripple parts' weights in T [N] and M0 [N m], (parts,)."""
    out[SIDE_FORCE], missed = magnitude(edges, rule, guide.side, ripple, of_side, tolerance)
    error = relative(missed, out[SIDE_FORCE])
    out[CLAMP_MOMENT], missed = magnitude(edges, rule, guide.moment, ripple, of_moment, tolerance)
    error = max(error, relative(missed, out[CLAMP_MOMENT]))
    if contact:
        couple = couple_of(guide.side, guide.moment, guide.lever, guide.offset)
        of_couple = couple_of(of_side, of_moment, guide.lever, guide.offset)
        for_one, for_two = beside(guide.side, 1.0, couple), beside(guide.side, -1.0, couple)
        of_one, of_two = beside(of_side, 1.0, of_couple), beside(of_side, -1.0, of_couple)
        one, missed = magnitude(edges, rule, for_one, ripple, of_one, tolerance)
        two, missed_two = magnitude(edges, rule, for_two, ripple, of_two, tolerance)
        out[CONTACT_LOAD], missed = greater(one, missed, two, missed_two)
        error = max(error, relative(missed, out[CONTACT_LOAD]))
    return error


@kernel
def relative(error: float, value: float) -> float:
    """An absolute error relative to a value, 0 if the value is 0."""
    return error / abs(value) if value != 0.0 else 0.0


@kernel
def _both_at(edges: Array, rule: Rule, guide: Guide, angle: float) -> tuple[float, float]:
    """T [N] and M0 [N m] at an angle: interpolants of their panel (``numerics.panels.interpolate``)."""
    n = rule.points.size
    p = min(max(np.searchsorted(edges, angle, side="right") - 1, 0), edges.size - 2)
    x = (2.0 * angle - edges[p] - edges[p + 1]) / (edges[p + 1] - edges[p])
    side, moment, below = 0.0, 0.0, 0.0
    for j in range(n):
        apart = x - rule.points[j]
        if apart == 0.0:
            return guide.side[p * n + j], guide.moment[p * n + j]
        share = rule.weights[j] / apart
        below += share
        side += share * guide.side[p * n + j]
        moment += share * guide.moment[p * n + j]
    return side / below, moment / below


@kernel
def _power_by(edges: Array, rule: Rule, guide: Guide, left: float, right: float, first: int, order: int) -> float:
    """Contribution to the mean friction power [W] of what is between two angles, by the Gauss rule of an order, from
    its ``first`` point on."""
    half, middle, total = 0.5 * (right - left), 0.5 * (right + left), 0.0
    for j in range(first, first + order):
        angle = middle + half * _GAUSS[0, j]
        side, moment = _both_at(edges, rule, guide, angle)
        wall = both_walls(abs(side), guide.lever * abs(moment + side * guide.offset))
        total += _GAUSS[1, j] * (wall * travel(guide.ratio, angle))
    return guide.per_wall * half * total / TURN


@kernel
def _power_within(
    edges: Array, rule: Rule, guide: Guide, left: float, right: float, wanted: float
) -> tuple[float, float]:
    """``_power_by`` the lowest order enough for the error ``wanted`` [W], and its difference from the order before."""
    before, value, first = np.inf, np.inf, 0
    for order in _ORDERS:
        before, value = value, _power_by(edges, rule, guide, left, right, first, order)
        if abs(value - before) <= wanted:
            break
        first += order
    return value, abs(value - before)


@kernel
def friction_power(edges: Array, rule: Rule, guide: Guide, tolerance: float) -> tuple[float, float]:
    """Mean friction power [W] and its relative error, with the orders and parts required for ``tolerance``."""
    n, couple = rule.points.size, couple_of(guide.side, guide.moment, guide.lever, guide.offset)
    # The dead centres, and enough further angles for |v| to be nearly polynomial in between.
    corners = np.concatenate((_EIGHTHS, zeros(edges, rule, beside(couple, -1.0, guide.side))))
    corners = np.concatenate((corners, zeros(edges, rule, beside(couple, 1.0, guide.side))))
    for k in range(corners.size):
        corners[k] = edges[0] + (corners[k] - edges[0]) % TURN
    ends = np.sort(np.concatenate((edges, corners)))
    rough, power, error, rights = 0.0, 0.0, 0.0, np.empty(_MAX_HALVINGS + 2)
    for k in range(ends.size - 1):
        rough += _power_by(edges, rule, guide, ends[k], ends[k + 1], 0, _ORDERS[0])
    wanted = tolerance * rough / TURN
    for k in range(ends.size - 1):
        # Parts from left to right; the ends of those that wait are in ``rights``, the next one last.
        left, waiting, least = ends[k], 0, (ends[k + 1] - ends[k]) / 2.0**_MAX_HALVINGS
        rights[0] = ends[k + 1]
        while waiting >= 0:
            width = rights[waiting] - left
            part, missed = _power_within(edges, rule, guide, left, rights[waiting], wanted * width)
            if missed > wanted * width and width > 1.5 * least:
                waiting += 1
                rights[waiting] = left + 0.5 * width
            else:
                power, error, left, waiting = power + part, error + missed, rights[waiting], waiting - 1
    if power == 0.0:
        return 0.0, 0.0
    # Relative to the maximum reactions over the revolution; the mean of |v| is two strokes per revolution.
    missed = 0.0
    for p in range(edges.size - 1):
        both = panel_error(guide.side[p * n : (p + 1) * n], rule) + panel_error(couple[p * n : (p + 1) * n], rule)
        missed += both * (edges[p + 1] - edges[p])
    bound = guide.per_wall * 4.0 / TURN
    return power, (error + missed / TURN * bound) / power
