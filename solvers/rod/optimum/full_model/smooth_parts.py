"""A fatigue utilisation, or a greatest stress, taken apart into smooth functions that it is the greatest of.

The utilisation of a fibre at a section is the greatest, over the humps of its stress over the turn, over its dips, and
over the pieces of the fatigue diagram, of a smooth function of one hump's height and one dip's depth. So every such
combination that comes near the worst is a part of its own, and where two of them are equal there is a corner between
smooth constraints and no kink in one of them. A greatest stress has single humps and dips for parts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue.kernels import Diagram
from solvers.numerics.jit import kernel
from solvers.rod.optimum.core.peak_model import peak_height

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_NEAR = 0.85
"""Parts below this share of the worst are left out."""
_SAME_HUMP = 0.02
"""Angles [rad] closer than this belong to one hump."""


@dataclass(frozen=True)
class Parts:
    """Combinations that come near the worst. ``order`` sorts the angles, and humps begin at ``starts`` in that order.

    Of every utilisation: fibre, group of sections, hump, dip, and the piece of the diagram, of which the last is the
    parabola; of stresses: fibre, group, hump, whether it is a dip. (5, utilisations) and (4, stresses).
    """

    order: Index
    starts: Index
    utilisations: Index
    stresses: Index

    @staticmethod
    def near_the_worst(stress: Array, angles: Array, diagram: Diagram) -> Parts:
        """The parts of a strip's stresses [Pa] (2, sections, 3 angles) that come near the worst.

        ``angles`` are those in the middle of the stencils; sections are the first alone, then stencils.
        """
        order = np.argsort(angles)
        apart = np.diff(angles[order], prepend=angles[order[0]] - 2.0 * _SAME_HUMP) > _SAME_HUMP
        starts, groups = np.flatnonzero(apart), 1 + (stress.shape[1] - 1) // 3
        count, pieces = starts.size, diagram.lines.shape[0] + 1
        every = np.indices((2, groups, count, count, pieces)).reshape(5, -1)
        all_stresses = np.indices((2, groups, count, 2)).reshape(4, -1)
        used, strained = part_values(stress, order, starts, every, all_stresses, *diagram)
        every = np.compress(used >= _NEAR * used.max(), every, axis=1)
        return Parts(order, starts, every, np.compress(strained >= _NEAR * strained.max(), all_stresses, axis=1))


@kernel
def part_values(
    stress: Array, order: Index, starts: Index, utilisations: Index, stresses: Index, lines: Array, parabola: Array
) -> tuple[Array, Array]:
    """Utilisations, and stresses [Pa], of the parts of a strip's stresses (2, sections, 3 angles); the other arguments
    as in ``Parts`` and ``Diagram``."""
    high, low = _extremes(stress, order, starts)
    used, strained, three = np.empty(utilisations.shape[1]), np.empty(stresses.shape[1]), np.empty(3)
    for n in range(used.size):
        fibre, group, piece = utilisations[0, n], utilisations[1, n], utilisations[4, n]
        for k in range(3 if group > 0 else 1):
            j = 3 * group - 2 + k if group > 0 else 0
            top, bottom = high[fibre, j, utilisations[2, n]], low[fibre, j, utilisations[3, n]]
            amplitude, mean = 0.5 * (top - bottom), 0.5 * (top + bottom)
            if piece < lines.shape[0]:
                three[k] = np.inf
                for line in range(lines.shape[1]):
                    three[k] = min(three[k], lines[piece, line, 0] * amplitude + lines[piece, line, 1] * mean)
            else:
                a, m = parabola[0] * amplitude, 2.0 * parabola[1] * max(mean, 0.0)
                three[k] = 0.5 * (a + math.sqrt(a * a + m * m))
        used[n] = peak_height(three[0], three[1], three[2]) if group > 0 else three[0]
    for n in range(strained.size):
        fibre, group, hump, dips = stresses[0, n], stresses[1, n], stresses[2, n], stresses[3, n]
        for k in range(3 if group > 0 else 1):
            j = 3 * group - 2 + k if group > 0 else 0
            three[k] = -low[fibre, j, hump] if dips > 0 else high[fibre, j, hump]
        strained[n] = peak_height(three[0], three[1], three[2]) if group > 0 else three[0]
    return used, strained


@kernel
def _extremes(stress: Array, order: Index, starts: Index) -> tuple[Array, Array]:
    """The height and the depth of every hump, (2, sections, humps) each."""
    sections, humps = stress.shape[1], starts.size
    high, low = np.full((2, sections, humps), -np.inf), np.full((2, sections, humps), np.inf)
    for fibre in range(2):
        for j in range(sections):
            own = stress[fibre, j]
            for hump in range(humps):
                for n in range(starts[hump], starts[hump + 1] if hump + 1 < humps else order.size):
                    i = 3 * order[n]
                    high[fibre, j, hump] = max(high[fibre, j, hump], peak_height(own[i], own[i + 1], own[i + 2]))
                    low[fibre, j, hump] = min(low[fibre, j, hump], -peak_height(-own[i], -own[i + 1], -own[i + 2]))
    return high, low
