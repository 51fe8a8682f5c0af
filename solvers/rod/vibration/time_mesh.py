"""The turn cut into elements: between the corners of the axial force, and narrow enough for polynomials and modes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.panels import resolve, rule_of
from solvers.numerics.radau import Radau
from solvers.rod.cycle.state import FORCE, ROWS, Strip, fill_states, friction_corners
from solvers.rod.load.axial_force import Drive

Array = NDArray[np.float64]

TURN = 2.0 * math.pi
WIDEST = TURN / 16
_GRID = TURN / 128 * np.arange(129)
_APART = 1e-9
"""Corners closer than this [rad] are one."""


def corners(drive: Drive, strip: Strip) -> Array:
    """Angles [rad] in [0, 2 pi) at which a derivative of the axial force jumps, rising: where the load's pieces end, and
    where the piston begins or ceases to bear on both walls if friction acts back."""
    found = drive.breaks
    if strip.friction:
        places = np.unique(np.concatenate([_GRID, np.mod(found, TURN)]))
        found = np.concatenate([found, friction_corners(drive, strip, places)])
    found = np.unique(np.mod(found, TURN))
    return found[np.diff(found, prepend=found[-1:] - TURN) > _APART]


def pieces(drive: Drive, strip: Strip, ends: Array, sharp: Array, points: int, wanted: float, most: int) -> Array:
    """Ends of elements over one turn from the first of ``ends`` on, which are among them, each so narrow that a
    polynomial with so many points follows the axial force to ``wanted`` of its greatest, as far as ``most`` go."""

    def force(angle: Array) -> Array:
        states = np.empty((ROWS, angle.size))
        fill_states(drive, strip, angle, states)
        return states[FORCE : FORCE + 1]

    first = ends[0] if ends.size else 0.0
    sharp = first + np.mod(sharp - first, TURN)
    edges = np.unique(np.concatenate([ends, sharp, [first, first + TURN]]))
    edges = edges[np.diff(edges, prepend=-np.inf) > _APART]
    edges[-1] = first + TURN
    panels, _, _ = resolve(force, split(edges, WIDEST), rule_of(points), 1, wanted, most)
    return panels.edges


def split(edges: Array, widest: Array | float) -> Array:
    """The same edges, and more evenly between them so that no element is wider than ``widest``, which may differ
    between the elements there were."""
    parts = np.maximum(np.ceil(np.diff(edges) / widest * (1.0 - 1e-9)), 1.0).astype(int)
    first = np.repeat(np.cumsum(parts) - parts, parts)
    inner = (np.arange(first.size) - first) / np.repeat(parts, parts)
    return np.append(np.repeat(edges[:-1], parts) + inner * np.repeat(np.diff(edges), parts), edges[-1])


def points(edges: Array, rule: Radau) -> Array:
    """Angles of all elements' points, one element after the other."""
    return (edges[:-1, None] + np.diff(edges)[:, None] * rule.points).ravel()
