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
from solvers.rod.cycle.state import CLAMP, FORCE, HEAD, MOMENT, ROWS, SIDE, Strip, fill_states, friction_corners
from solvers.rod.load.axial_force import Drive
from solvers.rod.piston.skirt import both_walls

Array = NDArray[np.float64]

TURN = 2.0 * math.pi
_GRID = TURN / 128 * np.arange(129)
_WIDEST = TURN / 4
_APART, _NARROWEST = 1e-9, 1e-9
MOST_PANELS = 24
"""As many as have sixteen points each in a single check."""
_CHECKED = 5
_EIGHTHS = 0.125 * TURN * np.arange(8)


@kernel
def _in_turn(angle: Array) -> Array:
    """Different angles in [0, 2 pi), rising."""
    out = np.empty(angle.size)
    for i in range(angle.size):
        out[i] = angle[i] % TURN
    return np.unique(out)


@kernel
def panel_edges(drive: Drive, strip: Strip, sharp: Array) -> Array:
    """See ``cycle.sampled.panel_edges``."""
    breaks = _in_turn(drive.breaks if drive.breaks.size > 0 else sharp)
    if strip.friction != 0.0:
        corners = friction_corners(drive, strip, np.unique(np.concatenate((_GRID, breaks))))
        breaks = np.unique(np.concatenate((breaks, _in_turn(corners))))
    if breaks.size == 0:
        return _WIDEST * np.arange(5)
    edges = [0.0 for _ in range(0)]
    for i in range(breaks.size):
        if breaks[i] - (breaks[i - 1] if i > 0 else breaks[breaks.size - 1] - TURN) > _APART:
            edges.append(breaks[i])
    edges.append(edges[0] + TURN)
    out = [0.0 for _ in range(0)]
    for i in range(len(edges) - 1):
        width = edges[i + 1] - edges[i]
        parts = max(math.ceil(width / _WIDEST * (1.0 - 1e-9)), 1)
        for k in range(parts):
            out.append(k * (width / parts) + edges[i])
    out.append(edges[len(edges) - 1])
    return np.array(out)


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
    edges, scale = first.copy(), np.zeros(_CHECKED)
    states = np.empty((ROWS, (edges.size - 1) * n))
    if edges.size - 1 > MOST_PANELS:
        return np.empty(0), states
    fresh = np.ones(edges.size - 1, dtype=np.bool_)
    while True:
        count = edges.size - 1
        level = int(fresh.sum())
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
def top_of(edges: Array, rule: Rule, quantity: Array, sign: float, tolerance: float) -> tuple[float, float]:
    """The greatest value over the turn of a quantity with this sign, and an estimate of its absolute error."""
    value, error, _ = greatest(edges, rule, quantity, sign, tolerance * np.abs(quantity).max())
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
def friction_power(
    drive: Drive, strip: Strip, edges: Array, rule: Rule, states: Array, coefficient: float, fine: Array, coarse: Array
) -> tuple[float, float]:
    """Mean friction power [W] and its relative error: see ``cycle.guide_loads.friction_power``."""
    side, moment = states[SIDE], states[MOMENT]
    couple = strip.lever * (moment + side * strip.offset)
    most = np.abs(side).max() + np.abs(couple).max()
    crossed, other = zeros(edges, rule, couple - side), zeros(edges, rule, couple + side)
    corners = np.concatenate((_EIGHTHS, crossed, other))
    for i in range(corners.size):
        corners[i] = edges[0] + (corners[i] - edges[0]) % TURN
    ends = np.unique(np.concatenate((edges, corners)))
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
