"""Lower bounds of the volume of steps over layers of cells, for a given multiplier or the best one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from solvers.numerics.arrays import Array
from solvers.pin.shapes.break_points.cells import Cells, points
from solvers.pin.shapes.break_points.half import Half
from solvers.pin.shapes.break_points.paths import Costs, Layers, backward, forward, maximise_dual, trace

_CALL, _STEP, _PAIR = 20_000, 10, 4
"""Work, in cost evaluations, of a call, of a wall that requires a minimisation, and of one that does not."""


@dataclass(frozen=True)
class DualBound:
    """The greatest dual bound ``value`` over layers of points, its multiplier, and the cheapest paths for multipliers
    just below and above it, (2, steps): break points, the last being 1, and walls."""

    multiplier: float
    value: float
    soft: Array
    stiff: Array
    work: int


@dataclass(frozen=True)
class PathBound:
    """Bound of layers of cells at one multiplier: ``total``, the cost of the cheapest path; ``each``, that of the
    cheapest path through every cell of every layer; ``path``, the break points of the former, the last being 1."""

    total: float
    each: list[Array]
    path: Array
    work: int


@dataclass(frozen=True)
class Bounds:
    """Bounds over all break points of a half, with one layer of cells per break point."""

    half: Half

    @cached_property
    def _ends(self) -> tuple[Cells, Cells]:
        """The end and the middle of the bar as cells of zero width."""
        return points(self.half, np.zeros(1)), points(self.half, np.ones(1))

    def points(self, places: list[Array]) -> list[Cells]:
        """Return one layer of points, cells of zero width, for each array of positions."""
        return points(self.half, np.concatenate(places)).split([t.size for t in places])

    def _layers(self, layers: list[Cells], least: Sequence[float], most: Array) -> tuple[Layers, Costs]:
        """Return the layers from end to middle, and arrays for their costs; equal steps share one array."""
        known: dict[tuple[int, float], Cells] = {}
        own = [self._ends[0]]
        for layer, low in zip([*layers, self._ends[1]], least, strict=True):
            own.append(known.setdefault((id(layer), low), layer.with_floor(low)))
        blocks: dict[tuple[int, int, float], int] = {}
        begins, size = [], 0
        for (before, after), top in zip(pairwise(own), most.tolist(), strict=True):
            key = id(before), id(after), top
            if key not in blocks:
                blocks[key] = size
                size += before.t.size * after.t.size
            begins.append(blocks[key])
        table = np.concatenate([layer.table for layer in own])
        starts = np.cumsum([0, *(layer.t.size for layer in own)])
        cost_to_come, cost_to_go = np.empty((2, len(table), 2))
        costs = Costs(np.empty((size, 2, 2)), cost_to_come, cost_to_go, np.empty((len(table), 2), dtype=np.int64))
        return Layers(table, starts, np.array(begins), most, self.half.program.law), costs

    def path_bound(self, layers: list[Cells], least: Sequence[float], most: Array, multiplier: float) -> PathBound:
        """Return the bound of all break points in the layers at one multiplier."""
        chain, costs = self._layers(layers, least, most)
        minimisations = forward(multiplier, chain, costs)
        backward(chain, costs)
        path = np.empty((2, most.size))
        trace(multiplier, chain, costs, path)
        each = np.split((costs.cost_to_come + costs.cost_to_go).min(axis=1), chain.starts[1:-1])[1:-1]
        work = _CALL + _STEP * minimisations + _PAIR * len(costs.step)
        return PathBound(float(costs.cost_to_come[-1, 0]), each, path[0], work)

    def dual_bound(
        self, layers: list[Cells], least: Sequence[float], most: Array, start: float, tolerance: float,
        target: float = math.inf,
    ) -> DualBound:  # fmt: skip
        """Maximise the bound over the multiplier (see ``maximise_dual``); the layers are points."""
        chain, costs = self._layers(layers, least, most)
        soft, stiff = np.empty((2, 2, most.size))
        multiplier, value, minimisations = maximise_dual(chain, costs, start, tolerance, target, soft, stiff)
        return DualBound(multiplier, value, soft, stiff, _CALL + _STEP * minimisations)
