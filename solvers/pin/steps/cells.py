"""Cells that a break point may lie in, with what bounds the walls and the deflection there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.pin.steps.bar import Bar, Sums
from solvers.pin.steps.paths import AT, BENT, FLOOR, LOST_BENT, LOST_SHEARED, PRICE, ROWS, SHEARED

Array = NDArray[np.float64]

CUT = 4
_LOOKS = (np.arange(16) + 0.5) / 16.0


@dataclass(frozen=True)
class Cells:
    """Cells [t, t + h] in order, n of them, and ``table`` of shape (ROWS, n) as ``solvers.pin.steps.paths`` reads it.

    The price of length in it is t itself until ``priced`` says otherwise.
    """

    t: Array
    h: Array
    table: Array

    def priced(self, at: Array, extra: Array) -> Cells:
        """The same with ``extra``, straight between the places ``at``, added to the price of length."""
        table = self.table.copy()
        for end in (0, 1):
            table[PRICE + end] = table[AT + end] + np.interp(table[AT + end], at, extra)
        return Cells(self.t, self.h, table)

    def taken(self, which: NDArray[np.bool_]) -> Cells:
        """Some of the cells."""
        return Cells(self.t[which], self.h[which], np.ascontiguousarray(self.table[:, which]))


def points(bar: Bar, t: Array, sums: Sums | None) -> Cells:
    """Cells without width: f, B and S are what they are."""
    table = np.zeros((ROWS, t.size))
    table[AT : AT + 2] = table[PRICE : PRICE + 2] = t
    table[FLOOR : FLOOR + 2] = bar.least(t)
    if sums is not None:
        table[BENT : BENT + 2], table[SHEARED : SHEARED + 2] = sums.upto(t)[:, None, :]
    return Cells(t, np.zeros_like(t), table)


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
    flat = low < 0.5 * level[:, 0]
    table[FLOOR] = np.where(flat, level[:, 0], low)
    table[FLOOR + 1] = np.where(flat, level[:, 0], low + rise)
    if sums is not None:
        ends = sums.upto(np.concatenate([table[AT], table[AT + 1]]))
        table[BENT : BENT + 2], table[SHEARED : SHEARED + 2] = ends.reshape(2, 2, -1)
        inside = t[:, None] + h[:, None] * _LOOKS
        density = np.maximum(sums.density(inside.ravel()), 0.0).reshape(2, *inside.shape)
        # A quarter of the range times h, twice: a polynomial's range is nearly that at the looks.
        table[LOST_BENT : LOST_SHEARED + 1] = 0.5 * h * (density.max(axis=2) - density.min(axis=2))
    return Cells(t, h, table)


def finer(bar: Bar, old: Cells, keep: NDArray[np.bool_], looks: int, sums: Sums | None) -> Cells:
    """The cells kept, cut in CUT."""
    t, h = old.t[keep], old.h[keep] / CUT
    start = (t[:, None] + h[:, None] * np.arange(CUT)).ravel()
    return cells(bar, start, np.repeat(h, CUT), looks, sums)
