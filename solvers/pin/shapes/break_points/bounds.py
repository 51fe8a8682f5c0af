"""Bounds of the lightest steps over all break points in layers of cells, at one multiplier or at the best."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from solvers.pin.shapes.break_points.cells import Cells, points
from solvers.pin.shapes.break_points.half import Half
from solvers.pin.shapes.break_points.paths import Costs, Layers, backward, forward, greatest_dual, trace

Array = NDArray[np.float64]

_CALL, _STEP, _PAIR = 20_000, 10, 4
"""Work in cost evaluations: of a call, of a wall that requires a minimisation, and of one that does not."""


@dataclass(frozen=True)
class Around:
    """The multiplier of the greatest bound over point layers, the bound, and the cheapest paths just below and above
    it, (2, steps): break points, the last being 1, and walls."""

    multiplier: float
    value: float
    soft: Array
    stiff: Array
    work: int


@dataclass(frozen=True)
class Through:
    """Bound of layers of cells at one multiplier: the cost of the cheapest path, that of the cheapest one through
    every cell of every layer, and its break points, the last being 1."""

    total: float
    each: list[Array]
    path: Array
    work: int


@dataclass(frozen=True)
class Bounds:
    """Bounds of all break points of a half in layers of cells, one layer for each break point."""

    half: Half

    @cached_property
    def _ends(self) -> tuple[Cells, Cells]:
        """The end and the middle of the bar as cells of zero width."""
        return points(self.half, np.zeros(1)), points(self.half, np.ones(1))

    def points(self, places: list[Array]) -> list[Cells]:
        """Return one layer of points, cells of zero width, for each array of positions."""
        return points(self.half, np.concatenate(places)).split([t.size for t in places])

    def _chain(self, layers: list[Cells], least: Sequence[float], most: Array) -> tuple[Layers, Costs]:
        """Return the layers between the bar's two ends with the walls' bounds, and room for their costs; steps between
        the same layers share theirs."""
        known: dict[tuple[int, float], Cells] = {}
        for layer, low in zip([*layers, self._ends[1]], least, strict=True):
            if (id(layer), low) not in known:
                known[id(layer), low] = layer.floored(low)
        own = [self._ends[0]]
        own += [known[id(layer), low] for layer, low in zip([*layers, self._ends[1]], least, strict=True)]
        blocks: dict[tuple[int, int, float], int] = {}
        begins, room = [], 0
        for (before, after), top in zip(pairwise(own), most.tolist(), strict=True):
            key = id(before), id(after), top
            if key not in blocks:
                blocks[key] = room
                room += before.t.size * after.t.size
            begins.append(blocks[key])
        table = np.concatenate([layer.table for layer in own])
        starts = np.cumsum([0, *(layer.t.size for layer in own)])
        ahead, rest = np.empty((2, len(table), 2))
        costs = Costs(np.empty((room, 2, 2)), ahead, rest, np.empty((len(table), 2), dtype=np.int64))
        return Layers(table, starts, np.array(begins), most, self.half.law), costs

    def through(self, layers: list[Cells], least: Sequence[float], most: Array, multiplier: float) -> Through:
        """Return the bound of all break points in the layers at one multiplier."""
        chain, costs = self._chain(layers, least, most)
        sought = forward(multiplier, chain, costs)
        backward(chain, costs)
        path = np.empty((2, most.size))
        trace(multiplier, chain, costs, path)
        each = np.split((costs.ahead + costs.rest).min(axis=1), chain.starts[1:-1])[1:-1]
        work = _CALL + _STEP * sought + _PAIR * len(costs.step)
        return Through(float(costs.ahead[-1, 0]), each, path[0], work)

    def around(
        self, layers: list[Cells], least: Sequence[float], most: Array, start: float, tolerance: float,
        enough: float = math.inf,
    ) -> Around:  # fmt: skip
        """Return the greatest bound over the multiplier (see ``greatest_dual``); the layers are points."""
        chain, costs = self._chain(layers, least, most)
        soft, stiff = np.empty((2, 2, most.size))
        multiplier, value, sought = greatest_dual(chain, costs, start, tolerance, enough, soft, stiff)
        return Around(multiplier, value, soft, stiff, _CALL + _STEP * sought)
