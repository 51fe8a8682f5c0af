"""Branch and bound for the lightest steps over all break points.

Without a deflection limit, or for a fixed multiplier, the mass is a sum over neighbouring break points, so dynamic
programming through cells (``solvers.pin.shapes.break_points.paths``) bounds all choices of break points, and through
the cells' ends yields incumbents. Cells through which no path beats the incumbent are pruned; the others are cut in
four. The excess of the bound decreases with the square of the cells' width, so few cells around the optimum remain.

The bound holds for every multiplier lambda >= 0; the incumbent's multiplier is optimal if the Lagrangian's minimum
is attained by the incumbent. Otherwise (a duality gap) the cheapest paths for a slightly smaller and a slightly
greater multiplier differ: one is too soft, the other too stiff. The cells of the break point on which they differ
most are branched between them, and both parts continue with their own multipliers, lowest bound first.

Steps that would decrease toward the middle are priced: with m >= 0 along the bar, 0 at both ends, the bound adds
sum u_k (m(t_k) - m(t_{k-1})), which is not positive where u increases.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from solvers.pin.shapes.break_points.bar import Bar, Sums, Walls
from solvers.pin.shapes.break_points.cells import CUT, Cells, cells, finer, points
from solvers.pin.shapes.break_points.ground import APART, Around, Ground, ground
from solvers.pin.shapes.break_points.paths import AT

Array = NDArray[np.float64]

GAP = 9e-8
"""Relative gap at convergence, regardless of the accuracy requested for the mass itself."""
_INITIAL_CELLS, _COARSENING_EXPONENT, _MIN_CELLS = {False: 192, True: 96}, 0.25, 24
"""Initial cells, without and with a deflection limit, which makes every pair of cells more expensive; exponent of
the reduction for a gap wider than ``GAP``, and the minimum."""
_MOST_PAIRS = {False: 4_000_000, True: 1_600_000}
"""Maximum pairs of cells of neighbouring break points per round."""
_MOST_WORK = 100_000_000
"""Maximum work in cost evaluations, ten for one that requires a minimisation: a few seconds."""
_WEIGHING_WORK = 100_000
"""Work counted for the walls of one path."""
_INITIAL_SAMPLES, _MAX_SAMPLES = 32, 4096
_MAX_DENSITY_INCREASE = 8.0
"""Maximum increase of the sampling density of f per round."""
_INITIAL_ITERATIONS = 4
_POLISHING_GRID = np.linspace(-1.0, 1.0, 9)
_DUALITY_GAP_TOLERANCE = 1e-6
_OPEN_GAP_FACTOR = 1.5
"""Gap at convergence, in duality gaps of the incumbent with its own break points: choosing those cannot close it."""
_BREAK_POINT_TOLERANCE = 1e-2
"""Break point tolerance as a fraction of the gap's square root; the mass, stationary there, converges to its square."""
_ROUNDING = 1e-12
"""Relative rounding error of a bound."""


@dataclass(frozen=True)
class Steps:
    """The incumbent: step ends as fractions of the half, walls, lower bound over all such steps, parts and work
    examined."""

    places: Array
    walls: Walls
    bound: float
    parts: int
    work: int

    @property
    def method(self) -> str:
        """Description of the bounding method."""
        plain = "dynamic programming through cells of the break points, cut until bound and best meet"
        return plain + ("; Lagrangian dual of the deflection limit" if self.walls.multiplier > 0.0 else "")

    @property
    def evidence(self) -> dict[str, float | int | str]:
        """Statistics of the search."""
        at = self.walls.multiplier
        multiplier = at if math.isfinite(at) else "unbounded: only the solid span"
        return {"steps": self.places.size, "parts": self.parts, "work": self.work, "multiplier": multiplier}


def lightest_steps(bar: Bar, steps: int, known: float = 0.0, gap: float = GAP) -> Steps | None:
    """Find the lightest steps, with their bound within ``gap`` unless the work limit is reached; None if infeasible.

    ``known`` is a lower bound from elsewhere.
    """
    limited = bar.sums()
    if limited is not None:
        first = bar.weigh(_Search(bar, steps, None, 1.0).close(0.0).places)
        if first is None:
            return None
        if first.multiplier > 0.0:
            return _Search(bar, steps, limited, gap).close(known)
    found = _Search(bar, steps, None, gap).close(known)
    if limited is not None and bar.weigh(found.places).multiplier > 0.0:
        return _Search(bar, steps, limited, gap).close(known)
    return found


@dataclass(frozen=True)
class _Part:
    """A node of the search tree.

    Cells of every break point, sampling density of f, initial multiplier and its bracketing step, price of order;
    ``settled`` if the incumbent lies here and its multiplier is kept; ``divided`` if a duality gap made it a part.
    """

    layers: list[Cells]
    looks: int
    multiplier: float
    spread: float
    price: Array
    settled: bool = False
    divided: bool = False

    @property
    def width(self) -> float:
        return max((float(layer.h.max()) for layer in self.layers), default=0.0)


class _Search:
    """One search for steps and a bound within ``gap``; ``places`` and ``walls`` are the incumbent."""

    def __init__(self, bar: Bar, steps: int, sums: Sums | None, gap: float) -> None:
        self.bar, self.steps, self.limited = bar, steps, sums is not None
        self.gap = gap
        first = max(_INITIAL_CELLS[self.limited] * min(GAP / gap, 1.0) ** _COARSENING_EXPONENT, _MIN_CELLS)
        self.ground: Ground = ground(bar, sums, math.ceil(first))
        self.places, self.walls = np.zeros(0), None
        self.work = 0
        self._open: tuple[Walls | None, float] = None, 0.0

    def close(self, known: float) -> Steps | None:
        """Bound, refine and branch, lowest bound first."""
        edges = self.ground.edges
        first = _undominated(cells(self.bar, edges[:-1], np.diff(edges), _INITIAL_SAMPLES, self.ground.sums))
        whole = _Part(
            [first] * (self.steps - 1), _INITIAL_SAMPLES, 0.5 if self.limited else 0.0, 4.0, np.zeros_like(edges)
        )
        queue, done, count, width = [(known, 0, whole)], math.inf, 0, whole.width
        while queue:
            bound, _, part = heapq.heappop(queue)
            if self.walls is not None and (bound >= self._proven(part) or self.work > _MOST_WORK):
                done = min(done, bound)
                break
            around, part = self._improve(part)
            if self.walls is None:
                return None
            if self.steps == 1 or not math.isfinite(self.walls.multiplier):
                done = self.walls.volume * (1.0 - _ROUNDING) if math.isfinite(self.walls.multiplier) else bound
                break
            bound, keep = self._bounded(part, bound)
            if self._gap_is_most(around, bound) and part.settled:
                # The incumbent's multiplier does not give this part's best bound.
                around, part = self._improve(replace(part, settled=False))
                bound, keep = self._bounded(part, bound)
            if bound >= self._proven(part) or not all(k.any() for k in keep):
                done = min(done, bound)
                continue
            divided = self._divided(part, keep, around, bound)
            if not divided:
                # Too many cells: this part's bound is final.
                done = min(done, bound)
            for smaller in divided:
                if not all(layer.t.size for layer in smaller.layers):
                    # The remaining cells of a break are dominated by breaks elsewhere, which have their own bounds.
                    continue
                count += 1
                width = min(width, smaller.width)
                heapq.heappush(queue, (bound, count, smaller))
        self._settle(width, _BREAK_POINT_TOLERANCE * math.sqrt(self.gap))
        bound = min([done, self.walls.volume, *(entry[0] for entry in queue)])
        return Steps(self.places, self.walls, bound, count + 1, self.work)

    def _bounded(self, part: _Part, bound: float) -> tuple[float, list[NDArray[np.bool_]]]:
        """Return the part's bound, and which of its cells may contain an improvement of the incumbent."""
        chain = self.ground.chain(part.layers, part.price, part.multiplier)
        self.work += chain.work
        most = part.multiplier + self.walls.volume * (1.0 + _ROUNDING)
        keep = [cost <= most for cost in chain.through()[1:-1]]
        return max(bound, (chain.total - part.multiplier) * (1.0 - _ROUNDING)), keep

    def _proven(self, part: _Part) -> float:
        """Return the bound from which on a part need not be searched further.

        A wall near the solid section, where the flexibility is concave, leaves a duality gap even where all break
        points are fixed at the incumbent's.
        """
        volume = self.walls.volume
        if self.limited and part.divided and self._open[0] is not self.walls:
            fixed = [points(self.bar, self.places[k : k + 1], self.ground.sums) for k in range(self.steps - 1)]
            around = self.ground.around(fixed, np.zeros_like(part.price), self.walls.multiplier, 1.02)
            self.work += around.work
            self._open = self.walls, _OPEN_GAP_FACTOR * (volume - around.value)
        return volume - max(self.gap * volume, self._open[1])

    def _gap_is_most(self, around: Around, bound: float) -> bool:
        """Return whether the remaining gap is mostly a duality gap, which refinement cannot close."""
        volume = self.walls.volume
        missing = volume - around.value
        return self.limited and missing > self.gap * volume and missing > 0.5 * (volume - bound)

    def _improve(self, part: _Part) -> tuple[Around, _Part]:
        """Update the incumbent from paths through the cells' ends, and the part's multiplier and price of order.

        On the first call repeated while that price changes.
        """
        own = {id(layer): points(self.bar, np.unique(layer.table[:2]), self.ground.sums) for layer in part.layers}
        ends = [own[id(layer)] for layer in part.layers]
        for _ in range(_INITIAL_ITERATIONS if self.walls is None else 1):
            if part.settled or not self.limited:
                around = self.ground.at(ends, part.price, part.multiplier)
            else:
                around = self.ground.around(ends, part.price, part.multiplier, part.spread)
            self.work += around.work
            here = None
            for places in {tuple(path): path for path in around.seen[-6:]}.values():
                self.work += _WEIGHING_WORK
                walls = self.ground.walls(places)
                if walls is not None and (here is None or walls.volume < here[1].volume):
                    here = places, walls
            if here is None:
                return around, part
            best = self.walls is None or here[1].volume < self.walls.volume
            if best:
                self.places, self.walls = here
            price = self.ground.price_of_order(*here)
            changed = not np.array_equal(price, part.price)
            # The incumbent's multiplier is exact but weak across a duality gap (or is the gap due to the order?).
            apart = self.walls.volume - around.value > _DUALITY_GAP_TOLERANCE * self.walls.volume and not price.any()
            own = part.settled or (best and not apart)
            multiplier = self.walls.multiplier if own else around.multiplier
            part = replace(part, multiplier=multiplier, spread=1.02, price=price, settled=own)
            if not changed or not 0.0 < multiplier < math.inf:
                break
        return around, part

    def _divided(self, part: _Part, keep: list[NDArray[np.bool_]], around: Around, bound: float) -> list[_Part]:
        """Return the part without its pruned cells, refined, or branched where a duality gap dominates."""
        volume = self.walls.volume
        if self._gap_is_most(around, bound):
            parted = self._parted(part, keep, around)
            if parted:
                return parted
        counts = [CUT * int(k.sum()) for k in keep]
        if sum(a * b for a, b in pairwise([1, *counts, 1])) > _MOST_PAIRS[self.limited]:
            return self._parted(part, keep, around) if self.limited else []
        # The sampling error of f decreases with the sample distance and dominates the remaining gap.
        closer = min(1.3 * (volume - bound) / (self.gap * volume), _MAX_DENSITY_INCREASE)
        looks = min(max(math.ceil(part.looks * closer / CUT), _INITIAL_SAMPLES // 2), _MAX_SAMPLES)
        layers = [
            _undominated(finer(self.bar, layer, k, looks, self.ground.sums))
            for layer, k in zip(part.layers, keep, strict=True)
        ]
        return [replace(part, layers=layers, looks=looks)]

    def _parted(self, part: _Part, keep: list[NDArray[np.bool_]], around: Around) -> list[_Part]:
        """Split the part in two: between the soft and the stiff path's break points, or at its longest stretch."""
        layers = [layer.taken(k) for layer, k in zip(part.layers, keep, strict=True)]
        apart = np.abs(around.soft - around.stiff)[:-1]
        at = int(np.argmax(apart))
        middle = 0.5 * (around.soft[at] + around.stiff[at])
        if apart[at] <= 2.0 * part.width:
            at = int(np.argmax([layer.t[-1] - layer.t[0] for layer in layers]))
            middle = 0.5 * (layers[at].t[-1] + layers[at].t[0] + layers[at].h[-1])
        first = layers[at].t + 0.5 * layers[at].h < middle
        if first.all() or not first.any():
            return []
        halves = [[*layers[:at], layers[at].taken(side), *layers[at + 1 :]] for side in (first, ~first)]
        return [replace(part, layers=half, spread=1.5, settled=False, divided=True) for half in halves]

    def _settle(self, reach: float, least: float) -> None:
        """Polish all break points jointly on successively narrower grids."""
        price = self.ground.price_of_order(self.places, self.walls)
        while reach > least and math.isfinite(self.walls.multiplier):
            grids = [np.unique(np.clip(t + reach * _POLISHING_GRID, 0.0, 1.0)) for t in self.places[:-1]]
            layers = [points(self.bar, grid, self.ground.sums) for grid in grids]
            moves = [self.ground.chain(layers, price, self.walls.multiplier).path]
            if self._open[1] > 0.0:  # the cheapest path is not the lightest: one break point after the other
                one = reach * np.eye(self.places.size)[:-1]
                moves += list(np.clip(self.places + np.concatenate([one, -one]), 0.0, 1.0))
            for moved in moves:
                walls = self.ground.walls(moved) if (np.diff(moved) >= 0.0).all() else None
                if walls is not None and walls.volume < self.walls.volume:
                    self.places, self.walls = moved, walls
            reach *= 0.25


def _undominated(layer: Cells) -> Cells:
    """Remove the cells in which a break is dominated by the next position where f or the deflection increases, or by
    1: the step before it is the thinner one and extends that far with the same wall."""
    return layer.taken(~layer.level | (layer.table[AT + 1] >= 1.0 - APART))
