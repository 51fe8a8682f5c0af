"""The least cost of strips of one frequency ratio, from rows that are linear in ln b, ln h, ln l.

At most two directions leave ln Omega as it is. Cost and penalty are convex in them, piecewise linear: a grid closes in
on the least, with no more arithmetic than a general method's bookkeeping takes, and it cannot fail.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.rod.optimum.sqp import Program

Array = NDArray[np.float64]

_GRID, _ZOOMS, _CLOSER = np.linspace(-1.0, 1.0, 13), 12, 0.5
"""In each direction; so many times, each about the least of the one before and smaller by so much."""
PENALTY = 10.0
"""Of a violation against the cost. Rows to first order may miss a limit that a search from there meets: what is missed
is not to count for as much as where it is known."""
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
        p, start = self.program, x + change * self.up
        rows = np.array([row for row, _ in p.linear], dtype=np.intp)
        weights = np.array([weight for _, weight in p.linear])
        linear, steps = slopes[rows], start - x
        cost = float(weights @ (here[rows] + linear @ steps))
        top = here[p.max_rows] - p.max_offset + slopes[p.max_rows] @ steps
        limited = here[p.limited] - p.limit + slopes[p.limited] @ steps
        way = np.ascontiguousarray(self.within.T)
        at, least = _least(
            cost, weights @ linear @ way, p.max_weight, top, slopes[p.max_rows] @ way, limited, slopes[p.limited] @ way,
            start, way, self.box, reach,
        )  # fmt: skip
        return np.clip(at, self.box[:, 0], self.box[:, 1]), least


@kernel
def _least(
    cost: float, towards: Array, top_weight: float, top: Array, top_slopes: Array, limited: Array,
    limited_slopes: Array, start: Array, way: Array, box: Array, reach: float,
) -> tuple[Array, float]:  # fmt: skip
    """The place start + way y (3,), and its cost, of least cost + towards y + top_weight max(top + top_slopes y) with
    the penalties for max(limited + limited_slopes y) > 0 and for what lies out of bounds."""
    free = way.shape[1]
    centre, y, best, at, place = np.zeros(free), np.zeros(free), np.zeros(free), start.copy(), np.empty(3)
    wide, most, least = reach, _GRID.size**free, np.inf
    for _ in range(_ZOOMS):
        for n in range(most):
            rest, value, outside, missed, greatest = n, cost, 0.0, 0.0, -np.inf
            for k in range(free - 1, -1, -1):
                y[k] = centre[k] + wide * _GRID[rest % _GRID.size]
                rest //= _GRID.size
                value += towards[k] * y[k]
            for v in range(3):
                place[v] = start[v]
                for k in range(free):
                    place[v] += way[v, k] * y[k]
                outside = max(outside, max(box[v, 0] - place[v], place[v] - box[v, 1]))
            value += _WALL * outside
            # A place is left as soon as it is known to be dearer than the least so far.
            for i in range(top.size):
                height = top[i]
                for k in range(free):
                    height += top_slopes[i, k] * y[k]
                greatest = max(greatest, height)
                if value + top_weight * greatest >= least:
                    break
            value += top_weight * greatest if top.size > 0 else 0.0
            if value >= least:
                continue
            for i in range(limited.size):
                excess = limited[i]
                for k in range(free):
                    excess += limited_slopes[i, k] * y[k]
                missed = max(missed, excess)
                if value + PENALTY * missed >= least:
                    break
            value += PENALTY * missed
            if value < least:
                least = value
                for k in range(free):
                    best[k] = y[k]
                for v in range(3):
                    at[v] = place[v]
        for k in range(free):
            centre[k] = best[k]
        wide *= _CLOSER
    return at, least
