"""One revolution of a strip without shape corrections, on panels that resolve it.

Panels end at the ends of the load's pieces and where contact switches between one and both walls (``state``); they are
bisected until axial force, side force, clamp moment and the bending at head and midspan are resolved. Extrema, zeros
and means are then those of polynomials (``solvers.numerics.panels``).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.numerics.panels import Rule, largest, panel_error, rule_of
from solvers.rod.cycle.state import CLAMP, FORCE, HEAD, MOMENT, ROWS, SIDE, Strip, fill_states, friction_corners
from solvers.rod.load.axial_force import Drive
from solvers.rod.scene import Load

Array = NDArray[np.float64]

TURN = 2.0 * math.pi
MOST_PANELS = 6000
CHECKED = 5
"""Number of rows that panels must resolve (``_checked``)."""
_GRID = TURN / 128 * np.arange(129)
_MAX_WIDTH = TURN / 4
_MIN_SEPARATION, _MIN_WIDTH = 1e-9, 1e-9
"""Minimum separation of breaks [rad], below which they are merged; minimum panel width, below which rounding
dominates."""
_POINTS = ((1e-4, 8), (1e-9, 16), (0.0, 20))
"""Points per panel for a load of few pieces, each with the accuracy down to which it applies. ``_SOME`` and ``_MANY``:
number of pieces above which a load counts as having some or very many pieces, and the points per panel then."""
_SOME, _MANY = (24, 8), (256, 6)


def rule_for(load: Load, accuracy: float, rings: bool = False) -> Rule:
    """The rule of the panels for a load and an accuracy of the results.

    ``rings``: the strip vibrates, which needs more points than a load of very many pieces itself.
    """
    pieces = max(load.curve().breaks.size - 1, load.sharp_angles().size)
    if pieces > _SOME[0]:
        return rule_of((_MANY if pieces > _MANY[0] and not rings else _SOME)[1])
    return rule_of(next(points for least, points in _POINTS if accuracy >= least))


@kernel
def first_edges(drive: Drive, strip: Strip, sharp: Array) -> Array:
    """Panel ends over one revolution: ends of the load's pieces and sharp angles, the corners due to friction, and
    enough in between that no panel exceeds a quarter of a revolution."""
    breaks = _within_turn(drive.breaks if drive.breaks.size > 0 else sharp)
    if strip.friction != 0.0:
        corners = friction_corners(drive, strip, np.sort(np.concatenate((_GRID, breaks))))
        breaks = np.concatenate((breaks, _within_turn(corners)))
    breaks, ends = np.sort(breaks), [0.0 for _ in range(0)]
    for i in range(breaks.size):
        if breaks[i] - (breaks[i - 1] if i > 0 else breaks[breaks.size - 1] - TURN) > _MIN_SEPARATION:
            ends.append(breaks[i])
    if len(ends) == 0:
        ends.append(0.0)
    ends.append(ends[0] + TURN)
    out = [ends[0]]
    for i in range(1, len(ends)):
        parts = max(math.ceil((ends[i] - ends[i - 1]) / _MAX_WIDTH * (1.0 - 1e-9)), 1)
        for k in range(1, parts):
            out.append(ends[i - 1] + k / parts * (ends[i] - ends[i - 1]))
        out.append(ends[i])
    return np.array(out)


@kernel
def _within_turn(angle: Array) -> Array:
    """The angles modulo one revolution."""
    out = np.empty(angle.size)
    for i in range(angle.size):
        out[i] = angle[i] % TURN
    return out


@kernel
def _checked(states: Array) -> Array:
    """Axial force, side force, clamp moment, and the bending at head and midspan, each added to that at the clamp
    (without this, a strip as long as its rod would have a row of zeros)."""
    rows = np.empty((CHECKED, states.shape[1]))
    for j in range(states.shape[1]):
        rows[0, j], rows[1, j], rows[2, j] = states[FORCE, j], states[SIDE, j], states[MOMENT, j]
        rows[3, j], rows[4, j] = states[CLAMP, j] + states[HEAD, j], states[CLAMP, j]
    return rows


@kernel
def _states_on(drive: Drive, strip: Strip, left: float, right: float, rule: Rule, scale: Array) -> Array:
    """The states at a panel's points; ``scale`` is updated with the magnitudes of the checked rows."""
    angle = 0.5 * (left + right) + 0.5 * (right - left) * rule.points
    states = np.empty((ROWS, angle.size))
    fill_states(drive, strip, angle, states)
    rows = _checked(states)
    for row in range(rows.shape[0]):
        scale[row] = max(scale[row], largest(rows[row]))
    return states


@kernel
def sample(drive: Drive, strip: Strip, first: Array, rule: Rule, tolerance: float) -> tuple[Array, Array]:
    """Edges of panels that resolve the revolution to ``tolerance`` relative to the maximum of every quantity, with at
    most ``MOST_PANELS``, refined from panels with the edges ``first``; and the states at their points.

    No edges if the strip buckles at one of the sampled points.
    """
    n, scale, least = rule.points.size, np.zeros(CHECKED), 0.5 * strip.buckled if strip.couples != 0.0 else -np.inf
    waiting = [(0.0, 0.0, np.empty((ROWS, n))) for _ in range(0)]
    for p in range(first.size - 2, -1, -1):
        waiting.append((first[p], first[p + 1], _states_on(drive, strip, first[p], first[p + 1], rule, scale)))
    edges, found = [first[0]], [np.empty((ROWS, n)) for _ in range(0)]
    while len(waiting) > 0:
        left, right, states = waiting.pop()
        if states[FORCE].min() <= least:
            return np.empty(0), np.empty((ROWS, 0))
        halve = False
        if right - left > _MIN_WIDTH and len(found) + len(waiting) + 2 <= MOST_PANELS:
            rows = _checked(states)
            for row in range(rows.shape[0]):
                halve = halve or panel_error(rows[row], rule) > tolerance * max(scale[row], 1e-300)
        if halve:
            middle = 0.5 * (left + right)
            waiting.append((middle, right, _states_on(drive, strip, middle, right, rule, scale)))
            waiting.append((left, middle, _states_on(drive, strip, left, middle, rule, scale)))
        else:
            edges.append(right)
            found.append(states)
    out = np.empty((ROWS, len(found) * n))
    for p in range(len(found)):
        for row in range(ROWS):
            for j in range(n):
                out[row, p * n + j] = found[p][row, j]
    return np.array(edges), out
