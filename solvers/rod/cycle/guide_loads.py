"""What the piston's guide bears over a turn: greatest side force, clamp moment and contact pressure, mean friction
power.

    |T| + 6 |M|/Lp is the greatest of the four sums +-T +- 6 M/Lp,  M = M0 + T e,
    power = mean of (4/pi) mu int |q| ds |v|

A magnitude has corners where its argument changes sign, so each is the greatest of smooth quantities. The friction
power has corners at the dead centres and where the piston begins or ceases to bear on both walls, |T| = 6 |M|/Lp;
between them it is integrated by Gauss' rule.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from solvers.numerics.panels import Panels, rule_of, split, tail_errors, values_at, zeros
from solvers.numerics.ripple import reaches, ripple_at
from solvers.rod.cycle.sampled import TURN, Extreme, SampledCycle
from solvers.rod.piston.friction import power_at
from solvers.rod.piston.skirt import pressure_per_load
from solvers.rod.scene import Scene

Array = NDArray[np.float64]

_WIDE = 0.95
_FINE, _COARSE = legendre.leggauss(22), legendre.leggauss(16)
_EIGHTHS = 0.125 * TURN * np.arange(8)
"""The dead centres, and as many angles more as keep |v| close to a polynomial between them."""
_KINKS, _NOTICED = 80.0, 1.0
"""By how much, all together, the slope of a reaction's weight in the mean jumps over the turn, at the most; of the
tolerance, what of the ringing may be left out of the mean."""
_RADIANS, _POINTS, _FASTEST = 8.0, 16, 1500.0
"""Of the fastest mode in a panel, its points, and the fastest mode [1/rad] that is looked at."""


def guide_loads(sampled: SampledCycle, contact: bool) -> tuple[Extreme, Extreme, Extreme | None]:
    """Greatest |T| [N], |M0| [N m] and, where asked for, contact pressure [Pa]."""
    piston, ringing = sampled.cycle.scene.piston, sampled.ringing
    # Quantities at the panels' points, and behind them what they take of the ringing's parts: sums act on both.
    side, moment = np.append(sampled.side, ringing.side), np.append(sampled.moment, ringing.moment)
    greatest_side, greatest_moment = _magnitude(sampled, side), _magnitude(sampled, moment)
    if not contact:
        return greatest_side, greatest_moment, None
    couple = 6.0 / piston.skirt_length * (moment + side * piston.clamp_offset)
    sums = _greater(_magnitude(sampled, side + couple), _magnitude(sampled, side - couple))
    per_force = pressure_per_load(piston.diameter, piston.skirt_length)
    return greatest_side, greatest_moment, Extreme(sums.value * per_force, sums.error * per_force, sums.angle)


def _magnitude(sampled: SampledCycle, both: Array) -> Extreme:
    quantity, parts = both[: sampled.side.size], both[sampled.side.size :]
    return _greater(sampled.greatest(quantity, parts), sampled.greatest(-quantity, -parts))


def _greater(one: Extreme, other: Extreme) -> Extreme:
    best, rest = (one, other) if one.value >= other.value else (other, one)
    return Extreme(best.value, max(best.error, rest.value + rest.error - best.value), best.angle)


def friction_power(sampled: SampledCycle) -> tuple[float, float]:
    """Mean friction power [W] and its relative error."""
    piston, mechanism = sampled.cycle.scene.piston, sampled.cycle.scene.mechanism
    lever = 6.0 / piston.skirt_length
    most = float(np.abs(sampled.side).max() + lever * np.abs(sampled.moment + sampled.side * piston.clamp_offset).max())
    panels, (side, moment), left_out = _with_ripple(sampled, lever, most)
    couple = lever * (moment + side * piston.clamp_offset)
    first = panels.edges[0]
    steep = _steep(mechanism.crank_radius / mechanism.rod_length)
    crossed = [zeros(*panels, row) for row in (couple - side, couple + side)]
    corners = np.concatenate([_EIGHTHS, steep, *crossed])
    corners = first + np.mod(corners - first, TURN)
    ends = np.unique(np.concatenate([panels.edges, corners]))
    both = np.stack([side, moment])
    fine, coarse = (_mean(sampled.cycle.scene, panels, both, ends, rule) for rule in (_FINE, _COARSE))
    if not fine:
        return 0.0, 0.0
    # Relative to the greatest reactions all over the turn; the mean of |v| is two strokes a turn.
    bound = piston.friction_coefficient * (4.0 / math.pi) * most * 4.0 * mechanism.crank_radius * mechanism.speed
    couple = lever * (sampled.moment + sampled.side * piston.clamp_offset)
    missed = tail_errors(np.stack([sampled.side, couple]), sampled.panels.rule).sum(axis=0)
    mean_missed = float(missed @ np.diff(sampled.panels.edges)) / TURN / most if most else 0.0
    return fine, abs(fine - coarse) / fine + (mean_missed + left_out) * bound / fine


def _with_ripple(sampled: SampledCycle, lever: float, most: float) -> tuple[Panels, Array, float]:
    """T and M0 with as much of the ringing as their mean may notice, on panels that resolve it; and what the rest could
    do to that mean, relative to the greatest reactions ``most`` [N]."""
    ringing, offset = sampled.ringing, sampled.cycle.scene.piston.clamp_offset
    smooth, panels = np.stack([sampled.side, sampled.moment]), sampled.panels
    if not ringing.ripple.modes:
        return panels, smooth, 0.0
    couple = lever * (ringing.moment + offset * ringing.side)
    reach = (reaches(ringing.ripple, ringing.side) + reaches(ringing.ripple, couple)).max(axis=0) / most
    pace = ringing.ripple.pace.max(axis=0)
    # A mean notices where an oscillation begins anew, where the slope of its weight jumps, and the square of it.
    begins, turns = 2.0 * ringing.begins / TURN, _KINKS / TURN
    noticed = reach * np.minimum(begins / pace + turns / pace**2 + reach.sum(), 1.0)
    left = np.append(np.cumsum(noticed[::-1])[::-1], 0.0)
    modes = int(np.flatnonzero((left <= _NOTICED * sampled.tolerance) | (np.append(pace, np.inf) > _FASTEST))[0])
    if modes:
        widest = _RADIANS / pace[:modes].max()
        panels = Panels(split(panels.edges, widest), rule_of(_POINTS))
        angle = panels.angles_inside
        smooth = sampled.at(smooth, angle)
        smooth += ripple_at(ringing.ripple, modes, np.stack([ringing.side, ringing.moment]), angle)
    return panels, smooth, float(left[modes])


def _mean(scene: Scene, panels: Panels, both: Array, ends: Array, rule: tuple[Array, Array]) -> float:
    points, weights = rule
    half = 0.5 * np.diff(ends)
    angle = (0.5 * (ends[1:] + ends[:-1])[:, None] + half[:, None] * points).ravel()
    side, moment = values_at(*panels, both, angle)
    power = power_at(scene, angle, side, moment)
    return float(half @ (power.reshape(half.size, -1) @ weights)) / TURN


def _steep(ratio: float) -> Array:
    """Angles graded toward the quarters of the turn, where v changes over a width of sqrt(1 - lambda^2)."""
    width = math.sqrt((1.0 - ratio) * (1.0 + ratio))
    if width > _WIDE:
        return np.empty(0)
    steps = math.ceil(2.0 * math.asinh(0.25 * TURN / width))
    away = width * np.sinh(0.5 * np.arange(-steps, steps + 1))
    return np.concatenate([0.25 * TURN + away, 0.75 * TURN + away])
