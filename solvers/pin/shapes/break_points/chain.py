"""Layers of cells in a row, one for every break point, and the cheapest ways through them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from solvers.pin.shapes.break_points.bar import Law
from solvers.pin.shapes.break_points.cells import Cells
from solvers.pin.shapes.break_points.paths import backward, costs, forward

Array = NDArray[np.float64]
_OVERHEAD = 30_000


@dataclass(frozen=True)
class Chain:
    """What steps cost from layer to layer, and the cheapest way to every end of every cell, with where it comes from.

    The first and the last layer are one place each. ``work`` counts costs; a wall that had to be sought counts as ten,
    and whatever else a chain asks for as some ten thousand.
    """

    layers: list[Cells]
    costs: list[Array]
    ahead: list[Array]
    via: list[NDArray[np.int64]]
    work: int

    @property
    def total(self) -> float:
        """The cost of the cheapest path."""
        return float(self.ahead[-1][0, 0])

    @property
    def path(self) -> Array:
        """The break points of the cheapest path, the last place among them."""
        at, found = 0, []
        for layer, via in zip(reversed(self.layers[1:]), reversed(self.via), strict=True):
            i, e = divmod(at, 2)
            found.append(layer.table[e, i])
            at = int(via[i, e])
        return np.array(found[::-1])

    def through(self) -> list[Array]:
        """For every layer and every cell the cost of the cheapest path through it."""
        rest = [np.array([[0.0, np.inf]])]
        for cost in reversed(self.costs):
            before = np.empty((cost.shape[0], 2))
            backward(cost, rest[0], before)
            rest.insert(0, before)
        return [(a + r).min(axis=1) for a, r in zip(self.ahead, rest, strict=True)]


def chained(layers: list[Cells], multiplier: float, law: Law) -> Chain:
    """The chain through the layers for one multiplier of the deflection; layers that are one object share work."""
    known: dict[tuple[int, int], Array] = {}
    found, ahead, via, work = [], [np.array([[0.0, np.inf]])], [], _OVERHEAD
    for before, after in pairwise(layers):
        key = id(before), id(after)
        if key not in known:
            known[key] = np.empty((before.t.size, after.t.size, 2, 2))
            sought = costs(multiplier, before.table, after.table, law.kappa, law.a, law.b, known[key])
            work += 10 * sought + known[key].size
        cost = known[key]
        best, source = np.empty((cost.shape[1], 2)), np.empty((cost.shape[1], 2), dtype=np.int64)
        forward(cost, ahead[-1], best, source)
        found.append(cost)
        ahead.append(best)
        via.append(source)
    return Chain(layers, found, ahead, via, work)
