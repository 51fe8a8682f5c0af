"""Branch and bound for the lightest steps over all break points.

Without a deflection limit, or for a fixed multiplier, the mass is a sum over neighbouring break points, so dynamic
programming through cells (``solvers.pin.shapes.break_points.paths``) bounds all choices of break points, and through
the cells' ends yields incumbents. Cells through which no path beats the incumbent are pruned; the others are cut in
four. The bound's error decreases with the square of the cells' width, so few cells around the optimum remain.

The bound is valid for every multiplier lambda >= 0, and is maximised over lambda on the cells' ends. If the maximum
stays below the incumbent's mass (a duality gap), the cheapest paths on either side of the best multiplier differ: one
is too soft, the other too stiff. The search node is then branched between them, in the break point on which they
differ most, or in a step's wall: near the solid section, where the flexibility is concave, the cheapest wall jumps at
fixed break points. Where such a path's walls wrongly decrease toward the middle, the node is branched at a wall between
the two. The child nodes are examined with their own multipliers, lowest bound first.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from solvers.numerics.arrays import Array
from solvers.pin.optimum.lagrangian import multiplier_evidence
from solvers.pin.section.flexibility import inflection
from solvers.pin.shapes.break_points.bounds import Bounds, DualBound, PathBound
from solvers.pin.shapes.break_points.cells import CUT, Cells, cells, split_cells
from solvers.pin.shapes.break_points.half import COINCIDENT, Half, Steps
from solvers.pin.shapes.break_points.paths import FLOOR, POSITION

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
_WALLS_WORK, _CELL_WORK = 100_000, 2_000
"""Work, in cost evaluations, of computing the walls of one path, and the bounds of one cell."""
_DUAL_TOLERANCE, _EXPECTED_PROGRESS = 0.05, 0.1
"""Tolerance of the dual maximum as a fraction of the requested gap or of the next expected gap, and the latter as a
fraction of the node's present gap."""
_BREAK_POINT_TOLERANCE = 1e-2
"""Break point tolerance as a fraction of the gap's square root; the mass, stationary there, converges to its square."""
_ROUNDING = 1e-12
"""Relative rounding error of a bound."""


Evidence = dict[str, float | int | str]
"""Statistics of a search."""


def lightest_steps(
    half: Half, steps: int, known_bound: float = 0.0, gap: float = GAP
) -> tuple[Steps, float, Evidence] | None:
    """Find the lightest steps, with a lower bound of all such steps, within ``gap`` unless the work limit is reached,
    and statistics of the search; None if infeasible.

    ``known_bound`` is a lower bound from a relaxation.
    """
    even = _even(half, steps)
    if even is None:
        return None
    if even.multiplier == 0.0:
        # Probably the limit is not binding.
        free = Half(replace(half.program, limit=None), half.solid_from)
        found = _Search(free, _even(free, steps), gap).close(known_bound)
        if half.lightest_walls(found[0].places).multiplier == 0.0:
            return found
    return _Search(half, even, gap).close(known_bound)


def _even(half: Half, steps: int) -> Steps | None:
    """Return steps of equal length with their lightest walls; None if infeasible."""
    return half.lightest_walls(np.arange(1, steps + 1) / steps)


@dataclass(frozen=True)
class _Node:
    """A node of the search tree: cells of every break point, bounds of every step's wall, initial multiplier."""

    layers: list[Cells]
    least: tuple[float, ...]
    most: tuple[float, ...]
    multiplier: float

    @property
    def width(self) -> float:
        return max((float(layer.h.max()) for layer in self.layers), default=0.0)


class _Search:
    """One search for steps and a bound within ``gap``, beginning with ``best``, the incumbent."""

    def __init__(self, half: Half, best: Steps, gap: float) -> None:
        self.half, self.best, self.steps, self.gap, self.bounds = half, best, best.walls.size, gap, Bounds(half)
        self.limited = half.sums is not None
        self.work, self.most_work = 0, _MOST_WORK * self.steps
        own = half.program
        self._capped = self.limited and own.variable.kappa < 0.0
        self._concave_from = inflection(own.scene.material.poisson) if self._capped else math.inf

    def close(self, known_bound: float) -> tuple[Steps, float, Evidence]:
        """Bound, refine and branch, lowest bound first."""
        count = max(_INITIAL_CELLS[self.limited] * min(GAP / self.gap, 1.0) ** _COARSENING_EXPONENT, _MIN_CELLS)
        edges = self.half.edges(math.ceil(count))
        first = _undominated(cells(self.half, edges[:-1], np.diff(edges)))
        root = _Node(
            [first] * (self.steps - 1), (0.0,) * self.steps, (1.0 if self._capped else math.inf,) * self.steps,
            0.5 if self.limited else 0.0,
        )  # fmt: skip
        queue, final_bound, count, width = [(known_bound, 0, root)], math.inf, 0, root.width
        while queue:
            bound, _, node = heapq.heappop(queue)
            if self._is_closed(bound) or self.work > self.most_work:
                final_bound = min(final_bound, bound)
                break
            dual_bound, node = self._improve(node, bound)
            if self.steps == 1 or not math.isfinite(self.best.multiplier):
                final_bound = self.best.volume * (1.0 - _ROUNDING) if math.isfinite(self.best.multiplier) else bound
                break
            found, bound = self._bound(node, bound)
            kept = self._pruned(node, found)
            if self._is_closed(bound) or not all(layer.t.size for layer in kept.layers):
                final_bound = min(final_bound, bound)
                continue
            branches = self._branch(kept, dual_bound, bound)
            if not branches:
                # Too many cells: this node's bound is final.
                final_bound = min(final_bound, bound)
            for child in branches:
                if not all(layer.t.size for layer in child.layers):
                    # The remaining cells of a break point are dominated by others, which have their own bounds.
                    continue
                count += 1
                width = min(width, child.width)
                heapq.heappush(queue, (bound, count, child))
        self._polish(width, _BREAK_POINT_TOLERANCE * math.sqrt(self.gap))
        best, bound = self.best, min([final_bound, self.best.volume, *(entry[0] for entry in queue)])
        multiplier = multiplier_evidence(best.multiplier)
        return best, bound, {"steps": self.steps, "parts": count + 1, "work": self.work, "multiplier": multiplier}

    def _is_closed(self, bound: float) -> bool:
        return bound >= self.best.volume * (1.0 - self.gap)

    def _bound(self, node: _Node, bound: float) -> tuple[PathBound, float]:
        """Return the path bound through the node's cells, and the node's bound; try the cheapest path as incumbent."""
        found = self.bounds.path_bound(node.layers, node.least, np.array(node.most), node.multiplier)
        self.work += found.work
        if (np.diff(found.path) >= 0.0).all():
            self._try(found.path)
        return found, max(bound, (found.total - node.multiplier) * (1.0 - _ROUNDING))

    def _pruned(self, node: _Node, found: PathBound) -> _Node:
        """Return the node with only those cells that may contain an improvement of the incumbent."""
        worst = node.multiplier + self.best.volume * (1.0 + _ROUNDING)
        kept = [layer.subset(cost <= worst) for layer, cost in zip(node.layers, found.each, strict=True)]
        return replace(node, layers=kept)

    def _improve(self, node: _Node, bound: float) -> tuple[DualBound | None, _Node]:
        """Update the incumbent from paths through the cells' ends, and the node's multiplier."""
        distinct = {id(layer): layer for layer in node.layers}
        places = [_thinned(np.unique(layer.table[:, :2])) for layer in distinct.values()]
        own = dict(zip(distinct, self.bounds.points(places), strict=True)) if places else {}
        ends, most = [own[id(layer)] for layer in node.layers], np.array(node.most)
        if not self.limited:
            found = self.bounds.path_bound(ends, node.least, most, 0.0)
            self.work += found.work
            self._try(found.path)
            return None, node
        volume = self.best.volume
        tolerance = _DUAL_TOLERANCE * max(self.gap * volume, _EXPECTED_PROGRESS * (volume - bound))
        dual_bound = self.bounds.dual_bound(ends, node.least, most, node.multiplier, tolerance, volume)
        self.work += dual_bound.work
        if math.isfinite(dual_bound.value):
            self._try(dual_bound.stiff[0])
            self._try(dual_bound.soft[0])
            node = replace(node, multiplier=dual_bound.multiplier)
        return dual_bound, node

    def _try(self, places: Array) -> None:
        """Compute the walls of steps, and keep them as incumbent if they are the lightest so far."""
        self.work += _WALLS_WORK
        found = self.half.lightest_walls(places)
        if found is not None and found.volume < self.best.volume:
            self.best = found

    def _branch(self, kept: _Node, dual_bound: DualBound | None, bound: float) -> list[_Node]:
        """Return the node with its cells refined, or its child nodes if the duality gap dominates."""
        if dual_bound is not None:
            missing = self.best.volume - dual_bound.value
            if missing > max(self.gap * self.best.volume, 0.5 * (self.best.volume - bound)):
                branches = self._branch_at_gap(kept, dual_bound)
                if branches:
                    return branches
        pairs = sum(CUT * CUT * a.t.size * b.t.size for a, b in pairwise(kept.layers))
        work = _CELL_WORK * CUT * sum(layer.t.size for layer in kept.layers)
        if pairs > _MOST_PAIRS or self.work + work > self.most_work:
            return []
        self.work += work
        split = split_cells(self.half, kept.layers)
        return [replace(kept, layers=[_undominated(layer) for layer in split])]

    def _branch_at_gap(self, node: _Node, dual_bound: DualBound) -> list[_Node]:
        """Branch where a path's walls wrongly decrease most; otherwise between the soft and the stiff path, in a wall
        or in a break point. Empty if the paths differ by no more than the cells' width."""
        decrease, step, middle = max(
            (path[1, k] - path[1, k + 1], k, 0.5 * (path[1, k] + path[1, k + 1]))
            for path in (dual_bound.soft, dual_bound.stiff)
            for k in range(self.steps - 1)
        )
        places, walls = np.abs(dual_bound.stiff - dual_bound.soft)
        if decrease > 0.5 * max(places.max(), walls.max(), COINCIDENT):
            return self._branch_at_wall(node, step, middle)
        walls[np.maximum(dual_bound.stiff[1], dual_bound.soft[1]) <= self._concave_from] = 0.0
        thin, at = int(np.argmax(walls)), int(np.argmax(places))
        if walls[thin] > max(places[at], COINCIDENT):
            return self._branch_at_wall(node, thin, 0.5 * (dual_bound.soft[1, thin] + dual_bound.stiff[1, thin]))
        if places[at] <= 2.0 * node.width:
            return []
        return self._branch_at_break_point(node, at, 0.5 * (dual_bound.soft[0, at] + dual_bound.stiff[0, at]))

    def _branch_at_break_point(self, node: _Node, at: int, middle: float) -> list[_Node]:
        """Branch the node at a position of a break point."""
        layers, own = node.layers, node.layers[at]
        first = own.t + 0.5 * own.h < middle
        if first.all() or not first.any():
            return []
        return [replace(node, layers=[*layers[:at], own.subset(side), *layers[at + 1 :]]) for side in (first, ~first)]

    def _branch_at_wall(self, node: _Node, step: int, cut: float) -> list[_Node]:
        """Branch the node at a wall of a step; walls increase from step to step."""
        thin = replace(node, most=tuple(min(m, cut) if k <= step else m for k, m in enumerate(node.most)))
        thick = replace(node, least=tuple(max(m, cut) if k >= step else m for k, m in enumerate(node.least)))
        layers = [
            layer.subset(layer.table[:, FLOOR] <= most) for layer, most in zip(thin.layers, thin.most[:-1], strict=True)
        ]
        if self.half.lower_bound(np.ones(1))[0] > thin.most[-1]:
            return [thick]
        return [replace(thin, layers=layers), thick]

    def _polish(self, reach: float, least: float) -> None:
        """Polish all break points jointly on successively narrower grids."""
        free = (0.0,) * self.steps, np.full(self.steps, 1.0 if self._capped else math.inf)
        while reach > least and math.isfinite(self.best.multiplier):
            grids = [np.unique(np.clip(t + reach * _POLISHING_GRID, 0.0, 1.0)) for t in self.best.places[:-1]]
            self._try(self.bounds.path_bound(self.bounds.points(grids), *free, self.best.multiplier).path)
            reach *= 0.25


def _thinned(t: Array) -> Array:
    """Return at most ``_MOST_POINTS`` of the positions, evenly selected, the first and the last included."""
    if t.size <= _MOST_POINTS:
        return t
    return t[np.linspace(0, t.size - 1, _MOST_POINTS).astype(int)]


def _undominated(layer: Cells) -> Cells:
    """Remove the cells in which every break point is dominated by a later position: the next one where f or the
    deflection coefficients increase, or 1. The thinner step before it can extend that far with the same wall."""
    return layer.subset(~layer.constant | (layer.table[:, POSITION + 1] >= 1.0 - COINCIDENT))
