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
from solvers.numerics.panels import Rule, copy_panels, extremes, panels_to_halve, points_on, rule_of
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
_MIN_SEPARATION = 1e-9
"""Minimum separation of breaks [rad], below which they are merged."""
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
def sample(
    drive: Drive, strip: Strip, critical: float, initial: Array, rule: Rule, tolerance: float, resolved_count: int
) -> tuple[Array, Array]:
    """Return the edges of panels that resolve the revolution to ``tolerance`` relative to the maximum of the first
    ``resolved_count`` of ``resolved_rows``, at most ``MAX_PANELS``, refined from edges ``initial``; and the states at
    their points.

    No edges are returned if the strip buckles at one of the sampled points. Close to P_cr = ``critical`` [N] rounding
    errors are amplified by 1/(1 - P/P_cr); smaller errors cannot be resolved.
    """
    left, right, starts = initial[:-1].copy(), initial[1:].copy(), [0.0 for _ in range(0)]
    batches = [(left, np.zeros(0, np.bool_), np.empty((ROWS, 0))) for _ in range(0)]
    scale, least, least_force = np.full(resolved_count, 1e-300), 0.0, -strip.critical if strip.couples else -np.inf
    while left.size > 0:
        states = states_of(drive, strip, points_on(left, right, rule))
        least = min(least, extremes(states[FORCE])[1])
        if least <= least_force:
            return np.empty(0), np.empty((ROWS, 0))
        resolvable = max(tolerance, ROUNDING / max(1.0 + least / critical, ROUNDING))
        most = MAX_PANELS - len(starts)
        halved, _, lefts, rights = panels_to_halve(resolved_rows(states), left, right, rule, scale, resolvable, most)
        batches.append((left, halved, states))
        for p in range(left.size):
            if not halved[p]:
                starts.append(left[p])
        left, right = lefts, rights
    ordered = np.sort(np.array(starts))
    edges = np.empty(ordered.size + 1)
    for p in range(ordered.size):
        edges[p] = ordered[p]
    edges[ordered.size] = initial[-1]
    out = np.empty((ROWS, ordered.size * rule.points.size))
    for starts_of_batch, halved, states in batches:
        copy_panels(states, starts_of_batch, halved, ordered, out)
    return edges, out
