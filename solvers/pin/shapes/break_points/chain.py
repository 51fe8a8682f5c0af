"""Layers of cells, one per break point, and shortest paths through them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from solvers.pin.shapes.break_points.bar import Law
from solvers.pin.shapes.break_points.cells import Cells
from solvers.pin.shapes.break_points.paths import AT, backward, costs, forward

Array = NDArray[np.float64]
_OVERHEAD = 30_000


@dataclass(frozen=True)
class Chain:
    """Step costs from layer to layer, and the cheapest path to every end of every cell with its predecessor.

    The first and the last layer are single points. ``work`` counts cost evaluations: ten for one that requires a
    minimisation, plus a fixed overhead per chain.
    """

    layers: list[Cells]
    costs: list[Array]
    ahead: list[Array]
    via: list[NDArray[np.int64]]
    work: int

    @property
    def total(self) -> float:
        """Cost of the cheapest path."""
        return float(self.ahead[-1][0, 0])

    @cached_property
    def ends(self) -> Array:
        """Position, f, Y, B and S at every end of the cheapest path's steps, 0 and the last included; (n + 1, 5)."""
        at, found = 0, []
        for layer, via in zip(reversed(self.layers[1:]), reversed(self.via), strict=True):
            i, e = divmod(at, 2)
            found.append(layer.table[e::2, i])
            at = int(via[i, e])
        return np.array([self.layers[0].table[::2, 0], *found[::-1]])

    @property
    def path(self) -> Array:
        """Break points of the cheapest path, including the last position."""
        return self.ends[1:, AT]

    def through(self) -> list[Array]:
        """Return for every layer and cell the cost of the cheapest path through it."""
        rest = [np.array([[0.0, np.inf]])]
        for cost in reversed(self.costs):
            before = np.empty((cost.shape[0], 2))
            backward(cost, rest[0], before)
            rest.insert(0, before)
        return [(a + r).min(axis=1) for a, r in zip(self.ahead, rest, strict=True)]


def chained(layers: list[Cells], multiplier: float, law: Law) -> Chain:
    """Return the chain through the layers for one deflection multiplier; identical layer objects share their costs."""
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
