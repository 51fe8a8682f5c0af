"""Cells for break points, with bounds of walls and deflection coefficients."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.pin.shapes.break_points.bar import Bar, Sums
from solvers.pin.shapes.break_points.paths import AT, BENT, FLOOR, PRICE, ROWS, SHEARED

Array = NDArray[np.float64]

CUT = 4
_SAMPLES = np.linspace(0.0, 1.0, 17)


@dataclass(frozen=True)
class Cells:
    """Ordered cells [t, t + h], n of them, and ``table`` of shape (ROWS, n), laid out as in
    ``solvers.pin.shapes.break_points.paths``.

    ``level`` marks the cells in which f, B and S are constant. The price of length in the table is t itself unless
    set by ``priced``.
    """

    t: Array
    h: Array
    level: NDArray[np.bool_]
    table: Array

    def priced(self, at: Array, extra: Array) -> Cells:
        """Return the cells with ``extra``, piecewise linear between positions ``at``, added to the price of length."""
        table = self.table.copy()
        for end in (0, 1):
            table[PRICE + end] = table[AT + end] + np.interp(table[AT + end], at, extra)
        return replace(self, table=table)

    def taken(self, which: NDArray[np.bool_]) -> Cells:
        """Return a subset of the cells."""
        return Cells(self.t[which], self.h[which], self.level[which], np.ascontiguousarray(self.table[:, which]))


def points(bar: Bar, t: Array, sums: Sums | None) -> Cells:
    """Return cells of zero width, with exact f, B and S."""
    table = np.zeros((ROWS, t.size))
    table[AT : AT + 2] = table[PRICE : PRICE + 2] = t
    table[FLOOR : FLOOR + 2] = bar.least(t)
    if sums is not None:
        table[BENT : BENT + 2], table[SHEARED : SHEARED + 2] = sums.upto(t)[:, None, :]
    return Cells(t, np.zeros_like(t), np.zeros(t.size, dtype=bool), table)


def cells(bar: Bar, t: Array, h: Array, looks: int, sums: Sums | None) -> Cells:
    """Return cells of width h from t, sampled at ``looks`` subintervals each."""
    part = np.arange(looks + 1) / looks
    grid = t[:, None] + h[:, None] * part
    grid[:, -1] = np.minimum(t + h, 1.0)
    level = bar.least(grid.ravel()).reshape(grid.shape)
    table = np.zeros((ROWS, t.size))
    table[AT], table[AT + 1] = grid[:, 0], grid[:, -1]
    table[PRICE : PRICE + 2] = table[AT : AT + 2]
    # f is non-decreasing: between two samples it is at least the value at the first.
    rise = level[:, -1] - level[:, 0]
    low = np.min(level[:, :-1] - rise[:, None] * part[1:], axis=1)
    still = np.ones(t.size, dtype=bool)
    flat = low < 0.5 * level[:, 0]
    table[FLOOR] = np.where(flat, level[:, 0], low)
    table[FLOOR + 1] = np.where(flat, level[:, 0], low + rise)
    if sums is not None:
        table[BENT : BENT + 2], table[SHEARED : SHEARED + 2] = _lines_below(grid[:, 0], grid[:, -1], sums)
        still = np.all(sums.upto(table[AT]) == sums.upto(table[AT + 1]), axis=0)
    return Cells(t, h, (rise <= 0.0) & still, table)


def _lines_below(begin: Array, end: Array, sums: Sums) -> Array:
    """Return chords of B and S shifted down to be lower bounds: values at both ends, (2, 2, n)."""
    wide = end - begin

    def looked(of: Callable[[Array], Array], looks: Array) -> Array:
        return of((begin[:, None] + wide[:, None] * looks).ravel()).reshape(2, begin.size, looks.size)

    # Densities may jump at a cell's ends, so they are sampled inside.
    value, density = looked(sums.upto, _SAMPLES), looked(sums.density, 0.5 * (_SAMPLES[:-1] + _SAMPLES[1:]))
    first, last = value[:, :, :1], value[:, :, -1:]
    short = (first + (last - first) * _SAMPLES - value).max(axis=2)
    # Between two samples the integral sags by a quarter of the slope increase times their distance; doubled.
    sag = 0.5 * wide * _SAMPLES[1] * np.maximum(np.diff(density, axis=2).max(axis=2), 0.0)
    ends = np.stack([first[:, :, 0], last[:, :, 0]]) - (short + sag)
    # Lines of adjacent cells share the lower end value: a drop from one to the next would be a spurious gain.
    meet = np.flatnonzero(begin[1:] == end[:-1])
    ends[1, :, meet] = ends[0, :, meet + 1] = np.minimum(ends[1, :, meet], ends[0, :, meet + 1])
    return ends.swapaxes(0, 1)


def finer(bar: Bar, old: Cells, keep: NDArray[np.bool_], looks: int, sums: Sums | None) -> Cells:
    """Split the kept cells into CUT parts each."""
    t, h = old.t[keep], old.h[keep] / CUT
    start = (t[:, None] + h[:, None] * np.arange(CUT)).ravel()
    return cells(bar, start, np.repeat(h, CUT), looks, sums)
