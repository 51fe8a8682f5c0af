"""Crank angles of the influence estimates: equally spaced ones, and those where the load is sharp."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.arrays import Array, Index
from solvers.numerics.periodic import TURN, grid
from solvers.rod.load.axial_force import Drive, axial_forces
from solvers.rod.load.gas import sharpest
from solvers.rod.scene import Load

_MAX_PIECES_SAMPLED_INSIDE, _MAX_PIECES_WITH_ENDS = 32, 256
"""Number of pieces of a load up to which each is also sampled inside, and up to which all ends of pieces are
included."""

_MIN_SEPARATION = 1e-6


class SharpAngles(NamedTuple):
    """Crank angles [rad] at the ends of the load's pieces, and inside the pieces."""

    ends: Array
    inside: Array


class Sampling(NamedTuple):
    """Crank angles [rad], the first ``uniform`` of them equally spaced; the indices that sort them; their quadrature
    weights as fractions of a revolution; whether a piece of the load ends there."""

    angle: Array
    uniform: int
    order: Index
    weight: Array
    ends: NDArray[np.bool_]


@lru_cache(maxsize=8)
def uniform_angles(count: int) -> Sampling:
    """Return ``count`` equally spaced angles only."""
    return Sampling(grid(count), count, np.arange(count), np.full(count, 1.0 / count), np.zeros(count, bool))


def with_sharp_angles(count: int, sharp: SharpAngles) -> Sampling:
    """Return ``count`` equally spaced angles, followed by the sharp ones."""
    step, candidates = TURN / count, np.concatenate(sharp)
    separate = np.abs(np.mod(candidates + 0.5 * step, step) - 0.5 * step) > _MIN_SEPARATION
    angle = np.concatenate([grid(count), candidates[separate]])
    ends = np.zeros(count + np.count_nonzero(separate), bool)
    is_end = np.arange(candidates.size) < sharp.ends.size
    ends[count:] = is_end[separate]
    ends[np.rint(candidates[is_end & ~separate] / step).astype(int) % count] = True
    order = np.argsort(angle)
    rising, width = angle[order], np.empty(order.size)
    width[order] = 0.5 * (np.append(rising[1:], rising[0] + TURN) - np.append(rising[-1] - TURN, rising[:-1]))
    return Sampling(angle, count, order, width / TURN, ends)


def sharp_angles(load: Load, drive: Drive) -> SharpAngles:
    """Return the angles [rad] where the load is sharp: ends of its pieces, with three inside each if they are few."""
    ends, none = np.unique(np.mod(load.sharp_angles(), TURN)), np.empty(0)
    if ends.size > _MAX_PIECES_WITH_ENDS:
        ends = sharpest(ends, axial_forces(drive, ends), _MAX_PIECES_WITH_ENDS)
    if not 0 < ends.size <= _MAX_PIECES_SAMPLED_INSIDE:
        return SharpAngles(ends, none)
    width = np.diff(ends, append=ends[0] + TURN)
    return SharpAngles(ends, np.mod((ends[:, None] + width[:, None] * np.arange(1, 4) / 4).ravel(), TURN))
