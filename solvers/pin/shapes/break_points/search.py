"""Branch and bound for the lightest steps over all break points.

Without a deflection limit, or for a fixed multiplier, the mass is a sum over neighbouring break points, so dynamic
programming through cells (``solvers.pin.shapes.break_points.paths``) bounds all choices of break points, and through
the cells' ends yields incumbents. Cells through which no path beats the incumbent are pruned; the others are cut in
four. The excess of the bound decreases with the square of the cells' width, so few cells around the optimum remain.

The bound holds for every multiplier lambda >= 0, and the greatest is sought over the cells' ends. Where that stays
below the incumbent's mass (a duality gap), the cheapest paths on either side of the best multiplier differ: one is
too soft, the other too stiff. The part is divided between them, in the break point on which they differ most, or in
a step's wall: near the solid section, where the flexibility is concave, the cheapest wall jumps at fixed break
points. Where such a path's walls fall toward the middle, which they must not, the wall between them divides the part.
Both parts continue with their own multipliers, lowest bound first.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from solvers.pin.section.flexibility import inflection
from solvers.pin.shapes.break_points.bounds import Around, Bounds, Through
from solvers.pin.shapes.break_points.cells import CUT, Cells, cells, finer
from solvers.pin.shapes.break_points.half import APART, Half, Walls
from solvers.pin.shapes.break_points.paths import AT, FLOOR

Array = NDArray[np.float64]

GAP = 9e-8
"""Relative gap at convergence, regardless of the accuracy requested for the mass itself."""
_INITIAL_CELLS, _COARSENING_EXPONENT, _MIN_CELLS = {False: 192, True: 48}, 0.25, 24
"""Initial cells, without and with a deflection limit, which makes every pair of cells more expensive; exponent of
the reduction for a gap wider than ``GAP``, and the minimum."""
_MOST_PAIRS = 1_600_000
"""Maximum pairs of cells of neighbouring break points per round."""
_MOST_POINTS = 65
"""Maximum points of a break point in the search for the multiplier."""
_POLISHING_GRID = np.linspace(-1.0, 1.0, 9)
_MOST_WORK = 4_000_000
"""Maximum work per step, about 30 ms, in cost evaluations (one that requires a minimisation counts as ten). Of 150
random problems, all that closed their gap did so within this limit; ten times as much hardly narrowed the others'
gaps."""
_WEIGHING_WORK = 100_000
"""Work counted for the walls of one path."""
_DUAL_TOLERANCE, _EXPECTED_PROGRESS = 0.05, 0.1
"""Tolerance of the greatest bound as a fraction of the gap that is sought or expected next, and the latter as a
fraction of the part's present gap."""
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


def lightest_steps(half: Half, steps: int, known: float = 0.0, gap: float = GAP) -> Steps | None:
    """Find the lightest steps, with their bound within ``gap`` unless the work limit is reached; None if infeasible.

    ``known`` is a lower bound from elsewhere.
    """
    even = half.weigh(np.arange(1, steps + 1) / steps)
    if even is None:
        return None
    if even.multiplier == 0.0:
        # Probably the limit is not binding.
        free = Half(replace(half.program, limit=None), half.solid_from)
        found = _Search(free, steps, gap).close(known)
        if half.weigh(found.places).multiplier == 0.0:
            return found
    return _Search(half, steps, gap).close(known)


@dataclass(frozen=True)
class _Part:
    """A node of the search tree: cells of every break point, bounds of every step's wall, initial multiplier."""

    layers: list[Cells]
    least: tuple[float, ...]
    most: tuple[float, ...]
    multiplier: float

    @property
    def width(self) -> float:
        return max((float(layer.h.max()) for layer in self.layers), default=0.0)


class _Search:
    """One search for steps and a bound within ``gap``; ``places`` and ``walls`` are the incumbent."""

    def __init__(self, half: Half, steps: int, gap: float) -> None:
        self.half, self.steps, self.gap, self.bounds = half, steps, gap, Bounds(half)
        self.limited = half.sums is not None
        self.places, self.walls = np.zeros(0), None
        self.work = 0
        own = half.program
        self._capped = self.limited and own.sought.kappa < 0.0
        self._knee = inflection(own.scene.material.poisson) if self._capped else math.inf

    def close(self, known: float) -> Steps | None:
        """Bound, refine and branch, lowest bound first."""
        count = max(_INITIAL_CELLS[self.limited] * min(GAP / self.gap, 1.0) ** _COARSENING_EXPONENT, _MIN_CELLS)
        edges = self.half.edges(math.ceil(count))
        first = _undominated(cells(self.half, edges[:-1], np.diff(edges)))
        whole = _Part(
            [first] * (self.steps - 1), (0.0,) * self.steps, (1.0 if self._capped else math.inf,) * self.steps,
            0.5 if self.limited else 0.0,
        )  # fmt: skip
        queue, done, count, width = [(known, 0, whole)], math.inf, 0, whole.width
        while queue:
            bound, _, part = heapq.heappop(queue)
            if self.walls is not None and (self._is_closed(bound) or self.work > _MOST_WORK * self.steps):
                done = min(done, bound)
                break
            around, part = self._improve(part, bound)
            if self.walls is None:
                return None
            if self.steps == 1 or not math.isfinite(self.walls.multiplier):
                done = self.walls.volume * (1.0 - _ROUNDING) if math.isfinite(self.walls.multiplier) else bound
                break
            found, bound = self._bounded(part, bound)
            kept = self._kept(part, found)
            if self._is_closed(bound) or not all(layer.t.size for layer in kept.layers):
                done = min(done, bound)
                continue
            divided = self._divided(kept, around, bound)
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

    def _is_closed(self, bound: float) -> bool:
        return bound >= self.walls.volume * (1.0 - self.gap)

    def _bounded(self, part: _Part, bound: float) -> tuple[Through, float]:
        """Return the cheapest paths through the part's cells, and the part's bound; weigh the cheapest."""
        found = self.bounds.through(part.layers, part.least, np.array(part.most), part.multiplier)
        self.work += found.work
        if (np.diff(found.path) >= 0.0).all():
            self._take(found.path)
        return found, max(bound, (found.total - part.multiplier) * (1.0 - _ROUNDING))

    def _kept(self, part: _Part, found: Through) -> _Part:
        """Return the part with the cells that may contain an improvement of the incumbent."""
        worst = part.multiplier + self.walls.volume * (1.0 + _ROUNDING)
        kept = [layer.taken(cost <= worst) for layer, cost in zip(part.layers, found.each, strict=True)]
        return replace(part, layers=kept)

    def _improve(self, part: _Part, bound: float) -> tuple[Around | None, _Part]:
        """Update the incumbent from paths through the cells' ends, and the part's multiplier."""
        distinct = {id(layer): layer for layer in part.layers}
        places = [_spread(np.unique(layer.table[:, :2])) for layer in distinct.values()]
        own = dict(zip(distinct, self.bounds.points(places), strict=True)) if places else {}
        ends, most = [own[id(layer)] for layer in part.layers], np.array(part.most)
        if not self.limited:
            found = self.bounds.through(ends, part.least, most, 0.0)
            self.work += found.work
            self._take(found.path)
            return None, part
        volume = math.inf if self.walls is None else self.walls.volume
        size = volume if self.walls is not None else max(1.0, bound)
        tolerance = _DUAL_TOLERANCE * max(self.gap * size, _EXPECTED_PROGRESS * (size - bound))
        around = self.bounds.around(ends, part.least, most, part.multiplier, tolerance, volume)
        self.work += around.work
        if math.isfinite(around.value):
            self._take(around.stiff[0])
            self._take(around.soft[0])
            part = replace(part, multiplier=around.multiplier)
        return around, part

    def _take(self, places: Array) -> None:
        """Weigh steps, and keep them if they are the lightest yet."""
        self.work += _WEIGHING_WORK
        walls = self.half.weigh(places)
        if walls is not None and (self.walls is None or walls.volume < self.walls.volume):
            self.places, self.walls = places, walls

    def _divided(self, kept: _Part, around: Around | None, bound: float) -> list[_Part]:
        """Return the part with its cells refined, or divided into parts if a duality gap dominates."""
        if around is not None:
            missing = self.walls.volume - around.value
            if missing > max(self.gap * self.walls.volume, 0.5 * (self.walls.volume - bound)):
                parted = self._parted(kept, around)
                if parted:
                    return parted
        if sum(CUT * CUT * a.t.size * b.t.size for a, b in pairwise(kept.layers)) > _MOST_PAIRS:
            return []
        split = finer(self.half, kept.layers)
        return [replace(kept, layers=[_undominated(layer) for layer in split])]

    def _parted(self, part: _Part, around: Around) -> list[_Part]:
        """Divide the part where a path's walls wrongly decrease most; otherwise between the soft and the stiff path, in
        a wall or in a break point. Empty if the paths differ by no more than their cells."""
        fall, step, middle = max(
            (path[1, k] - path[1, k + 1], k, 0.5 * (path[1, k] + path[1, k + 1]))
            for path in (around.soft, around.stiff)
            for k in range(self.steps - 1)
        )
        places, walls = np.abs(around.stiff - around.soft)
        if fall > 0.5 * max(places.max(), walls.max(), APART):
            return self._parted_in_wall(part, step, middle)
        walls[np.maximum(around.stiff[1], around.soft[1]) <= self._knee] = 0.0
        thin, at = int(np.argmax(walls)), int(np.argmax(places))
        if walls[thin] > max(places[at], APART):
            return self._parted_in_wall(part, thin, 0.5 * (around.soft[1, thin] + around.stiff[1, thin]))
        if places[at] <= 2.0 * part.width:
            return []
        return self._parted_at(part, at, 0.5 * (around.soft[0, at] + around.stiff[0, at]))

    def _parted_at(self, part: _Part, at: int, middle: float) -> list[_Part]:
        """Divide the part's cells of a break point at a position."""
        layers, own = part.layers, part.layers[at]
        first = own.t + 0.5 * own.h < middle
        if first.all() or not first.any():
            return []
        return [replace(part, layers=[*layers[:at], own.taken(side), *layers[at + 1 :]]) for side in (first, ~first)]

    def _parted_in_wall(self, part: _Part, step: int, cut: float) -> list[_Part]:
        """Divide the part at a wall of a step; walls increase from step to step."""
        thin = replace(part, most=tuple(min(m, cut) if k <= step else m for k, m in enumerate(part.most)))
        thick = replace(part, least=tuple(max(m, cut) if k >= step else m for k, m in enumerate(part.least)))
        layers = [
            layer.taken(layer.table[:, FLOOR] <= most) for layer, most in zip(thin.layers, thin.most[:-1], strict=True)
        ]
        if self.half.least(np.ones(1))[0] > thin.most[-1]:
            return [thick]
        return [replace(thin, layers=layers), thick]

    def _settle(self, reach: float, least: float) -> None:
        """Polish all break points jointly on successively narrower grids."""
        free = (0.0,) * self.steps, np.full(self.steps, 1.0 if self._capped else math.inf)
        while reach > least and math.isfinite(self.walls.multiplier):
            grids = [np.unique(np.clip(t + reach * _POLISHING_GRID, 0.0, 1.0)) for t in self.places[:-1]]
            self._take(self.bounds.through(self.bounds.points(grids), *free, self.walls.multiplier).path)
            reach *= 0.25


def _spread(t: Array) -> Array:
    """Return at most about ``_MOST_POINTS`` of the positions, the first and the last included."""
    if t.size <= _MOST_POINTS:
        return t
    return t[np.linspace(0, t.size - 1, _MOST_POINTS).astype(int)]


def _undominated(layer: Cells) -> Cells:
    """Remove the cells in which a break is dominated by a later position: the next one where f or the deflection
    increases, or 1. The step before the break is the thinner one, and extends that far with the same wall."""
    return layer.taken(~layer.level | (layer.table[:, AT + 1] >= 1.0 - APART))
