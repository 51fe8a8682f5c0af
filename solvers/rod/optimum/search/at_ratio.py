"""The minimum cost of strips of one frequency ratio, from rows that are linear in ln b, ln h, ln l.

At most two directions leave ln Omega unchanged. Cost and penalty are convex and piecewise linear in them, so that
successively finer grids converge to the minimum, with no more arithmetic than the overhead of a general method, and
without failures.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.rod.optimum.sqp import Program

_GRID, _ZOOMS, _CONTRACTION = np.linspace(-1.0, 1.0, 13), 12, 0.5
"""Points per direction, number of grids, and contraction of each grid about the minimum of the one before."""
PENALTY = 10.0
"""Weight of a violation against the cost. It is moderate because rows to first order may violate a limit that a search
from there satisfies."""
_BOUND_PENALTY = 100.0
"""Penalty for sizes out of bounds: larger than any change of the rows."""


@dataclass(frozen=True)
class AtRatio:
    """The programme at a given change of ln Omega, to first order: ``ratio_step`` (3,) is the shortest step per unit
    change, ``tangents`` (up to 2, 3) are the directions of constant ln Omega."""

    program: Program
    box: Array
    ratio_step: Array
    tangents: Array

    @staticmethod
    def of(p: Program, box: Array, slope: Array) -> AtRatio | None:
        """The programme within bounds ``box`` (3, 2) of ln(b, h, l), from the gradient ``slope`` of ln Omega; None if
        no free size changes Omega."""
        free = box[:, 1] > box[:, 0]
        slope = np.where(free, slope, 0.0)
        square = float(slope @ slope)
        if square == 0.0:
            return None
        axes = np.eye(3)[free]
        _, lengths, directions = np.linalg.svd(axes - np.outer(axes @ slope, slope) / square)
        return AtRatio(p, box, slope / square, directions[: np.count_nonzero(lengths > 1e-9)])

    def __call__(self, values: Array, slopes: Array, x: Array, change: float, radius: float) -> tuple[Array, float]:
        """Minimiser and minimum of the cost, with the penalty for violated limits, at a given change of ln Omega from
        x, for rows ``values`` with derivatives ``slopes`` (rows, 3), within ``radius`` along the tangents."""
        p, start = self.program, x + change * self.ratio_step
        rows = np.array([row for row, _ in p.linear], dtype=np.intp)
        weights = np.array([weight for _, weight in p.linear])
        linear, steps = slopes[rows], start - x
        cost = float(weights @ (values[rows] + linear @ steps))
        max_values = values[p.max_rows] - p.max_offset + slopes[p.max_rows] @ steps
        limited = values[p.limited] - p.limit + slopes[p.limited] @ steps
        directions = np.ascontiguousarray(self.tangents.T)
        minimiser, minimum = _minimise(
            cost, weights @ linear @ directions, p.max_weight, max_values, slopes[p.max_rows] @ directions, limited,
            slopes[p.limited] @ directions, start, directions, self.box, radius,
        )  # fmt: skip
        return np.clip(minimiser, self.box[:, 0], self.box[:, 1]), minimum


@kernel
def _minimise(
    cost: float, slopes: Array, top_weight: float, max_values: Array, top_slopes: Array, limited: Array,
    limited_slopes: Array, start: Array, directions: Array, box: Array, radius: float,
) -> tuple[Array, float]:  # fmt: skip
    """Minimiser start + directions y (3,) and minimum of cost + slopes y + top_weight max(max_values + top_slopes y),
    plus penalties for max(limited + limited_slopes y) > 0 and for points out of bounds."""
    free = directions.shape[1]
    centre, y, best, minimiser, point = np.zeros(free), np.zeros(free), np.zeros(free), start.copy(), np.empty(3)
    half_width, count, minimum = radius, _GRID.size**free, np.inf
    for _ in range(_ZOOMS):
        for n in range(count):
            index, value, bound_violation, violation, largest = n, cost, 0.0, 0.0, -np.inf
            for k in range(free - 1, -1, -1):
                y[k] = centre[k] + half_width * _GRID[index % _GRID.size]
                index //= _GRID.size
                value += slopes[k] * y[k]
            for v in range(3):
                point[v] = start[v]
                for k in range(free):
                    point[v] += directions[v, k] * y[k]
                bound_violation = max(bound_violation, max(box[v, 0] - point[v], point[v] - box[v, 1]))
            value += _BOUND_PENALTY * bound_violation
            # A point is abandoned as soon as its cost exceeds the minimum so far.
            for i in range(max_values.size):
                height = max_values[i]
                for k in range(free):
                    height += top_slopes[i, k] * y[k]
                largest = max(largest, height)
                if value + top_weight * largest >= minimum:
                    break
            value += top_weight * largest if max_values.size > 0 else 0.0
            if value >= minimum:
                continue
            for i in range(limited.size):
                excess = limited[i]
                for k in range(free):
                    excess += limited_slopes[i, k] * y[k]
                violation = max(violation, excess)
                if value + PENALTY * violation >= minimum:
                    break
            value += PENALTY * violation
            if value < minimum:
                minimum = value
                for k in range(free):
                    best[k] = y[k]
                for v in range(3):
                    minimiser[v] = point[v]
        for k in range(free):
            centre[k] = best[k]
        half_width *= _CONTRACTION
    return minimiser, minimum
