"""A fatigue utilisation, or a greatest stress, taken apart into smooth functions that it is the greatest of.

The utilisation of a fibre at a section is the greatest, over the humps of its stress over the turn, over its dips, and
over the pieces of the fatigue diagram, of a smooth function of one hump's height and one dip's depth. So every such
combination that comes near the worst is a part of its own, and where two of them are equal there is a corner between
smooth constraints and no kink in one of them. A greatest stress has single humps and dips for parts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue.kernels import Diagram

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_NEAR = 0.85
"""Parts below this share of the worst are left out."""
_SAME_HUMP = 0.1
"""Angles [rad] closer than this belong to one hump."""


class Parts(NamedTuple):
    """``humps`` gives the hump of every angle. Of every part: fibre, group of sections, hump, dip, and the piece of the
    diagram, of which the last is the parabola; of stresses: fibre, group, hump, whether it is a dip."""

    humps: Index
    utilisations: Index
    stresses: Index

    @staticmethod
    def near_the_worst(stress: Array, angles: Array, diagram: Diagram) -> Parts:
        """The parts of a strip's stresses [Pa] (2, sections, 3 angles) that come near the worst.

        ``angles`` are those in the middle of the threes; sections are the first alone, then threes.
        """
        order = np.argsort(angles)
        humps = np.empty(angles.size, dtype=np.intp)
        humps[order] = np.cumsum(np.diff(angles[order], prepend=angles[order[0]]) > _SAME_HUMP)
        high, low = _extremes(stress, humps)
        groups, count, pieces = 1 + (stress.shape[1] - 1) // 3, high.shape[2], diagram.lines.shape[0] + 1
        every = np.indices((2, groups, count, count, pieces)).reshape(5, -1)
        all_stresses = np.indices((2, groups, count, 2)).reshape(4, -1)
        used, strained = _utilisations(high, low, every, diagram), _stresses(high, low, all_stresses)
        return Parts(humps, every[:, used >= _NEAR * used.max()], all_stresses[:, strained >= _NEAR * strained.max()])

    def values(self, stress: Array, diagram: Diagram) -> tuple[Array, Array]:
        """Utilisations, and stresses [Pa], of the parts of a strip's stresses."""
        high, low = _extremes(stress, self.humps)
        return _utilisations(high, low, self.utilisations, diagram), _stresses(high, low, self.stresses)


def _extremes(stress: Array, humps: Index) -> tuple[Array, Array]:
    """The height and the depth of every hump, shape (2, sections, humps)."""
    threes = stress.reshape(*stress.shape[:2], -1, 3)
    tops, dips = vertex(*np.moveaxis(threes, 3, 0)), -vertex(*np.moveaxis(-threes, 3, 0))
    count = int(humps.max()) + 1
    high = np.stack([tops[:, :, humps == n].max(axis=2) for n in range(count)], axis=2)
    low = np.stack([dips[:, :, humps == n].min(axis=2) for n in range(count)], axis=2)
    return high, low


def _at_sections(values: Array, fibre: Index, group: Index, hump: Index) -> Array:
    """Values at the three sections of a part's group, shape (3, parts); at the clamp all three are the same."""
    first = np.maximum(3 * group - 2, 0)
    return np.array([values[fibre, first + n * (group > 0), hump] for n in range(3)])


def _utilisations(high: Array, low: Array, parts: Index, diagram: Diagram) -> Array:
    fibre, group, hump, dip, piece = parts
    top, bottom = _at_sections(high, fibre, group, hump), _at_sections(low, fibre, group, dip)
    amplitude, mean = 0.5 * (top - bottom), 0.5 * (top + bottom)
    lines, (alpha, beta, _) = diagram.lines, diagram.parabola
    straight = np.minimum(piece, lines.shape[0] - 1)
    if lines.shape[0]:
        value = (lines[straight, :, 0] * amplitude[..., None] + lines[straight, :, 1] * mean[..., None]).min(axis=2)
    else:
        value = np.zeros_like(amplitude)
    a, m = alpha * amplitude, 2.0 * beta * np.maximum(mean, 0.0)
    value = np.where(piece < lines.shape[0], value, 0.5 * (a + np.hypot(a, m)))
    return vertex(*value)


def _stresses(high: Array, low: Array, parts: Index) -> Array:
    fibre, group, hump, dips = parts
    values = np.where(dips, -_at_sections(low, fibre, group, hump), _at_sections(high, fibre, group, hump))
    return vertex(*values)


def vertex(left: Array, middle: Array, right: Array) -> Array:
    """The heights of parabolas through three samples where their vertices lie near, else the greatest samples."""
    bend, slope = 2.0 * middle - left - right, 0.5 * (right - left)
    inside = (bend > 0.0) & (np.abs(slope) <= bend)
    height = middle + 0.5 * slope**2 / np.where(inside, bend, 1.0)
    return np.where(inside, height, np.maximum(middle, np.maximum(left, right)))
