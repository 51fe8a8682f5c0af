"""Polynomials on elements of the turn: a cycle's force cut into smooth pieces, and values between their points."""

from __future__ import annotations

import math

import numpy as np

from solvers.numerics.jit import kernel
from solvers.numerics.periodic import TURN
from solvers.numerics.periodic_radau import nodes
from solvers.rod.cycle.composition import Array, Cycle

POINTS = np.concatenate([[0.0], nodes()])
"""Of an element: its first end and Radau's points, the last of which is its other end."""

WEIGHTS = 1.0 / np.prod(POINTS[:, None] - POINTS + np.eye(POINTS.size), axis=1)
"""Barycentric, after J.-P. Berrut, L. N. Trefethen (2004)."""


WIDEST = TURN / 16
_NARROWEST = 1e-7 * TURN
_MOST_PIECES = 2000
_BETWEEN = np.array([0.02, 0.3, 0.95])


def points(edges: Array, places: Array = POINTS) -> Array:
    """Angles of all elements' points, or other places, one element after the other."""
    return (edges[:-1, None] + np.diff(edges)[:, None] * places).ravel()


def interpolate(edges: Array, samples: Array, angle: Array) -> Array:
    """Every angle's element's polynomial there, shape (columns, angles), from (elements, points, columns)."""
    return _interpolate(edges, samples, POINTS, WEIGHTS, np.ascontiguousarray(angle))


@kernel
def _interpolate(edges: Array, samples: Array, points: Array, weights: Array, angle: Array) -> Array:
    basis = samples.shape[2]
    out, row = np.zeros((basis, angle.size)), np.empty(basis)
    for i in range(angle.size):
        turns = angle[i] / (2.0 * math.pi)
        place = (turns - math.floor(turns)) * (2.0 * math.pi)
        k = min(np.searchsorted(edges, place, side="right"), edges.size - 1) - 1
        share = (place - edges[k]) / (edges[k + 1] - edges[k])
        total = 0.0
        row[:] = 0.0
        for m in range(points.size):
            away = share - points[m]
            if away == 0.0:
                total = 1.0
                row[:] = samples[k, m]
                break
            weight = weights[m] / away
            total += weight
            for j in range(basis):
                row[j] += weight * samples[k, m, j]
        for j in range(basis):
            out[j, i] = row[j] / total
    return out


def split(edges: Array, wide: float) -> Array:
    """The same edges, and more between them so that no element is wider."""
    widths = np.diff(edges)
    parts = np.maximum(np.ceil(widths / wide * (1.0 - 1e-9)), 1.0).astype(int)
    first = np.repeat(np.cumsum(parts) - parts, parts)
    inner = (np.arange(first.size) - first) / np.repeat(parts, parts)
    return np.append(np.repeat(edges[:-1], parts) + inner * np.repeat(widths, parts), edges[-1])


def smooth_pieces(cycle: Cycle, wanted: float) -> Array:
    """Ends of pieces of the turn on which polynomials follow the axial force, or which no bisection improves."""
    corners = np.mod(cycle.corners(), TURN)
    corners = np.unique(np.concatenate([corners, [0.0, TURN]]))
    edges = split(corners[np.diff(corners, prepend=-1.0) > _NARROWEST], WIDEST)
    edges[-1] = TURN
    at, basis = np.concatenate([POINTS, _BETWEEN]), WEIGHTS / (_BETWEEN[:, None] - POINTS)
    basis /= basis.sum(axis=1, keepdims=True)
    left, right = edges[:-1], edges[1:]
    ends, largest = [edges], 0.0
    while left.size and sum(part.size for part in ends) < _MOST_PIECES:
        place = left[:, None] + (right - left)[:, None] * at
        force = cycle.axial_force(place.ravel()).reshape(place.shape)
        largest = max(largest, float(np.abs(force).max()))
        missed = np.abs(force[:, POINTS.size :] - force[:, : POINTS.size] @ basis.T).max(axis=1)
        rough = (missed > wanted * largest) & (right - left > 2.0 * _NARROWEST)
        left, right = left[rough], right[rough]
        middle = 0.5 * (left + right)
        ends.append(middle)
        left, right = np.concatenate([left, middle]), np.concatenate([middle, right])
    return np.unique(np.concatenate(ends))
