"""Crank angles of the influence estimates: uniform ones, and those where the load is sharp."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.periodic import TURN, grid
from solvers.rod.load.axial_force import Drive, axial_forces
from solvers.rod.load.gas import sharpest
from solvers.rod.scene import Load

Array = NDArray[np.float64]

_MAX_SAMPLED_INSIDE, _MAX_WITH_ENDS = 32, 256
"""Number of pieces of a load up to which each is also sampled inside, and up to which all their ends are included."""

_MIN_SEPARATION = 1e-6


class Sharp(NamedTuple):
    """Crank angles [rad] of the ends of the load's pieces, and inside them."""

    ends: Array
    inside: Array


class Sampling(NamedTuple):
    """Crank angles [rad], the first ``even`` of them uniform; indices that sort them; their quadrature weights as
    fractions of a revolution; whether a piece of the load ends there."""

    angle: Array
    even: int
    order: NDArray[np.intp]
    share: Array
    ends: NDArray[np.bool_]


@lru_cache(maxsize=8)
def even_angles(even: int) -> Sampling:
    """``even`` uniform angles only."""
    return Sampling(grid(even), even, np.arange(even), np.full(even, 1.0 / even), np.zeros(even, bool))


def with_sharp(even: int, sharp: Sharp) -> Sampling:
    """``even`` uniform angles, followed by the sharp ones."""
    step, added = TURN / even, np.concatenate(sharp)
    apart = np.abs(np.mod(added + 0.5 * step, step) - 0.5 * step) > _MIN_SEPARATION
    angle, ends = np.concatenate([grid(even), added[apart]]), np.zeros(even + np.count_nonzero(apart), bool)
    is_end = np.arange(added.size) < sharp.ends.size
    ends[even:] = is_end[apart]
    ends[np.rint(added[is_end & ~apart] / step).astype(int) % even] = True
    order = np.argsort(angle)
    rising, width = angle[order], np.empty(order.size)
    width[order] = 0.5 * (np.append(rising[1:], rising[0] + TURN) - np.append(rising[-1] - TURN, rising[:-1]))
    return Sampling(angle, even, order, width / TURN, ends)


def sharp_angles(load: Load, drive: Drive) -> Sharp:
    """Angles [rad] where the load is sharp: the ends of its pieces, with three inside each if there are few."""
    ends, none = np.unique(np.mod(load.sharp_angles(), TURN)), np.empty(0)
    if ends.size > _MAX_WITH_ENDS:
        ends = sharpest(ends, axial_forces(drive, ends), _MAX_WITH_ENDS)
    if not 0 < ends.size <= _MAX_SAMPLED_INSIDE:
        return Sharp(ends, none)
    width = np.diff(ends, append=ends[0] + TURN)
    return Sharp(ends, np.mod((ends[:, None] + width[:, None] * np.arange(1, 4) / 4).ravel(), TURN))
