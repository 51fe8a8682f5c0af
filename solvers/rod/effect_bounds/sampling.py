"""The crank angles at which the influences of effects look at a turn: even ones, and where the load is sharp."""

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

_FEW, _MANY = 32, 256
"""Pieces of a load up to which each is sampled inside as well, and up to which all of their ends are."""

_APART = 1e-6


class Sampling(NamedTuple):
    """Crank angles [rad], the first ``even`` of them even; indices that put them in rising order; each one's share of
    the turn."""

    angle: Array
    even: int
    order: NDArray[np.intp]
    share: Array


@lru_cache(maxsize=8)
def even_angles(even: int) -> Sampling:
    """So many even angles alone."""
    return Sampling(grid(even), even, np.arange(even), np.full(even, 1.0 / even))


def with_sharp(even: int, sharp: Array) -> Sampling:
    """So many even angles, and behind them the sharp ones."""
    step = TURN / even
    beside = np.mod(sharp + 0.5 * step, step) - 0.5 * step
    angle = np.concatenate([grid(even), sharp[np.abs(beside) > _APART]])
    order = np.argsort(angle)
    rising, width = angle[order], np.empty(order.size)
    width[order] = 0.5 * (np.append(rising[1:], rising[0] + TURN) - np.append(rising[-1] - TURN, rising[:-1]))
    return Sampling(angle, even, order, width / TURN)


def sharp_angles(load: Load, drive: Drive) -> Array:
    """Angles [rad] where the load is sharp, with three between the ends of each piece where there are few."""
    sharp = load.sharp_angles()
    if not sharp.size:
        return sharp
    ends = np.unique(np.mod(sharp, TURN))
    if ends.size > _MANY:
        ends = sharpest(ends, axial_forces(drive, ends), _MANY)
    if ends.size > _FEW:
        return ends
    width = np.diff(ends, append=ends[0] + TURN)
    return np.mod((ends[:, None] + width[:, None] * np.arange(4) / 4).ravel(), TURN)
