"""Cells that a break point may lie in, with what bounds the walls and the deflection there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.pin.shapes.break_points.bar import Bar, Sums
from solvers.pin.shapes.break_points.paths import AT, BENT, FLOOR, PRICE, ROWS, SHEARED

Array = NDArray[np.float64]

CUT = 4
_LOOKS = np.linspace(0.0, 1.0, 17)


@dataclass(frozen=True)
class Cells:
    """Cells [t, t + h] in order, n of them, and ``table`` of shape (ROWS, n) as
    ``solvers.pin.shapes.break_points.paths`` reads it.

    ``level`` says in which of them f, B and S are the same all over.
    The price of length in it is t itself until ``priced`` says otherwise.
    """

    t: Array
    h: Array
    level: NDArray[np.bool_]
    table: Array

    def priced(self, at: Array, extra: Array) -> Cells:
        """The same with ``extra``, straight between the places ``at``, added to the price of length."""
        table = self.table.copy()
        for end in (0, 1):
            table[PRICE + end] = table[AT + end] + np.interp(table[AT + end], at, extra)
        return replace(self, table=table)

    def taken(self, which: NDArray[np.bool_]) -> Cells:
        """Some of the cells."""
        return Cells(self.t[which], self.h[which], self.level[which], np.ascontiguousarray(self.table[:, which]))


def points(bar: Bar, t: Array, sums: Sums | None) -> Cells:
    """Cells without width: f, B and S are what they are."""
    table = np.zeros((ROWS, t.size))
    table[AT : AT + 2] = table[PRICE : PRICE + 2] = t
    table[FLOOR : FLOOR + 2] = bar.least(t)
    if sums is not None:
        table[BENT : BENT + 2], table[SHEARED : SHEARED + 2] = sums.upto(t)[:, None, :]
    return Cells(t, np.zeros_like(t), np.zeros(t.size, dtype=bool), table)


def cells(bar: Bar, t: Array, h: Array, looks: int, sums: Sums | None) -> Cells:
    """Cells from t on, h wide, looked at in ``looks`` places each."""
    part = np.arange(looks + 1) / looks
    grid = t[:, None] + h[:, None] * part
    grid[:, -1] = np.minimum(t + h, 1.0)
    level = bar.least(grid.ravel()).reshape(grid.shape)
    table = np.zeros((ROWS, t.size))
    table[AT], table[AT + 1] = grid[:, 0], grid[:, -1]
    table[PRICE : PRICE + 2] = table[AT : AT + 2]
    # f between two looks is no less than at the first of them.
    rise = level[:, -1] - level[:, 0]
    low = np.min(level[:, :-1] - rise[:, None] * part[1:], axis=1)
    still = np.ones(t.size, dtype=bool)
    flat = low < 0.5 * level[:, 0]
    table[FLOOR] = np.where(flat, level[:, 0], low)
    table[FLOOR + 1] = np.where(flat, level[:, 0], low + rise)
    if sums is not None:
        table[BENT : BENT + 2], table[SHEARED : SHEARED + 2] = _lines_below(grid[:, 0], grid[:, -1], sums)
        still = np.all(sums.upto(grid[:, 0]) == sums.upto(grid[:, -1]), axis=0)
    return Cells(t, h, (rise <= 0.0) & still, table)


def _lines_below(begin: Array, end: Array, sums: Sums) -> Array:
    """B's and S's chords, each moved down until the sum nowhere lies below it: values at both ends, (2, 2, n)."""
    wide = end - begin

    def looked(of: Callable[[Array], Array], looks: Array) -> Array:
        return of((begin[:, None] + wide[:, None] * looks).ravel()).reshape(2, begin.size, looks.size)

    # Densities may jump at a cell's end, so they are looked at inside.
    value, density = looked(sums.upto, _LOOKS), looked(sums.density, 0.5 * (_LOOKS[:-1] + _LOOKS[1:]))
    first, last = value[:, :, :1], value[:, :, -1:]
    short = (first + (last - first) * _LOOKS - value).max(axis=2)
    # Between two looks the sum sags by a quarter of what its slope rises there, times their distance; twice that.
    sag = 0.5 * wide * _LOOKS[1] * np.maximum(np.diff(density, axis=2).max(axis=2), 0.0)
    ends = np.stack([first[:, :, 0], last[:, :, 0]]) - (short + sag)
    # Neighbours' lines meet, at the lower end: what one gives back to the next is a gain for no wall between.
    meet = np.flatnonzero(begin[1:] == end[:-1])
    ends[1, :, meet] = ends[0, :, meet + 1] = np.minimum(ends[1, :, meet], ends[0, :, meet + 1])
    return ends.swapaxes(0, 1)


def finer(bar: Bar, old: Cells, keep: NDArray[np.bool_], looks: int, sums: Sums | None) -> Cells:
    """The cells kept, cut in CUT."""
    t, h = old.t[keep], old.h[keep] / CUT
    start = (t[:, None] + h[:, None] * np.arange(CUT)).ravel()
    return cells(bar, start, np.repeat(h, CUT), looks, sums)
