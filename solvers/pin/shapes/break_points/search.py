"""Branch and bound for the lightest steps over all break points and walls.

With a multiplier for the deflection limit the mass is a sum over steps, so dynamic programming through the ends of
cells of break points and walls (``solvers.pin.shapes.break_points.lattice``) bounds all steps through these cells.
Cells through which no steps cost less than the lightest known are closed; those that lower the bound most are cut. The
bound's error decreases with the square of the cells' width, so few cells around the optimum remain.

The bound is valid for every multiplier lambda >= 0, and is maximised over lambda. If the maximum stays below the mass
by more than the cells explain (a duality gap), the cheapest steps on either side of the best multiplier differ: one is
too soft, the other too stiff. Then the part is divided at a point (t, u) between the two, into steps that pass below
and above it, which have multipliers of their own. Parts are examined lowest bound first.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import replace

import numpy as np

from solvers.numerics.arrays import Array
from solvers.pin.optimum.lagrangian import multiplier_evidence
from solvers.pin.section.flexibility import densities
from solvers.pin.shapes.break_points.cells import Indices, Mask
from solvers.pin.shapes.break_points.half import COINCIDENT, Half, Steps
from solvers.pin.shapes.break_points.lattice import Lattice, dues, maximise_dual, prune
from solvers.pin.shapes.break_points.part import Part, Point, all_steps, snapped

GAP = 9e-8
"""Relative gap at convergence, regardless of the accuracy requested for the mass itself."""
_MOST_WORK, _MOST_SIZE = 30_000_000, 20_000_000
"""Maximum work per step, about 50 ms, in ends of cells times trials of the multiplier, and maximum size of the costs of
one lattice."""
_EXAMINATION, _TRIALS = 500_000, 4
"""Work of examining a part, whatever its size, and trials expected."""
_DUAL_TOLERANCE, _EXPECTED_PROGRESS = 0.05, 0.1
"""Tolerance of the dual maximum as a fraction of the requested gap or of the next expected gap, and the latter as a
fraction of the part's present gap."""
_SHARE = 0.1
"""Cells are cut that lower the bound by this share of what one of them does, or more."""
_POLISH, _WORTH = 0.2, 0.01
"""Distance of the break points tried last, over the width of their cells, after that width itself; gain from which they
are tried, over the gap."""
_ROUNDING = 1e-12
"""Relative rounding error of a bound."""

Evidence = dict[str, float | int | str]
"""Statistics of a search."""


def lightest_steps(half: Half, steps: int, gap: float = GAP) -> tuple[Steps, float, Evidence] | None:
    """Find the lightest steps, with a lower bound of all such steps, within ``gap`` unless the work limit is reached,
    and statistics of the search; None if infeasible."""
    even = _even(half, steps)
    if even is None:
        return None
    if even.multiplier == 0.0:
        # Probably the limit is not binding.
        free = Half(replace(half.program, limit=None), half.solid_from)
        found = _Search(free, _even(free, steps), gap).close()
        if half.lightest_walls(found[0].places).multiplier == 0.0:
            return found
    return _Search(half, even, gap).close()


def _even(half: Half, steps: int) -> Steps | None:
    """Return steps of equal length with their lightest walls; None if infeasible."""
    return half.lightest_walls(np.arange(1, steps + 1) / steps)


class _Search:
    """One search for steps and a bound within ``gap``, beginning with ``best``, the incumbent."""

    def __init__(self, half: Half, best: Steps, gap: float) -> None:
        self.half, self.best, self.steps, self.gap = half, best, best.walls.size, gap
        self.work, self.most_work = 0, _MOST_WORK * self.steps
        self.reach = np.empty(0)

    def close(self) -> tuple[Steps, float, Evidence]:
        """Bound, cut and divide, lowest bound first."""
        queue: list[tuple[float, int, Part]] = []
        final_bound, count = 0.0, 1
        if self.steps == 1 and math.isfinite(self.best.multiplier):
            final_bound = self.best.volume * (1.0 - _ROUNDING)
        elif math.isfinite(self.best.multiplier):
            final_bound = math.inf
            queue = [(0.0, 0, all_steps(self.half, self.steps, float(self.best.walls[-1])))]
        while queue and not self._is_closed(queue[0][0]) and self.work <= self.most_work:
            bound, _, part = heapq.heappop(queue)
            bound, children = self._examine(part, bound)
            if not children:
                final_bound = min(final_bound, bound)
            for child in children:
                heapq.heappush(queue, (bound, count, child))
                count += 1
        self._polish()
        best, bound = self.best, min([final_bound, self.best.volume, *(entry[0] for entry in queue)])
        multiplier = multiplier_evidence(best.multiplier)
        return best, bound, {"steps": self.steps, "parts": count, "work": self.work, "multiplier": multiplier}

    def _is_closed(self, bound: float) -> bool:
        return bound >= self.best.volume * (1.0 - self.gap)

    def _examine(self, part: Part, bound: float) -> tuple[float, list[Part]]:
        """Return the bound of a part, given one, and the parts that it is divided or cut into; none if it is closed or
        cannot be cut further."""
        lat, limited, volume = part.lattice(self.half), self.half.sums is not None, self.best.volume
        come, paths = np.empty(lat.row_last + lat.u.size), np.empty((2, 2, self.steps), dtype=np.int64)
        tolerance = _DUAL_TOLERANCE * max(self.gap * volume, _EXPECTED_PROGRESS * (volume - bound))
        lam, value, trials = maximise_dual(
            lat, come, part.multiplier, tolerance if limited else math.inf, volume, *paths
        )
        self.work += _EXAMINATION + (trials + 1) * part.ends
        if value == math.inf:
            return value, []
        bound = max(bound, value - _ROUNDING * (volume + lam))
        self._try_between(lat, *paths)
        self.reach = part.breaks.h[paths[1, 0, :-1] // 2]
        if self._is_closed(bound):
            return bound, []
        thin, thick = np.empty_like(lat.thin), np.empty_like(lat.thick)
        prune(lam, lat, come, (lam + self.best.volume) * (1.0 + _ROUNDING), thin, thick)
        child = replace(part, thin=thin, thick=thick, multiplier=lam)
        if not child.open_breaks.any(axis=1).all():
            return math.inf, []
        counted = min(self._counted(lat, path, lam) for path in paths)
        point = self._between(lat, *paths) if self.best.volume - counted > counted - value else None
        if point is not None:
            child = child.compacted()
            return bound, [replace(child, below=(*part.below, point)), replace(child, above=(*part.above, point))]
        child = child.cut(self.half, *self._widest(child, lat, paths))
        return bound, [child] if child.ends <= _MOST_SIZE and _TRIALS * child.ends <= self.most_work - self.work else []

    def _try_between(self, lat: Lattice, soft: Indices, stiff: Indices) -> None:
        """Try the break points of the stiff steps, and those between soft and stiff ones that just meet the limit."""
        self._try(lat.t[stiff[0, :-1]])
        if self.half.sums is None or (soft[0] == stiff[0]).all():
            return
        over, under = self._deflection(lat, soft) - 1.0, self._deflection(lat, stiff) - 1.0
        if under < 0.0 < over < math.inf:
            share = under / (under - over)
            self._try((1.0 - share) * lat.t[stiff[0, :-1]] + share * lat.t[soft[0, :-1]])

    def _try(self, places: Array) -> float:
        """Compute the walls of steps, keep them as incumbent if they are the lightest so far, and return their volume;
        inf if there are none."""
        # Where f jumps, the step before may only come close.
        places = np.maximum.accumulate(np.clip(places - COINCIDENT, 0.0, 1.0))
        found = self.half.lightest_walls(np.append(places, 1.0))
        if found is not None and found.volume < self.best.volume:
            self.best = found
        return math.inf if found is None else found.volume

    def _polish(self) -> None:
        """Try each break point at the vertex of a parabola through volumes a cell's width, then a fifth of it apart, if
        the former reduced it noticeably."""
        for share in (1.0, _POLISH):
            start = self.best.volume
            for step in np.diag(share * self.reach):
                places, volume = self.best.places[:-1], self.best.volume
                before, behind = self._try(places - step), self._try(places + step)
                if volume < min(before, behind) < math.inf > max(before, behind):
                    self._try(places + 0.5 * (before - behind) / (before - 2.0 * volume + behind) * step)
            if start - self.best.volume <= _WORTH * self.gap * start:
                break

    def _deflection(self, lat: Lattice, path: Indices) -> float:
        """Return the deflection of steps over its limit."""
        t, walls = np.concatenate([[0.0], lat.t[path[0, :-1]], [1.0]]), lat.u[path[1]]
        return float(densities(walls, *np.diff(self.half.sums.integrals(t), axis=1), self.half.program.law).sum())

    def _counted(self, lat: Lattice, path: Indices, lam: float) -> float:
        """Return the cost of steps with nothing deducted for cells."""
        volume = float(np.diff(lat.t[path[0, :-1]], prepend=0.0, append=1.0) @ lat.u[path[1]])
        return volume + lam * (self._deflection(lat, path) - 1.0) if lam > 0.0 else volume

    def _between(self, lat: Lattice, soft: Indices, stiff: Indices) -> Point | None:
        """Return a point in the largest area between two steps; None if no end of a cell lies there."""
        places = [np.append(lat.t[path[0, :-1]], 1.0) for path in (soft, stiff)]
        edges = np.unique(np.concatenate([[0.0], *places]))
        middles = 0.5 * (edges[:-1] + edges[1:])
        walls = np.sort(
            [lat.u[path[1][np.searchsorted(t, middles)]] for t, path in zip(places, (soft, stiff), strict=True)], axis=0
        )
        k = int(np.argmax(np.diff(edges) * (walls[1] - walls[0])))
        t, u = snapped(float(middles[k]), lat.t), snapped(float(walls[:, k].mean()), lat.u)
        return (t, u) if edges[k] < t < edges[k + 1] and walls[0, k] < u < walls[1, k] else None

    def _widest(self, part: Part, lat: Lattice, paths: Indices) -> tuple[Mask, Mask]:
        """Mark, for each break point and wall whose cells lower the bound most, those open to it that are as wide."""
        due = np.empty((2, 2, self.steps))
        for path, out in zip(paths, due, strict=True):
            dues(part.multiplier, lat, path, out)
        cut_breaks, cut_walls = np.zeros(lat.sag.size, dtype=bool), np.zeros(lat.curve.size, dtype=bool)
        h, wide, least = part.breaks.h, np.diff(part.walls.ends, axis=1)[:, 0], _SHARE * due.max()
        if least <= 0.0:
            return ~cut_breaks, ~cut_walls
        open_breaks, open_walls = part.open_breaks, part.open_walls
        for which, kind, k in np.argwhere(due >= least):
            cell = paths[which, kind, k] // 2
            if kind == 0:
                cut_breaks |= open_breaks[k] & (h >= h[cell] * (1.0 - _ROUNDING))
            else:
                cut_walls |= open_walls[k] & (wide >= wide[cell] * (1.0 - _ROUNDING))
        return cut_breaks, cut_walls
