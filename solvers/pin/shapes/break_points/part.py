"""A part of all steps: the cells that their break points and walls may lie in, and points that they pass."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from solvers.numerics.arrays import Array
from solvers.pin.section.flexibility import inflection
from solvers.pin.shapes.break_points.cells import BreakCells, Indices, Mask, WallCells, break_cells, lines_below, subset
from solvers.pin.shapes.break_points.half import COINCIDENT, Half
from solvers.pin.shapes.break_points.lattice import Lattice

CUT = 3
_BREAK_CELLS, _WALL_CELLS = 24, 24
_ROOM = 2.0
"""Greatest wall of a bushing with cells of its own, over a feasible one's; thicker ones count as rigid."""

Point = tuple[float, float]


@dataclass(frozen=True)
class Part:
    """Cells of break points and walls, and the ``most`` of all walls.

    ``thin`` and ``thick`` (steps - 1, m, 2): for each break point, first and past the last of the cells of walls that
    the steps before and after it may have if it lies in a cell; none if it may not. ``below`` and ``above``: points
    (t, u) that the steps pass: those that begin before t have walls of at most u, and those that end beyond t of at
    least u. ``multiplier``: the best one known.
    """

    breaks: BreakCells
    walls: WallCells
    thin: Indices
    thick: Indices
    most: float
    multiplier: float
    below: tuple[Point, ...] = ()
    above: tuple[Point, ...] = ()

    @property
    def ends(self) -> int:
        """The number of pairs of ends that are open to some step."""
        return 4 * int(sum((spans[:, :, 1] - spans[:, :, 0]).sum() for spans in (self.thin, self.thick)))

    @property
    def open_breaks(self) -> Mask:
        """Cells that each break point may lie in, (steps - 1, m)."""
        return self.thin[:, :, 1] > self.thin[:, :, 0]

    @property
    def open_walls(self) -> Mask:
        """Cells that each wall may lie in, (steps, q)."""
        shape = len(self.thick) + 1, len(self.walls.curve) + 1
        spans = np.concatenate([self.thin[:1], self.thick]) + np.arange(shape[0])[:, None, None] * shape[1]
        begins, ends = (
            np.bincount(places.ravel(), minlength=shape[0] * shape[1]) for places in spans.transpose(2, 0, 1)
        )
        return np.cumsum((begins - ends).reshape(shape), axis=1)[:, :-1] > 0

    def compacted(self) -> Part:
        """Return the part without the cells that are open to no step."""
        kept, walls = self.open_breaks.any(axis=0), self.open_walls.any(axis=0)
        number = np.append(np.where(kept, np.cumsum(kept) - 1, -1), -1)
        return replace(
            self, breaks=subset(self.breaks, kept),
            walls=subset(self.walls._replace(curve=number[self.walls.curve]), walls),
            thin=_before(walls)[self.thin[:, kept]], thick=_before(walls)[self.thick[:, kept]],
        )  # fmt: skip

    def cut(self, half: Half, cut_breaks: Mask, cut_walls: Mask) -> Part:
        """Return the part with these cells cut in ``CUT``, those of the curve together."""
        old, walls, pieces = self.breaks, self.walls, np.arange(CUT)
        on_curve, wide = walls.curve >= 0, walls.ends[:, 1] > walls.ends[:, 0]
        cut_breaks = cut_breaks.copy()
        cut_breaks[walls.curve[on_curve & cut_walls]] = True
        cut_walls = wide & np.where(on_curve, np.append(cut_breaks, False)[walls.curve], cut_walls)

        counts, wall_counts = np.where(cut_breaks, CUT, 1), np.where(cut_walls, CUT, 1)
        begins, h = np.cumsum(counts) - counts, old.h[cut_breaks] / CUT
        made = break_cells(half, (old.t[cut_breaks, None] + h[:, None] * pieces).ravel(), np.repeat(h, CUT))
        # The outer ends of the curve stay where they were, so that the cells of walls still cover what they did.
        curve = np.concatenate(
            [old.f[cut_breaks, :1], made.f[:, 0].reshape(-1, CUT)[:, 1:], old.f[cut_breaks, 1:]], axis=1
        )
        curve = np.maximum.accumulate(np.minimum(curve, curve[:, -1:]), axis=1)
        f = np.stack([curve[:, :-1].ravel(), curve[:, 1:].ravel()], axis=1)
        made = made._replace(f=f, sag=made.sag + np.maximum(f - made.f, 0.0).max(axis=1, initial=0.0))
        breaks = BreakCells(*(np.repeat(values, counts, axis=0) for values in old))
        for values, new in zip(breaks, made, strict=True):
            values[np.repeat(cut_breaks, counts)] = new

        knots, both = np.linspace(walls.ends[:, 0], walls.ends[:, 1], CUT + 1, axis=1), on_curve & cut_walls
        knots[both] = curve[(np.cumsum(cut_breaks) - 1)[walls.curve[both]]]
        is_new, ends = np.repeat(cut_walls, wall_counts), np.repeat(walls.ends, wall_counts, axis=0)
        ends[is_new] = np.stack([knots[cut_walls, :-1].ravel(), knots[cut_walls, 1:].ravel()], axis=1)
        number = np.repeat(np.where(on_curve, begins[walls.curve], -1), wall_counts)
        number[is_new] += np.where(number[is_new] >= 0, np.tile(pieces, np.count_nonzero(cut_walls)), 0)
        kept = (ends[:, 1] > ends[:, 0]) | ~is_new
        begin = _before(kept)[_before(wall_counts)]
        thin, thick = (
            begin[np.repeat(spans, counts, axis=1)] * _undominated(breaks)[:, None] for spans in (self.thin, self.thick)
        )
        walls = WallCells(ends[kept], number[kept])
        return replace(self, breaks=breaks, walls=walls, thin=thin, thick=thick).compacted()

    def lattice(self, half: Half) -> Lattice:
        """Return the lattice of the cells' ends."""
        cells, walls, limited = self.breaks, self.walls, half.sums is not None
        t = np.stack([cells.t, np.minimum(cells.t + cells.h, 1.0)], axis=1).ravel()
        least = np.where(np.isinf(cells.sag)[:, None], cells.f[:, :1], cells.f).ravel()
        most, least_last = np.full(t.size, np.inf), float(half.peaks[-1])
        for place, wall in self.above:
            least, least_last = np.where(t > place, np.maximum(least, wall), least), max(least_last, wall)
        for place, wall in self.below:
            most = np.where(t < place, np.minimum(most, wall), most)
        (f, g), depth = np.zeros((2, walls.ends.size)), np.zeros_like(walls.ends)
        b_last, s_last = half.sums.integrals(np.ones(1))[:, 0].tolist() if limited else (0.0, 0.0)
        if limited:
            (f, g), depth = lines_below(walls.ends, self.most, _concave_from(half), half.program.law)
        row = _before(4 * np.diff(self.thin).ravel())
        b, s = np.ascontiguousarray((cells.sums - cells.depth[:, :, None]).swapaxes(0, 1)).reshape(2, -1)
        return Lattice(
            t, b, s, least, most, cells.sag, cells.depth, walls.ends.ravel(), f, g, walls.curve, depth,
            self.thin, self.thick, row[:-1].reshape(self.thin.shape[:2]), int(row[-1]), b_last, s_last, least_last,
            min((wall for _, wall in self.below), default=math.inf),
        )  # fmt: skip


def all_steps(half: Half, steps: int, thickest: float) -> Part:
    """Return the cells for all steps; ``thickest``: the greatest wall of a feasible bushing."""
    edges = half.edges(_BREAK_CELLS)
    cells, low = break_cells(half, edges[:-1], np.diff(edges)), float(half.peaks[-1])
    # From cell to cell f may jump, and otherwise differs only by rounding.
    after = np.append(cells.f[1:, 0], low)
    near = after - cells.f[:, 1] <= 1e-9 * after
    f = np.stack([cells.f[:, 0], np.where(near, after, cells.f[:, 1])], axis=1)
    cells = cells._replace(f=f, sag=cells.sag + np.maximum(f[:, 1] - cells.f[:, 1], 0.0))
    if half.sums is None:
        most, knots = low, np.full(2, low)
    elif half.program.variable.kappa < 0.0:
        most, knots = math.inf, np.append(np.geomspace(low, 1.0, _WALL_CELLS + 1), max(_concave_from(half), low))
    else:
        most = _ROOM * thickest
        knots = np.append(np.geomspace(low, most, _WALL_CELLS + 1), most)
    knots = np.sort(knots)
    rising, jumps = np.flatnonzero(f[:, 1] > f[:, 0]), np.flatnonzero(after > f[:, 1])
    ends = np.concatenate(
        [f[rising], np.stack([f[jumps, 1], after[jumps]], axis=1), np.stack([knots[:-1], knots[1:]], axis=1)]
    )
    curve = np.append(rising, np.full(len(ends) - rising.size, -1))
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    every = np.tile(_undominated(cells)[:, None] * np.array([0, len(ends)]), (steps - 1, 1, 1))
    walls = WallCells(ends[order], curve[order])
    return Part(cells, walls, every, every, most, 0.0 if half.sums is None else 0.5).compacted()


def _before(counts: Array) -> Indices:
    """Return the sum of all counts before each, and of all."""
    return np.append(0, np.cumsum(counts))


def _concave_from(half: Half) -> float:
    """Return the wall from which the flexibility in shear is concave."""
    return inflection(half.program.scene.material.poisson) if half.program.variable.kappa < 0.0 else math.inf


def _undominated(cells: BreakCells) -> Mask:
    """Mark all cells but those in which every break point is dominated by a later position: the next one where f or the
    deflection coefficients increase, or 1. The thinner step before it can extend that far with the same wall."""
    return ~cells.constant | (cells.t + cells.h >= 1.0 - COINCIDENT)


def snapped(value: float, ends: Array) -> float:
    """Return the value, or the nearer end of the cell in which it lies."""
    inside = np.flatnonzero((ends[::2] < value) & (value < ends[1::2]))
    if not inside.size:
        return value
    low, high = ends[2 * inside[0] : 2 * inside[0] + 2].tolist()
    return low if value - low < high - value else high
