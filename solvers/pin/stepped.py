"""A stepped bore, drilled from both ends: n cylinders that narrow toward the middle.

Without a deflection limit the wall of a step is the greatest least wall up to its inner end, f(x), so only the break
points are free: minimise sum f(x_k)(x_k - x_{k-1}). Every break point is confined to cells [y, y + h]; as f rises,

    mass >= sum f(y_k)(y_k - y_{k-1}) - sum h_k (f(y_{k+1}) - f(y_k)),

whose terms belong to pairs of neighbours, so dynamic programming gives the bound over all choices of cells, and without
h the best steps on the cells' ends. Cells through which no path beats the best are gone for good; the others are cut,
until bound and best meet.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput
from solvers.numerics.jit import kernel
from solvers.pin.form import Found
from solvers.pin.pointwise import Free
from solvers.pin.program import Program, folded, least_walls_at, unfolded
from solvers.pin.section import solidity_of, wall_of
from solvers.pin.stiff_steps import stiff_steps

Array = NDArray[np.float64]
Least = Callable[[Array], Array]

MOST_STEPS = 12
_FIRST_CELLS = 192
_MOST_CELLS = 6000
_ROUNDS = 20
_CUT = 4
_SWEEPS = 6
_GRID = 33


@kernel
def _forward(x0: Array, h0: Array, f0: Array, best0: Array, x1: Array, f1: Array, best1: Array, via: Array) -> None:
    """best1_j = min over i with x0_i <= x1_j of best0_i + f1_j (x1_j - x0_i) - (f1_j - f0_i) h0_i."""
    for j in range(x1.size):
        least, at = np.inf, -1
        for i in range(x0.size):
            if x0[i] > x1[j]:
                break
            cost = best0[i] + f1[j] * (x1[j] - x0[i]) - (f1[j] - f0[i]) * h0[i]
            if cost < least:
                least, at = cost, i
        best1[j], via[j] = least, at


@kernel
def _backward(x0: Array, h0: Array, f0: Array, rest0: Array, x1: Array, f1: Array, rest1: Array) -> None:
    for i in range(x0.size):
        least = np.inf
        for j in range(x1.size - 1, -1, -1):
            if x0[i] > x1[j]:
                break
            cost = rest1[j] + f1[j] * (x1[j] - x0[i]) - (f1[j] - f0[i]) * h0[i]
            if cost < least:
                least = cost
        rest0[i] = least


@dataclass(frozen=True)
class _Layer:
    """The cells one break point may lie in: their lower ends, widths, and f there."""

    x: Array
    h: Array
    f: Array


@dataclass(frozen=True)
class Breaks:
    """The best break points, f of every step, the integral of u over the half, and its lower bound."""

    places: Array
    walls: Array
    total: float
    bound: float
    cells: int


def _paths(layers: list[_Layer], widths: bool) -> tuple[list[Array], list[Array]]:
    """The cheapest way to every cell, and from which cell it comes."""
    best, via = [np.zeros(1)], [np.zeros(1, dtype=np.int64)]
    for before, after in pairwise(layers):
        cost, source = np.empty(after.x.size), np.empty(after.x.size, dtype=np.int64)
        h = before.h if widths else np.zeros_like(before.h)
        _forward(before.x, h, before.f, best[-1], after.x, after.f, cost, source)
        best.append(cost)
        via.append(source)
    return best, via


def best_breaks(least: Least, middle: float, steps: int, gap: float) -> Breaks:
    """Branch and bound over the break points; ``least`` gives f at rising places."""
    edges = np.linspace(0.0, middle, _FIRST_CELLS + 1)
    start = _Layer(np.zeros(1), np.zeros(1), least(np.zeros(1)))
    last = _Layer(np.array([middle]), np.zeros(1), least(np.array([middle])))
    first = _Layer(edges[:-1], np.diff(edges), least(edges[:-1]))
    layers = [start, *([first] * (steps - 1)), last]
    total, places = np.inf, np.zeros(0)
    bound = 0.0
    for _ in range(_ROUNDS):
        best, via = _paths(layers, widths=False)
        if best[-1][0] < total:
            total, at, found = float(best[-1][0]), 0, []
            for layer, source in zip(reversed(layers), reversed(via), strict=True):
                found.append(layer.x[at])
                at = int(source[at])
            places = np.array(found[::-1][1:])
        low, _ = _paths(layers, widths=True)
        bound = max(bound, float(low[-1][0]))
        cells = sum(layer.x.size for layer in layers[1:-1])
        if steps == 1 or total - bound <= gap * total or cells * _CUT > _MOST_CELLS * (steps - 1):
            break
        rest = [np.zeros(1)]
        for before, after in zip(reversed(layers[:-1]), reversed(layers[1:]), strict=True):
            cost = np.empty(before.x.size)
            _backward(before.x, before.h, before.f, cost, after.x, after.f, rest[0])
            rest.insert(0, cost)
        layers = [start, *(_cut(l, a + b <= total, least) for l, a, b in
                           zip(layers[1:-1], low[1:-1], rest[1:-1], strict=True)), last]  # fmt: skip
    places, total = _settle(least, places, total, float(layers[1].h.max()) if steps > 1 else 0.0)
    return Breaks(places, least(places), total, min(bound, total), sum(layer.x.size for layer in layers[1:-1]))


def _settle(least: Least, places: Array, total: float, reach: float) -> tuple[Array, float]:
    """The break points moved one by one within ``reach`` to where they cost least; grids around the best, narrowing."""
    for _ in range(_SWEEPS if places.size > 1 else 0):
        before = total
        for k in range(places.size - 1):
            width, low = 4.0 * reach, places[k - 1] if k else 0.0
            while width > 1e-9 * places[-1]:
                grid = np.linspace(max(places[k] - width, low), min(places[k] + width, places[k + 1]), _GRID)
                inner, outer = least(grid), least(places)[k + 1]
                cost = inner * (grid - low) + outer * (places[k + 1] - grid)
                best = int(np.argmin(cost))
                places = np.concatenate([places[:k], grid[best : best + 1], places[k + 1 :]])
                width *= 4.0 / _GRID
        walls = least(places)
        total = float(walls @ np.diff(places, prepend=0.0))
        if total >= before * (1.0 - 1e-14):
            break
    return places, total


def _cut(layer: _Layer, keep: NDArray[np.bool_], least: Least) -> _Layer:
    x, h = layer.x[keep], layer.h[keep] / _CUT
    if not x.size:
        # Rounding alone can drop the best path's own cell.
        return layer
    cut = (x[:, None] + h[:, None] * np.arange(_CUT)).ravel()
    return _Layer(cut, np.repeat(h, _CUT), least(cut))


@dataclass(frozen=True)
class Stepped:
    """``steps`` different bores from each end to the middle."""

    steps: int
    name: str = "stepped"

    def __post_init__(self) -> None:
        if not 1 <= self.steps <= MOST_STEPS:
            raise InvalidInput("form.steps", "is no number of steps this form knows", f"1 … {MOST_STEPS}")

    def find(self, program: Program, gap: float) -> Found | None:
        if program.limits.max_slope is not None and self.steps > 1:
            raise InvalidInput("limits.max_slope", "a step has no slope", "no slope limit with a stepped bore")
        half = folded(program)
        middle = 0.5 * program.scene.geometry.length
        nodes, peaks = half.stations.x, np.maximum.accumulate(half.lower)

        def least(x: Array) -> Array:
            """The greatest least u up to x: the stations before, and the place itself."""
            before = np.searchsorted(nodes, x, side="right") - 1
            own = solidity_of(least_walls_at(program.scene, program.criterion, program.floor, x))
            return np.maximum.accumulate(np.maximum(peaks[before], own)) if x.size else own

        breaks = best_breaks(least, middle, self.steps, max(0.1 * gap, 1e-9))
        places, walls = breaks.places, breaks.walls
        volume, bound = breaks.total / middle, breaks.bound / middle
        method, evidence = "branch and bound over the break points", {"cells": breaks.cells, "steps": self.steps}
        if program.limit is not None:
            stiff = stiff_steps(program, places, max(0.1 * gap, 1e-8))
            if stiff is None:
                return None
            if stiff.multiplier > 0.0:
                places, walls, volume = stiff.places, stiff.walls, stiff.volume
                relaxed = Free(drillable=True).find(program, gap)
                bound = max(bound, stiff.bound, relaxed.bound if relaxed is not None else 0.0)
                method = "branch and bound over the break points, Lagrangian dual in every box"
                evidence["boxes"] = stiff.boxes
        return self._found(program, half, places, walls, volume, bound, method, evidence)

    def _found(
        self, program: Program, half: Program, places: Array, walls: Array, volume: float, bound: float,
        method: str, evidence: dict[str, float | int | str],
    ) -> Found:  # fmt: skip
        g = program.scene.geometry
        x = half.stations.x
        # A station on a break belongs to the side of its panel.
        inside = 0.5 * (half.stations.left + half.stations.right)
        step = np.searchsorted(places[:-1], np.repeat(inside, x.size // inside.size), side="right")
        bores = g.outer_diameter * (1.0 - wall_of(walls))
        corners = []
        begin = 0.0
        for place, bore in zip(places, bores, strict=True):
            corners += [(begin, float(bore)), (float(place), float(bore))]
            begin = float(place)
        corners += [(g.length - p, bore) for p, bore in reversed(corners)]
        return Found(
            unfolded(program, walls[np.minimum(step, walls.size - 1)]), float(volume), float(min(bound, volume)),
            method, evidence, corners=tuple(corners),
        )  # fmt: skip
