"""One turn of a strip without corrections, sampled inside compiled code as ``cycle.sampled`` samples it.

The kernels that give states, extremes and zeros are those of the single check; here is what leads from one to the next.
Where a turn asks for more than a plain one - very many panels - it is left to the single check.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.numerics.panels import Rule, greatest, panel_error, tail_errors, zeros
from solvers.rod.cycle.state import CLAMP, FORCE, HEAD, MOMENT, ROWS, SIDE, Strip, fill_states
from solvers.rod.load.axial_force import Drive
from solvers.rod.piston.skirt import both_walls

Array = NDArray[np.float64]

TURN = 2.0 * math.pi
_NARROWEST = 1e-9
MOST_PANELS = 24
"""As many as have sixteen points each in a single check."""
_CHECKED = 5


@kernel
def _checked(states: Array) -> Array:
    """The rows that panels must resolve: see ``cycle.sampled``."""
    rows = np.empty((_CHECKED, states.shape[1]))
    for i in range(states.shape[1]):
        rows[0, i], rows[1, i], rows[2, i] = states[FORCE, i], states[SIDE, i], states[MOMENT, i]
        rows[3, i], rows[4, i] = states[CLAMP, i] + states[HEAD, i], states[CLAMP, i]
    return rows


@kernel
def sample(drive: Drive, strip: Strip, first: Array, rule: Rule, tolerance: float) -> tuple[Array, Array]:
    """The edges of panels that resolve the turn (``numerics.panels.resolve``), and the states at their points; no edges
    where it takes more panels than a plain turn has."""
    n = rule.points.size
    if first.size == 0:
        return np.empty(0), np.empty((ROWS, 0))
    edges, scale = first.copy(), np.zeros(_CHECKED)
    states = np.empty((ROWS, (edges.size - 1) * n))
    fresh = np.ones(edges.size - 1, dtype=np.bool_)
    while True:
        count = edges.size - 1
        level = 0
        for p in range(count):
            level += 1 if fresh[p] else 0
        angle, at = np.empty(level * n), 0
        for p in range(count):
            if fresh[p]:
                for j in range(n):
                    middle, half = 0.5 * (edges[p] + edges[p + 1]), 0.5 * (edges[p + 1] - edges[p])
                    angle[at * n + j] = middle + half * rule.points[j]
                at += 1
        own = np.empty((ROWS, level * n))
        fill_states(drive, strip, angle, own)
        at = 0
        for p in range(count):
            if fresh[p]:
                for row in range(ROWS):
                    for j in range(n):
                        states[row, p * n + j] = own[row, at * n + j]
                at += 1
        rows = _checked(own)
        for row in range(_CHECKED):
            for i in range(rows.shape[1]):
                scale[row] = max(scale[row], abs(rows[row, i]))
        halve, at, more = np.zeros(count, dtype=np.bool_), 0, 0
        for p in range(count):
            if not fresh[p]:
                continue
            if edges[p + 1] - edges[p] > _NARROWEST:
                for row in range(_CHECKED):
                    error = panel_error(rows[row, at * n : (at + 1) * n], rule)
                    if error > tolerance * max(scale[row], 1e-300):
                        halve[p] = True
                        break
            more += 1 if halve[p] else 0
            at += 1
        if more == 0:
            return edges, states
        if count + more > MOST_PANELS:
            return np.empty(0), states
        wider, table = np.empty(count + more + 1), np.empty((ROWS, (count + more) * n))
        marks, at = np.zeros(count + more, dtype=np.bool_), 0
        for p in range(count):
            wider[at] = edges[p]
            if halve[p]:
                wider[at + 1] = 0.5 * (edges[p] + edges[p + 1])
                marks[at], marks[at + 1] = True, True
                at += 2
                continue
            for row in range(ROWS):
                for j in range(n):
                    table[row, at * n + j] = states[row, p * n + j]
            at += 1
        wider[at] = edges[count]
        edges, states, fresh = wider, table, marks


@kernel
def _largest(quantity: Array) -> float:
    most = 0.0
    for i in range(quantity.size):
        most = max(most, abs(quantity[i]))
    return most


@kernel
def top_of(edges: Array, rule: Rule, quantity: Array, sign: float, tolerance: float) -> tuple[float, float]:
    """The greatest value over the turn of a quantity with this sign, and an estimate of its absolute error."""
    value, error, _ = greatest(edges, rule, quantity, sign, tolerance * _largest(quantity))
    return value, error


@kernel
def magnitude_of(edges: Array, rule: Rule, quantity: Array, tolerance: float) -> tuple[float, float]:
    """The greatest magnitude over the turn, and an estimate of its absolute error."""
    above, of_above = top_of(edges, rule, quantity, 1.0, tolerance)
    below, of_below = top_of(edges, rule, quantity, -1.0, tolerance)
    return greater(above, of_above, below, of_below)


@kernel
def greater(one: float, of_one: float, other: float, of_other: float) -> tuple[float, float]:
    """The greater of two values with its error, which the other's may reach beyond."""
    if one >= other:
        return one, max(of_one, other + of_other - one)
    return other, max(of_other, one + of_one - other)


@kernel
def couples_of(strip: Strip, states: Array) -> Array:
    """6 (M0 + T e)/Lp [N] at all angles."""
    out = np.empty(states.shape[1])
    for i in range(out.size):
        out[i] = strip.lever * (states[MOMENT, i] + states[SIDE, i] * strip.offset)
    return out


@kernel
def _both_at(edges: Array, rule: Rule, side: Array, moment: Array, angle: float) -> tuple[float, float]:
    """Side force and clamp moment at an angle: interpolants of their panel (``numerics.panels.interpolate``)."""
    n = rule.points.size
    p = min(max(np.searchsorted(edges, angle, side="right") - 1, 0), edges.size - 2)
    x = (2.0 * angle - edges[p] - edges[p + 1]) / (edges[p + 1] - edges[p])
    one, two, below = 0.0, 0.0, 0.0
    for j in range(n):
        apart = x - rule.points[j]
        if apart == 0.0:
            return side[p * n + j], moment[p * n + j]
        share = rule.weights[j] / apart
        below += share
        one += share * side[p * n + j]
        two += share * moment[p * n + j]
    return one / below, two / below


@kernel
def _mean_power(
    drive: Drive, strip: Strip, edges: Array, rule: Rule, side: Array, moment: Array, ends: Array, gauss: Array
) -> float:
    """Mean of int |q| ds |dx/dphi|/r [N] over the turn by Gauss' rule, points and weights (2, m), between ends."""
    ratio, total = drive.crank_radius / drive.rod_length, 0.0
    for k in range(ends.size - 1):
        half, middle, part = 0.5 * (ends[k + 1] - ends[k]), 0.5 * (ends[k + 1] + ends[k]), 0.0
        for j in range(gauss.shape[1]):
            angle = middle + half * gauss[0, j]
            t, m = _both_at(edges, rule, side, moment, angle)
            sine = math.sin(angle)
            lean = math.sqrt((1.0 - ratio * sine) * (1.0 + ratio * sine))
            wall = both_walls(abs(t), strip.lever * abs(m + t * strip.offset))
            part += gauss[1, j] * (wall * abs(sine * (1.0 + ratio * math.cos(angle) / lean)))
        total += half * part
    return total / TURN


@kernel
def _enter(ends: Array, count: int, angle: float) -> int:
    """Put an angle of the turn that begins with the first into its place among rising ones; how many there are."""
    angle = ends[0] + (angle - ends[0]) % TURN
    at = count
    while ends[at - 1] > angle:
        at -= 1
    if ends[at - 1] == angle:
        return count
    for k in range(count, at, -1):
        ends[k] = ends[k - 1]
    ends[at] = angle
    return count + 1


@kernel
def friction_power(
    drive: Drive, strip: Strip, edges: Array, rule: Rule, states: Array, coefficient: float, fine: Array, coarse: Array
) -> tuple[float, float]:
    """Mean friction power [W] and its relative error: see ``cycle.guide_loads.friction_power``."""
    side, moment = states[SIDE], states[MOMENT]
    couple = couples_of(strip, states)
    most = _largest(side) + _largest(couple)
    less, more = np.empty(side.size), np.empty(side.size)
    for i in range(side.size):
        less[i], more[i] = couple[i] - side[i], couple[i] + side[i]
    crossed, other = zeros(edges, rule, less), zeros(edges, rule, more)
    ends, count = np.empty(edges.size + crossed.size + other.size + 8), edges.size
    for p in range(edges.size):
        ends[p] = edges[p]
    for k in range(8):
        count = _enter(ends, count, 0.125 * TURN * k)
    for angle in crossed:
        count = _enter(ends, count, angle)
    for angle in other:
        count = _enter(ends, count, angle)
    ends = ends[:count]
    speed = drive.crank_radius * drive.angular_speed
    per_wall = coefficient * (4.0 / math.pi) * speed
    power = per_wall * _mean_power(drive, strip, edges, rule, side, moment, ends, fine)
    if power == 0.0:
        return 0.0, 0.0
    rough = per_wall * _mean_power(drive, strip, edges, rule, side, moment, ends, coarse)
    bound = coefficient * (4.0 / math.pi) * most * 4.0 * speed / TURN
    pair = np.empty((2, side.size))
    for i in range(side.size):
        pair[0, i], pair[1, i] = side[i], couple[i]
    tails, missed = tail_errors(pair, rule), 0.0
    for p in range(tails.shape[1]):
        missed += (tails[0, p] + tails[1, p]) * (edges[p + 1] - edges[p])
    return power, abs(power - rough) / power + missed / TURN / most * bound / power
