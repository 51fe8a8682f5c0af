"""One revolution of a strip without shape corrections, on panels that resolve it.

Panels end at the ends of the load's pieces and where contact switches between one and both walls (``state``); they are
bisected until axial force, side force, clamp moment and the bending at head and midspan are resolved. Extrema, zeros
and means are then those of polynomials (``solvers.numerics.panels``).
"""

from __future__ import annotations

import math

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.panels import Rule, extremes, largest, panel_error, rule_of
from solvers.numerics.periodic import TURN
from solvers.rod.cycle.state import CLAMP, FORCE, HEAD, MOMENT, ROWS, SIDE, Strip, friction_corners, states_of
from solvers.rod.load.axial_force import Drive
from solvers.rod.scene import Load

MAX_PANELS = 6000
ROUNDING = 1e-14
"""Relative rounding error of what is sampled."""
RESOLVED_ROWS = 5
"""Number of rows that panels must resolve (``resolved_rows``)."""
_MAX_WIDTH = TURN / 4
_MIN_SEPARATION, _MIN_WIDTH = 1e-9, 1e-9
"""Minimum separation of breaks [rad], below which they are merged; minimum panel width, below which rounding
dominates."""
_POINTS = ((1e-4, 8), (1e-9, 16), (0.0, 20))
"""Points per panel for a load of few pieces, each with the accuracy down to which it applies. ``_SOME`` and ``_MANY``:
numbers of pieces above which a load has some or very many pieces, and the points per panel then."""
_SOME, _MANY = (24, 8), (256, 6)


def rule_for(load: Load, accuracy: float, vibrates: bool = False) -> Rule:
    """The panel rule for a load and an accuracy of the results.

    ``vibrates``: the strip vibrates, which needs more points per panel than a load of very many pieces itself.
    """
    pieces = max(load.curve.breaks.size - 1, load.sharp_angles().size)
    if pieces > _SOME[0]:
        return rule_of((_MANY if pieces > _MANY[0] and not vibrates else _SOME)[1])
    return rule_of(next(points for least, points in _POINTS if accuracy >= least))


@kernel
def first_edges(drive: Drive, strip: Strip, sharp: Array) -> Array:
    """Panel ends over one revolution: ends of the load's pieces and sharp angles, the corners due to friction, and
    enough in between that no panel exceeds a quarter of a revolution."""
    breaks = (drive.curve.breaks if drive.curve.breaks.size > 0 else sharp) % TURN
    if strip.friction != 0.0:
        corners = friction_corners(drive, strip, breaks)
        breaks = np.concatenate((breaks, corners % TURN))
    return panel_edges(breaks)


@kernel
def panel_edges(breaks: Array) -> Array:
    """Panel ends over one revolution: the breaks, in [0, 2 pi), and enough in between."""
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
def resolved_rows(states: Array) -> Array:
    """Axial force, side force, clamp moment, and the bending at head and midspan, each added to that at the clamp;
    otherwise a strip as long as its rod would have a row of zeros."""
    rows = np.empty((RESOLVED_ROWS, states.shape[1]))
    for j in range(states.shape[1]):
        rows[0, j], rows[1, j], rows[2, j] = states[FORCE, j], states[SIDE, j], states[MOMENT, j]
        rows[3, j], rows[4, j] = states[CLAMP, j] + states[HEAD, j], states[CLAMP, j]
    return rows


@kernel
def _states_on(drive: Drive, strip: Strip, left: float, right: float, rule: Rule, scale: Array) -> Array:
    """The states at a panel's points; ``scale`` is updated with the maximum magnitudes of the resolved rows."""
    angle = 0.5 * (left + right) + 0.5 * (right - left) * rule.points
    states = states_of(drive, strip, angle)
    rows = resolved_rows(states)
    for row in range(rows.shape[0]):
        scale[row] = max(scale[row], largest(rows[row]))
    return states


@kernel
def sample(
    drive: Drive, strip: Strip, critical: float, initial: Array, rule: Rule, tolerance: float, resolved_count: int
) -> tuple[Array, Array]:
    """Return the edges of panels that resolve the revolution to ``tolerance`` relative to the maximum of the first
    ``resolved_count`` of ``resolved_rows``, at most ``MAX_PANELS``, refined from edges ``initial``; and the states at
    their points.

    No edges are returned if the strip buckles at one of the sampled points. Close to P_cr = ``critical`` [N] rounding
    errors are amplified by 1/(1 - P/P_cr), in the forces as well with friction; smaller errors cannot be resolved.
    """
    n, scale, least = rule.points.size, np.zeros(RESOLVED_ROWS), 0.0
    least_force = -strip.critical if strip.couples != 0.0 else -np.inf
    stack = [(0.0, 0.0, np.empty((ROWS, n))) for _ in range(0)]
    for p in range(initial.size - 2, -1, -1):
        left, right = initial[p], initial[p + 1]
        states = _states_on(drive, strip, left, right, rule, scale)
        stack.append((left, right, states))
        least = min(least, extremes(states[FORCE])[1])
    edges, resolved = [initial[0]], [np.empty((ROWS, n)) for _ in range(0)]
    while len(stack) > 0:
        left, right, states = stack.pop()
        if extremes(states[FORCE])[1] <= least_force:
            return np.empty(0), np.empty((ROWS, 0))
        bisect = False
        if right - left > _MIN_WIDTH and len(resolved) + len(stack) + 2 <= MAX_PANELS:
            least, rows = min(least, extremes(states[FORCE])[1]), resolved_rows(states)
            rounding = ROUNDING / max(1.0 + least / critical, ROUNDING)
            for row in range(resolved_count):
                resolvable = max(tolerance, rounding if row > 0 or strip.friction != 0.0 else ROUNDING)
                bisect = bisect or panel_error(rows[row], rule) > resolvable * max(scale[row], 1e-300)
        if bisect:
            middle = 0.5 * (left + right)
            stack.append((middle, right, _states_on(drive, strip, middle, right, rule, scale)))
            stack.append((left, middle, _states_on(drive, strip, left, middle, rule, scale)))
        else:
            edges.append(right)
            resolved.append(states)
    out = np.empty((ROWS, len(resolved) * n))
    for p in range(len(resolved)):
        for row in range(ROWS):
            for j in range(n):
                out[row, p * n + j] = resolved[p][row, j]
    return np.array(edges), out
