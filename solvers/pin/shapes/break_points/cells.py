"""Cells for break points, with bounds of walls and deflection coefficients."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.arrays import Array
from solvers.pin.shapes.break_points.half import Half, Sums
from solvers.pin.shapes.break_points.paths import BENDING, COLUMNS, FLOOR, POSITION, SHEAR

CUT = 4
_SAMPLES = np.linspace(0.0, 1.0, 17)
_SAFETY_FACTOR = 2.0
"""Safety factor on the sag of a curve below its chord between two samples."""


@dataclass(frozen=True)
class Cells:
    """Ordered cells [t, t + h], n of them, and ``table`` of shape (n, COLUMNS), laid out as in
    ``solvers.pin.shapes.break_points.paths``.

    ``constant`` marks the cells in which f, B and S are constant.
    """

    t: Array
    h: Array
    constant: NDArray[np.bool_]
    table: Array

    def with_floor(self, least: float) -> Cells:
        """Return the cells with walls of at least ``least``; in a cell where f crosses ``least``, f is ignored."""
        below = self.table[:, FLOOR] < least
        if not below.any():
            return self
        table = self.table.copy()
        table[below, FLOOR : FLOOR + 2] = least
        return replace(self, table=table)

    def subset(self, which: NDArray[np.bool_] | slice) -> Cells:
        """Return a subset of the cells."""
        return Cells(self.t[which], self.h[which], self.constant[which], self.table[which])

    def split(self, counts: list[int]) -> list[Cells]:
        """Return consecutive groups of the cells."""
        ends = np.cumsum(counts)
        return [self.subset(slice(end - count, end)) for count, end in zip(counts, ends, strict=True)]


def points(half: Half, t: Array) -> Cells:
    """Return cells of zero width, with exact f, B and S."""
    table = np.zeros((t.size, COLUMNS))
    table[:, POSITION : POSITION + 2] = t[:, None]
    table[:, FLOOR : FLOOR + 2] = half.lower_bound(t)[:, None]
    if half.sums is not None:
        bent, sheared = half.sums.integrals(t)
        table[:, BENDING : BENDING + 2], table[:, SHEAR : SHEAR + 2] = bent[:, None], sheared[:, None]
    return Cells(t, np.zeros_like(t), np.zeros(t.size, dtype=bool), table)


def cells(half: Half, t: Array, h: Array) -> Cells:
    """Return cells [t, t + h], with bounds from samples inside each."""
    grid = t[:, None] + h[:, None] * _SAMPLES
    grid[:, -1] = np.minimum(t + h, 1.0)
    level = half.lower_bound(grid.ravel()).reshape(grid.shape)
    table = np.zeros((t.size, COLUMNS))
    table[:, POSITION : POSITION + 2] = grid[:, [0, -1]]
    # f is non-decreasing; a kink between two samples shows in the adjacent second differences.
    bend = np.maximum(np.diff(level, 2, axis=1), 0.0)
    sag = 0.25 * _SAFETY_FACTOR * (np.pad(bend, ((0, 0), (0, 1))) + np.pad(bend, ((0, 0), (1, 0)))).max(axis=1)
    first, last = level[:, 0], level[:, -1]
    low = first - (first[:, None] + (last - first)[:, None] * _SAMPLES - level).max(axis=1) - sag
    # Where f jumps in a cell, such as at its end, the line would lie below f's first value.
    flat = low < np.maximum(0.5 * first, first - 0.5 * (last - first))
    table[:, FLOOR] = np.where(flat, first, low)
    table[:, FLOOR + 1] = np.where(flat, first, low + (last - first))
    unchanged = np.ones(t.size, dtype=bool)
    if half.sums is not None:
        value = half.sums.integrals(grid.ravel()).reshape(2, *grid.shape)
        table[:, BENDING : BENDING + 2], table[:, SHEAR : SHEAR + 2] = _lines_below(grid, value, half.sums)
        unchanged = np.all(value[:, :, 0] == value[:, :, -1], axis=0)
    return Cells(t, h, (last <= first) & unchanged, table)


def _lines_below(grid: Array, value: Array, sums: Sums) -> Array:
    """Return chords of B and S shifted down to be lower bounds: values at both ends, (2, n, 2)."""
    begin, end = grid[:, 0], grid[:, -1]
    wide = end - begin
    # Densities may jump at a cell's ends, so they are sampled inside.
    inside = begin[:, None] + wide[:, None] * (0.5 * (_SAMPLES[:-1] + _SAMPLES[1:]))
    density = sums.density(inside.ravel()).reshape(2, *inside.shape)
    first, last = value[:, :, :1], value[:, :, -1:]
    short = (first + (last - first) * _SAMPLES - value).max(axis=2)
    # Between two samples the integral lies below its chord by a quarter of the slope increase times their distance.
    increase = np.maximum(np.diff(density, axis=2).max(axis=2), 0.0)
    sag = 0.25 * _SAFETY_FACTOR * wide * _SAMPLES[1] * increase
    ends = np.concatenate([first, last], axis=2) - (short + sag)[:, :, None]
    # Lines of adjacent cells share the lower end value: a drop from one to the next would be a spurious gain.
    meet = np.flatnonzero(begin[1:] == end[:-1])
    ends[:, meet, 1] = ends[:, meet + 1, 0] = np.minimum(ends[:, meet, 1], ends[:, meet + 1, 0])
    return ends


def split_cells(half: Half, old: list[Cells]) -> list[Cells]:
    """Split the cells of every layer into CUT parts each."""
    t, h = (np.concatenate([getattr(layer, name) for layer in old]) for name in ("t", "h"))
    h = h / CUT
    start = (t[:, None] + h[:, None] * np.arange(CUT)).ravel()
    return cells(half, start, np.repeat(h, CUT)).split([CUT * layer.t.size for layer in old])
