"""The least cost of strips of one frequency ratio, from rows that are linear in ln b, ln h, ln l.

At most two directions leave ln Omega as it is. Cost and penalty are convex in them, piecewise linear: a grid closes in
on the least, with no more arithmetic than a general method's bookkeeping takes, and it cannot fail.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.rod.optimum.local_search import PENALTY
from solvers.rod.optimum.sqp import Program

Array = NDArray[np.float64]

_GRID, _ZOOMS, _CLOSER = np.linspace(-1.0, 1.0, 13), 12, 0.5
"""In each direction; so many times, each about the least of the one before and smaller by so much."""
_WALL = 100.0
"""The penalty for sizes out of bounds: what rows change by is less."""


@dataclass(frozen=True)
class AtRatio:
    """A programme at a given change of ln Omega, to first order: ``up`` (3,) is the least step for a unit of it, and
    ``within`` (up to 2, 3) are the directions that leave it alone."""

    program: Program
    box: Array
    up: Array
    within: Array

    @staticmethod
    def of(p: Program, box: Array, slope: Array) -> AtRatio | None:
        """Within bounds (3, 2) of ln(b, h, l), from the slope of ln Omega; None where no size changes it."""
        free = box[:, 1] > box[:, 0]
        slope = np.where(free, slope, 0.0)
        square = float(slope @ slope)
        if square == 0.0:
            return None
        axes = np.eye(3)[free]
        _, lengths, directions = np.linalg.svd(axes - np.outer(axes @ slope, slope) / square)
        return AtRatio(p, box, slope / square, directions[: np.count_nonzero(lengths > 1e-9)])

    def __call__(self, here: Array, slopes: Array, x: Array, change: float, reach: float) -> tuple[Array, float]:
        """Where the cost is least for a change of ln Omega from x, of rows ``here`` with ``slopes`` (rows, 3), and what
        it is there with the penalty for limits that are missed."""
        start, centre, wide = x + change * self.up, np.zeros(len(self.within)), reach
        for _ in range(_ZOOMS):
            grid = np.meshgrid(*[wide * _GRID] * centre.size, indexing="ij")
            places = centre + np.stack(grid, axis=-1).reshape(-1, centre.size) if centre.size else centre[None]
            at = start + places @ self.within
            costs = self._costs(here, slopes, at - x) + _WALL * self._outside(at)
            n = int(np.argmin(costs))
            centre, wide = places[n], _CLOSER * wide
        return np.clip(at[n], self.box[:, 0], self.box[:, 1]), float(costs[n])

    def _costs(self, here: Array, slopes: Array, steps: Array) -> Array:
        """Cost and penalty of steps (count, 3)."""
        p = self.program
        cost = sum((weight * (here[row] + steps @ slopes[row]) for row, weight in p.linear), np.zeros(len(steps)))
        if p.top.size:
            cost = cost + p.top_weight * np.max(here[p.top] - p.offset + steps @ slopes[p.top].T, axis=1)
        if p.which.size:
            missed = np.max(here[p.which] - p.limit + steps @ slopes[p.which].T, axis=1)
            cost = cost + PENALTY * np.maximum(missed, 0.0)
        return cost

    def _outside(self, at: Array) -> Array:
        """The greatest distance from the bounds, (count,)."""
        return np.maximum(np.max(np.maximum(self.box[:, 0] - at, at - self.box[:, 1]), axis=1), 0.0)
