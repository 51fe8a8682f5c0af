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


class Sampling(NamedTuple):
    """Crank angles [rad], the first ``even`` of them uniform; indices that sort them; their quadrature weights as
    fractions of a revolution."""

    angle: Array
    even: int
    order: NDArray[np.intp]
    share: Array


@lru_cache(maxsize=8)
def even_angles(even: int) -> Sampling:
    """``even`` uniform angles only."""
    return Sampling(grid(even), even, np.arange(even), np.full(even, 1.0 / even))


def with_sharp(even: int, sharp: Array) -> Sampling:
    """``even`` uniform angles, followed by the sharp ones."""
    step = TURN / even
    beside = np.mod(sharp + 0.5 * step, step) - 0.5 * step
    angle = np.concatenate([grid(even), sharp[np.abs(beside) > _MIN_SEPARATION]])
    order = np.argsort(angle)
    rising, width = angle[order], np.empty(order.size)
    width[order] = 0.5 * (np.append(rising[1:], rising[0] + TURN) - np.append(rising[-1] - TURN, rising[:-1]))
    return Sampling(angle, even, order, width / TURN)


def sharp_angles(load: Load, drive: Drive) -> Array:
    """Angles [rad] where the load is sharp, with three inside each piece if there are few."""
    sharp = load.sharp_angles()
    if not sharp.size:
        return sharp
    ends = np.unique(np.mod(sharp, TURN))
    if ends.size > _MAX_WITH_ENDS:
        ends = sharpest(ends, axial_forces(drive, ends), _MAX_WITH_ENDS)
    if ends.size > _MAX_SAMPLED_INSIDE:
        return ends
    width = np.diff(ends, append=ends[0] + TURN)
    return np.mod((ends[:, None] + width[:, None] * np.arange(4) / 4).ravel(), TURN)
