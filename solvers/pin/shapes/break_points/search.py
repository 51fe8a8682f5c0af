"""The lightest steps and a lower bound over all break points, closing in on each other.

Without a deflection limit, or with its multiplier, the mass is a sum over neighbouring break points, so dynamic
programming through cells (``solvers.pin.shapes.break_points.paths``) bounds all choices of break points, and through
the cells' ends finds good ones. Cells through which no path beats the best are gone for good; the others are cut in
four. What the bound loses falls with the square of the cells' width, so a few cells around the best are all that is
ever left.

For every multiplier lambda >= 0 the bound holds; the one that the best steps found have is as good as any where the
Lagrangian's least value is theirs. Where it is not (a duality gap), the cheapest paths for a multiplier a little less
and a little more differ: one is too soft, the other too stiff. The cells of the break point on which they differ most
are parted between them, and both parts go on with multipliers of their own, the one that promises more first.

Steps that would like to fall toward the middle pay for it: with m >= 0 along the bar, 0 at both ends, the bound adds
sum u_k (m(t_k) - m(t_{k-1})), which is not positive where u rises.
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
"""How close bound and best come, relative, whatever the accuracy asked of the mass itself."""
_FIRST, _COARSER, _FEWEST = {False: 192, True: 96}, 0.25, 24
"""Cells of the first round, without and with a deflection limit, which makes every pair of cells dearer; of a gap wider
than ``GAP`` fewer by this power of their ratio, but so many."""
_MOST_PAIRS = {False: 4_000_000, True: 1_600_000}
"""Of cells of neighbouring break points: what one round may cost."""
_MOST_WORK = 100_000_000
"""Costs of steps from cell to cell, a wall that must be sought counted as ten: some seconds."""
_WEIGHING = 100_000
"""What finding the walls of one path counts as."""
_FIRST_LOOKS, _MOST_LOOKS = 32, 4096
_CLOSER = 8.0
"""How much closer than in the last round f is looked at, at most."""
_TRIES = 4
_AROUND = np.linspace(-1.0, 1.0, 9)
_NO_GAP = 1e-6
_SETTLED = 1e-2
"""Break points settle to this share of the gap's root, in halves; the mass, flat around them, to its square."""
_ROUNDING = 1e-12
"""What rounding may do to a bound, relative."""


@dataclass(frozen=True)
class Steps:
    """The steps found: their inner ends as shares of the half, their walls, a lower bound over all such steps, and how
    many parts of the break points were looked at, and the work that took."""

    places: Array
    walls: Walls
    bound: float
    parts: int
    work: int

    @property
    def method(self) -> str:
        """How the bound was found."""
        plain = "dynamic programming through cells of the break points, cut until bound and best meet"
        return plain + ("; Lagrangian dual of the deflection limit" if self.walls.multiplier > 0.0 else "")

    @property
    def evidence(self) -> dict[str, float | int | str]:
        """What the search looked at."""
        at = self.walls.multiplier
        multiplier = at if math.isfinite(at) else "unbounded: only the solid span"
        return {"steps": self.places.size, "parts": self.parts, "work": self.work, "multiplier": multiplier}


def lightest_steps(bar: Bar, steps: int, known: float = 0.0, gap: float = GAP) -> Steps | None:
    """The lightest steps, their bound within ``gap`` unless that takes too long; None where the deflection limit
    cannot be kept. ``known`` is a bound known before."""
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
    """Cells of every break point; how closely f was looked at; where the multiplier is sought, and in what steps at
    first; the price of order; whether the best steps lie here and their multiplier will do."""

    layers: list[Cells]
    looks: int
    multiplier: float
    spread: float
    price: Array
    settled: bool = False

    @property
    def width(self) -> float:
        return max((float(layer.h.max()) for layer in self.layers), default=0.0)


class _Search:
    """One search for steps and a bound within ``gap``. ``places`` and ``walls`` are the best so far."""

    def __init__(self, bar: Bar, steps: int, sums: Sums | None, gap: float) -> None:
        self.bar, self.steps, self.limited = bar, steps, sums is not None
        self.gap = gap
        first = max(_FIRST[self.limited] * min(GAP / gap, 1.0) ** _COARSER, _FEWEST)
        self.ground: Ground = ground(bar, sums, math.ceil(first))
        self.places, self.walls = np.zeros(0), None
        self.work = 0

    def close(self, known: float) -> Steps | None:
        """Bounding, cutting and parting, the part that promises most first."""
        edges = self.ground.edges
        first = _worth(cells(self.bar, edges[:-1], np.diff(edges), _FIRST_LOOKS, self.ground.sums))
        whole = _Part([first] * (self.steps - 1), _FIRST_LOOKS, 0.5 if self.limited else 0.0, 4.0, np.zeros_like(edges))
        queue, done, count, width = [(known, 0, whole)], math.inf, 0, whole.width
        while queue:
            bound, _, part = heapq.heappop(queue)
            if self.walls is not None and (bound >= self.walls.volume * (1.0 - self.gap) or self.work > _MOST_WORK):
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
                # The best steps' own multiplier is not what bounds this part best.
                around, part = self._improve(replace(part, settled=False))
                bound, keep = self._bounded(part, bound)
            volume = self.walls.volume
            if bound >= volume * (1.0 - self.gap) or not all(k.any() for k in keep):
                done = min(done, bound)
                continue
            divided = self._divided(part, keep, around, bound)
            if not divided:
                # Too many cells: this part's bound is final.
                done = min(done, bound)
            for smaller in divided:
                if not all(layer.t.size for layer in smaller.layers):
                    # All that is left of a break is no better than breaks elsewhere, which have bounds of their own.
                    continue
                count += 1
                width = min(width, smaller.width)
                heapq.heappush(queue, (bound, count, smaller))
        self._settle(width, _SETTLED * math.sqrt(self.gap))
        bound = min([done, self.walls.volume, *(entry[0] for entry in queue)])
        return Steps(self.places, self.walls, bound, count + 1, self.work)

    def _bounded(self, part: _Part, bound: float) -> tuple[float, list[NDArray[np.bool_]]]:
        """The part's bound, and which of its cells may hold anything better than the best."""
        chain = self.ground.chain(part.layers, part.price, part.multiplier)
        self.work += chain.work
        most = part.multiplier + self.walls.volume * (1.0 + _ROUNDING)
        keep = [cost <= most for cost in chain.through()[1:-1]]
        return max(bound, (chain.total - part.multiplier) * (1.0 - _ROUNDING)), keep

    def _gap_is_most(self, around: Around, bound: float) -> bool:
        """Whether what the bound lacks is mostly a duality gap, which no smaller cells close."""
        volume = self.walls.volume
        missing = volume - around.value
        return self.limited and missing > self.gap * volume and missing > 0.5 * (volume - bound)

    def _improve(self, part: _Part) -> tuple[Around, _Part]:
        """Paths among the cells' ends, the best of them kept, and the part with what they tell of its multiplier and
        its price of order: at first again for as long as that price changes."""
        own = {id(layer): points(self.bar, np.unique(layer.table[:2]), self.ground.sums) for layer in part.layers}
        ends = [own[id(layer)] for layer in part.layers]
        for _ in range(_TRIES if self.walls is None else 1):
            if part.settled or not self.limited:
                around = self.ground.at(ends, part.price, part.multiplier)
            else:
                around = self.ground.around(ends, part.price, part.multiplier, part.spread)
            self.work += around.work
            here = None
            for places in {tuple(path): path for path in around.seen[-6:]}.values():
                self.work += _WEIGHING
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
            # The best steps' own multiplier, which is exact, says little across a duality gap (or is it their order?).
            apart = self.walls.volume - around.value > _NO_GAP * self.walls.volume and not price.any()
            own = part.settled or (best and not apart)
            multiplier = self.walls.multiplier if own else around.multiplier
            part = replace(part, multiplier=multiplier, spread=1.02, price=price, settled=own)
            if not changed or not 0.0 < multiplier < math.inf:
                break
        return around, part

    def _divided(self, part: _Part, keep: list[NDArray[np.bool_]], around: Around, bound: float) -> list[_Part]:
        """The part without the cells that are gone: its cells cut, or itself parted where a duality gap is the most of
        what is left."""
        volume = self.walls.volume
        if self._gap_is_most(around, bound):
            parted = self._parted(part, keep, around)
            if parted:
                return parted
        counts = [CUT * int(k.sum()) for k in keep]
        if sum(a * b for a, b in pairwise([1, *counts, 1])) > _MOST_PAIRS[self.limited]:
            return self._parted(part, keep, around) if self.limited else []
        # What the looks miss falls with their distance, and is most of what is left.
        closer = min(1.3 * (volume - bound) / (self.gap * volume), _CLOSER)
        looks = min(max(math.ceil(part.looks * closer / CUT), _FIRST_LOOKS // 2), _MOST_LOOKS)
        layers = [
            _worth(finer(self.bar, layer, k, looks, self.ground.sums))
            for layer, k in zip(part.layers, keep, strict=True)
        ]
        return [replace(part, layers=layers, looks=looks)]

    def _parted(self, part: _Part, keep: list[NDArray[np.bool_]], around: Around) -> list[_Part]:
        """The part's two halves: between the soft and the stiff path's break points, or of its longest stretch."""
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
        return [replace(part, layers=half, spread=1.5, settled=False) for half in halves]

    def _settle(self, reach: float, least: float) -> None:
        """Moves the break points, all together, to where they cost least: on grids around them that narrow."""
        price = self.ground.price_of_order(self.places, self.walls)
        while reach > least and math.isfinite(self.walls.multiplier):
            grids = [np.unique(np.clip(t + reach * _AROUND, 0.0, 1.0)) for t in self.places[:-1]]
            layers = [points(self.bar, grid, self.ground.sums) for grid in grids]
            moved = self.ground.chain(layers, price, self.walls.multiplier).path
            walls = self.ground.walls(moved)
            if walls.volume < self.walls.volume:
                self.places, self.walls = moved, walls
            reach *= 0.25


def _worth(layer: Cells) -> Cells:
    """Without the cells in which a break is no better than at the next place where f rises again or the deflection
    begins, or at 1: the step before it is the thinner one, and reaches that far with the same wall."""
    return layer.taken(~layer.level | (layer.table[AT + 1] >= 1.0 - APART))
