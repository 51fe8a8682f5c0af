"""Cells of break points and of walls, with the lower bounds that are linear in each of them.

A step's wall u is at least f(t), t being where it ends. A cell of break points in which f rises is accompanied by a
cell of walls, from f at its begin to f at its end; the two are cut together, at places of the curve f(t). So a step
that ends in the one with a wall of the other lies above the chord between two opposite corners, or below it by a sag
at most.
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.pin.section.flexibility import Flexibility, flexibilities, slopes
from solvers.pin.shapes.break_points.half import COINCIDENT, Half, Sums

Mask = NDArray[np.bool_]
Indices = NDArray[np.int64]
_SAMPLES = np.linspace(0.0, 1.0, 17)
_SAFETY_FACTOR = 2.0
"""Safety factor on the sag of a curve below its chord between two samples."""
_NARROW, _SIMILAR = 1.5, 0.5
"""Ratio of a cell's walls, and of the next cell's width to its own, up to and from which a tangent in its middle hardly
lowers the flexibilities of thicker walls."""


class BreakCells(NamedTuple):
    """Ordered cells [t, t + h] of break points, n of them.

    ``f`` (n, 2): f just inside both ends; ``sag`` (n,): by how much f may lie below the chord between them, infinite
    where f jumps inside. ``sums`` (n, 2, 2): the exact B and S at both ends, ``depth`` (n, 2): by how much a line below
    each is lowered. ``constant``: whether f, B and S are constant.
    """

    t: Array
    h: Array
    f: Array
    sag: Array
    sums: Array
    depth: Array
    constant: Mask


class WallCells(NamedTuple):
    """Ordered cells of walls: ``ends`` (n, 2), and ``curve`` (n,): the cell of break points in which f has these walls,
    -1: none."""

    ends: Array
    curve: Indices


C = TypeVar("C", BreakCells, WallCells)


def subset(cells: C, which: Mask) -> C:
    """Return a subset of the cells."""
    return type(cells)(*(values[which] for values in cells))


def break_cells(half: Half, t: Array, h: Array) -> BreakCells:
    """Return cells [t, t + h], with bounds from samples inside each."""
    grid = t[:, None] + h[:, None] * _SAMPLES
    grid[:, -1] = np.minimum(t + h, 1.0)
    # f may jump at a cell's end.
    inside = grid.copy()
    inside[:, -1] = np.where(grid[:, -1] < 1.0, np.maximum(grid[:, -1] - COINCIDENT, t), 1.0)
    level = half.lower_bound(inside.ravel()).reshape(grid.shape)
    first, last = level[:, 0], level[:, -1]
    # f is non-decreasing; a kink between two samples shows in the adjacent second differences.
    bend = np.zeros((t.size, _SAMPLES.size))
    bend[:, 1:-1] = np.maximum(np.diff(level, 2, axis=1), 0.0)
    sag = 0.25 * _SAFETY_FACTOR * (bend[:, 1:] + bend[:, :-1]).max(axis=1)
    sag += (first[:, None] + (last - first)[:, None] * _SAMPLES - level).max(axis=1)
    sag = np.where(sag > 0.5 * (last - first), np.inf, sag)
    sums, depth = np.zeros((t.size, 2, 2)), np.zeros((t.size, 2))
    if half.sums is not None:
        value = half.sums.integrals(grid.ravel()).reshape(2, *grid.shape)
        sums, depth = value[:, :, [0, -1]].transpose(1, 0, 2), _depths(grid, value, half.sums).T.copy()
    constant = (last <= first) & (sums[:, :, 0] == sums[:, :, 1]).all(axis=1)
    return BreakCells(t, h, level[:, [0, -1]], sag, sums, depth, constant)


def _depths(grid: Array, value: Array, sums: Sums) -> Array:
    """Return how far the chords of B and S must be lowered to be lower bounds, (2, n)."""
    wide = grid[:, -1] - grid[:, 0]
    # Densities may jump at a cell's ends, so they are sampled inside.
    inside = grid[:, :1] + wide[:, None] * (0.5 * (_SAMPLES[:-1] + _SAMPLES[1:]))
    density = sums.density(inside.ravel()).reshape(2, *inside.shape)
    first, last = value[:, :, :1], value[:, :, -1:]
    short = (first + (last - first) * _SAMPLES - value).max(axis=2)
    # Between two samples the integral lies below its chord by a quarter of the slope increase times their distance.
    increase = np.maximum(np.diff(density, axis=2).max(axis=2), 0.0)
    return short + 0.25 * _SAFETY_FACTOR * wide * _SAMPLES[1] * increase


@kernel
def lines_below(ends: Array, most: float, concave_from: float, law: Flexibility) -> tuple[Array, Array]:
    """Return lines below both flexibilities of a section at the ends of cells of walls, (2, 2 n), non-increasing from
    cell to cell, and by how much they are lower, (n, 2). A wall of ``most`` stands for all thicker ones: zero.

    The lines are tangents, chords where shear is concave, from ``concave_from`` on.
    """
    n = ends.shape[0]
    lines, depth = np.zeros((2, 2 * n)), np.zeros((n, 2))
    low_f, low_g = np.inf, np.inf
    for i in range(n):
        a, b = ends[i, 0], ends[i, 1]
        if a >= most:
            break
        even = b < _NARROW * a and (i + 1 == n or ends[i + 1, 1] - ends[i + 1, 0] >= _SIMILAR * (b - a))
        at = 0.5 * (a + b) if even else b
        (f, _), (df, _) = flexibilities(at, law), slopes(at, law)
        begin_f, end_f = f + df * (a - at), f + df * (b - at)
        at = min(at, max(concave_from, a))
        g, dg = flexibilities(at, law)[1], slopes(at, law)[1]
        begin_g, end_g = g + dg * (a - at), g + dg * (b - at)
        # At a wall of zero the depth is that at half the cell.
        (most_f, most_g), (least_f, least_g) = flexibilities(max(a, 0.5 * b), law), flexibilities(b, law)
        if a >= concave_from:
            begin_g, end_g = most_g, least_g
        over = max(end_g - least_g, 0.0)
        low_f, low_g = min(low_f, begin_f), min(low_g, begin_g - over)
        lines[0, 2 * i], lines[1, 2 * i] = low_f, low_g
        depth[i, 0], depth[i, 1] = max(most_f - low_f, 0.0), max(most_g - low_g, 0.0)
        low_f, low_g = min(low_f, end_f), min(low_g, end_g - over)
        lines[0, 2 * i + 1], lines[1, 2 * i + 1] = low_f, low_g
        depth[i, 0], depth[i, 1] = max(depth[i, 0], least_f - low_f), max(depth[i, 1], least_g - low_g)
    return lines, depth
