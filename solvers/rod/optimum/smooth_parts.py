"""A fatigue utilisation, or a greatest stress, taken apart into smooth functions that it is the greatest of.

The utilisation of a fibre at a section is the greatest, over the humps of its stress over the turn, over its dips, and
over the pieces of the fatigue diagram, of a smooth function of one hump's height and one dip's depth. So every such
combination that comes near the worst is a part of its own, and where two of them are equal there is a corner between
smooth constraints and no kink in one of them. A greatest stress has single humps and dips for parts.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue.kernels import Diagram

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_NEAR = 0.85
"""Parts below this share of the worst are left out."""
_SAME_HUMP = 0.02
"""Angles [rad] closer than this belong to one hump."""
_THREE = np.arange(3)[:, None]


@dataclass(frozen=True)
class Place:
    """Where parts are read from the humps' heights or depths (..., 2, sections, humps): fibres, groups of sections and
    humps, (parts,) each."""

    fibre: Index
    group: Index
    hump: Index

    @cached_property
    def sections(self) -> Index:
        """The three of a group, (3, parts); at the clamp all three are the same."""
        return np.maximum(3 * self.group - 2, 0) + _THREE * (self.group > 0)

    def read(self, values: Array) -> Array:
        """Values at the three sections of every part, (..., 3, parts)."""
        return values[..., self.fibre, self.sections, self.hump]


@dataclass(frozen=True)
class Parts:
    """Combinations that come near the worst. ``order`` sorts the angles, and humps begin at ``starts`` in that order.

    Of every utilisation: fibre, group of sections, hump, dip, and the piece of the diagram, of which the last is the
    parabola; of stresses: fibre, group, hump, whether it is a dip.
    """

    order: Index
    starts: Index
    utilisations: Index
    stresses: Index

    @staticmethod
    def near_the_worst(stress: Array, angles: Array, diagram: Diagram) -> Parts:
        """The parts of a strip's stresses [Pa] (2, sections, 3 angles) that come near the worst.

        ``angles`` are those in the middle of the threes; sections are the first alone, then threes.
        """
        order = np.argsort(angles)
        apart = np.diff(angles[order], prepend=angles[order[0]] - 2.0 * _SAME_HUMP) > _SAME_HUMP
        starts, groups = np.flatnonzero(apart), 1 + (stress.shape[1] - 1) // 3
        count, pieces = starts.size, diagram.lines.shape[0] + 1
        every = np.indices((2, groups, count, count, pieces)).reshape(5, -1)
        all_stresses = np.indices((2, groups, count, 2)).reshape(4, -1)
        used, strained = Parts(order, starts, every, all_stresses).values(stress, diagram)
        near = used >= _NEAR * used.max(), strained >= _NEAR * strained.max()
        return Parts(order, starts, every[:, near[0]], all_stresses[:, near[1]])

    def values(self, stress: Array, diagram: Diagram) -> tuple[Array, Array]:
        """Utilisations, and stresses [Pa], of the parts of strips' stresses (..., 2, sections, 3 angles)."""
        high, low = self._extremes(stress)
        return self._utilisations(high, low, diagram), self._stresses(high, low)

    def _extremes(self, stress: Array) -> tuple[Array, Array]:
        """The height and the depth of every hump, shape (..., 2, sections, humps)."""
        threes = stress.reshape(*stress.shape[:-1], -1, 3)[..., self.order, :]
        both = np.stack([threes, -threes])
        high, low = np.maximum.reduceat(vertex(both[..., 0], both[..., 1], both[..., 2]), self.starts, axis=-1)
        return high, -low

    @cached_property
    def _used_at(self) -> tuple[Place, Place]:
        fibre, group, hump, dip, _ = self.utilisations
        return Place(fibre, group, hump), Place(fibre, group, dip)

    @cached_property
    def _strained_at(self) -> Place:
        return Place(*self.stresses[:3])

    def _utilisations(self, high: Array, low: Array, diagram: Diagram) -> Array:
        hump, dip = self._used_at
        piece, top, bottom = self.utilisations[4], hump.read(high), dip.read(low)
        amplitude, mean = 0.5 * (top - bottom), 0.5 * (top + bottom)
        lines, (alpha, beta, _) = diagram.lines, diagram.parabola
        straight = np.minimum(piece, lines.shape[0] - 1)
        if lines.shape[0]:
            value = (lines[straight, :, 0] * amplitude[..., None] + lines[straight, :, 1] * mean[..., None]).min(
                axis=-1
            )
        else:
            value = np.zeros_like(amplitude)
        a, m = alpha * amplitude, 2.0 * beta * np.maximum(mean, 0.0)
        value = np.where(piece < lines.shape[0], value, 0.5 * (a + np.hypot(a, m)))
        return vertex(*np.moveaxis(value, -2, 0))

    def _stresses(self, high: Array, low: Array) -> Array:
        at, dips = self._strained_at, self.stresses[3]
        return vertex(*np.moveaxis(np.where(dips, -at.read(low), at.read(high)), -2, 0))


def vertex(left: Array, middle: Array, right: Array) -> Array:
    """The heights of parabolas through three samples where their vertices lie near, else the greatest samples."""
    bend, slope = 2.0 * middle - left - right, 0.5 * (right - left)
    inside = (bend > 0.0) & (np.abs(slope) <= bend)
    height = middle + 0.5 * slope**2 / np.where(inside, bend, 1.0)
    return np.where(inside, height, np.maximum(middle, np.maximum(left, right)))
