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

from solvers.rod.cycle.sampled import TURN, Extreme, SampledCycle
from solvers.rod.piston.friction import power_at
from solvers.rod.piston.skirt import pressure_per_load

Array = NDArray[np.float64]

_WIDE = 0.95
_FINE, _COARSE = legendre.leggauss(22), legendre.leggauss(16)
_EIGHTHS = 0.125 * TURN * np.arange(8)
"""The dead centres, and as many angles more as keep |v| close to a polynomial between them."""


def guide_loads(sampled: SampledCycle, contact: bool) -> tuple[Extreme, Extreme, Extreme | None]:
    """Greatest |T| [N], |M0| [N m] and, where asked for, contact pressure [Pa]."""
    piston, side, moment = sampled.cycle.scene.piston, sampled.side, sampled.moment
    greatest_side, greatest_moment = _magnitude(sampled, side), _magnitude(sampled, moment)
    if not contact:
        return greatest_side, greatest_moment, None
    couple = 6.0 / piston.skirt_length * (moment + side * piston.clamp_offset)
    sums = _greater(_magnitude(sampled, side + couple), _magnitude(sampled, side - couple))
    per_force = pressure_per_load(piston.diameter, piston.skirt_length)
    return greatest_side, greatest_moment, Extreme(sums.value * per_force, sums.error * per_force, sums.angle)


def _magnitude(sampled: SampledCycle, quantity: Array) -> Extreme:
    return _greater(sampled.greatest(quantity), sampled.greatest(-quantity))


def _greater(one: Extreme, other: Extreme) -> Extreme:
    best, rest = (one, other) if one.value >= other.value else (other, one)
    return Extreme(best.value, max(best.error, rest.value + rest.error - best.value), best.angle)


def friction_power(sampled: SampledCycle) -> tuple[float, float]:
    """Mean friction power [W] and its relative error."""
    piston, side, moment = sampled.cycle.scene.piston, sampled.side, sampled.moment
    couple = 6.0 / piston.skirt_length * (moment + side * piston.clamp_offset)
    first = sampled.panels.edges[0]
    mechanism = sampled.cycle.scene.mechanism
    steep = _steep(mechanism.crank_radius / mechanism.rod_length)
    corners = np.concatenate([_EIGHTHS, steep, sampled.zeros(couple - side), sampled.zeros(couple + side)])
    corners = first + np.mod(corners - first, TURN)
    ends = np.unique(np.concatenate([sampled.panels.edges, corners]))
    both = np.stack([side, moment])
    fine, coarse = (_mean(sampled, both, ends, rule) for rule in (_FINE, _COARSE))
    if not fine:
        return 0.0, 0.0
    # The panels' own error is that of the greatest reactions; the mean of |v| is two strokes a turn.
    most = float(np.abs(side).max() + np.abs(couple).max())
    bound = piston.friction_coefficient * (4.0 / math.pi) * most * 4.0 * mechanism.crank_radius * mechanism.speed
    return fine, abs(fine - coarse) / fine + sampled.error * bound / fine


def _mean(sampled: SampledCycle, both: Array, ends: Array, rule: tuple[Array, Array]) -> float:
    points, weights = rule
    half = 0.5 * np.diff(ends)
    angle = (0.5 * (ends[1:] + ends[:-1])[:, None] + half[:, None] * points).ravel()
    side, moment = sampled.at(both, angle)
    power = power_at(sampled.cycle.scene, angle, side, moment)
    return float(half @ (power.reshape(half.size, -1) @ weights)) / TURN


def _steep(ratio: float) -> Array:
    """Angles graded toward the quarters of the turn, where v changes over a width of sqrt(1 - lambda^2)."""
    width = math.sqrt((1.0 - ratio) * (1.0 + ratio))
    if width > _WIDE:
        return np.empty(0)
    steps = math.ceil(2.0 * math.asinh(0.25 * TURN / width))
    away = width * np.sinh(0.5 * np.arange(-steps, steps + 1))
    return np.concatenate([0.25 * TURN + away, 0.75 * TURN + away])
