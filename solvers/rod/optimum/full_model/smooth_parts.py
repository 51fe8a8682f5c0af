"""Decomposition of a fatigue utilisation, or of a maximum stress, into smooth functions whose maximum it is.

The utilisation of a fibre at a section is the maximum, over the local maxima of its stress over the revolution, over
the local minima, and over the pieces of the fatigue diagram, of a smooth function of one maximum and one minimum. Each
such combination close to the largest is therefore a separate part: where two are equal, two smooth constraints
intersect, and no constraint has a kink. The parts of a maximum stress are single local maxima and minima.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solvers.fatigue.kernels import Diagram
from solvers.numerics.arrays import Array, Index
from solvers.numerics.jit import kernel
from solvers.rod.optimum.rows_at_samples import peak_height

_MIN_SHARE = 0.85
"""Parts below this share of the largest are omitted."""
_CLUSTER_GAP = 0.02
"""Angles [rad] closer than this belong to the same cluster, i.e. to one local extremum."""


class Parts(NamedTuple):
    """Combinations close to the largest.

    order           sorts the angles
    starts          index of the first angle of every cluster, in that order
    utilisations    fibre, group of sections, clusters of the maximum and of the minimum, piece of the diagram, the
                    last of which is the parabola (5, utilisations)
    stresses        fibre, group of sections, cluster, 1 for a minimum or 0 for a maximum (4, stresses)
    """

    order: Index
    starts: Index
    utilisations: Index
    stresses: Index

    @staticmethod
    def near_maximum(stress: Array, angles: Array, diagram: Diagram) -> Parts:
        """The parts of a strip's stresses [Pa] (2, sections, 3 angles) that are close to the largest.

        ``angles`` are the middle angles of the stencils; sections are the clamp, then stencils of three.
        """
        order = np.argsort(angles)
        begins = np.diff(angles[order], prepend=angles[order[0]] - 2.0 * _CLUSTER_GAP) > _CLUSTER_GAP
        starts, groups = np.flatnonzero(begins), 1 + (stress.shape[1] - 1) // 3
        count, pieces = starts.size, diagram.lines.shape[0] + 1
        combinations = np.indices((2, groups, count, count, pieces)).reshape(5, -1)
        all_stresses = np.indices((2, groups, count, 2)).reshape(4, -1)
        candidates = Parts(order, starts, combinations, all_stresses)
        part_utilisations, part_stresses = part_values(stress, candidates, diagram)
        combinations = np.compress(part_utilisations >= _MIN_SHARE * part_utilisations.max(), combinations, axis=1)
        all_stresses = np.compress(part_stresses >= _MIN_SHARE * part_stresses.max(), all_stresses, axis=1)
        return candidates._replace(utilisations=combinations, stresses=all_stresses)


@kernel
def part_values(stress: Array, parts: Parts, diagram: Diagram) -> tuple[Array, Array]:
    """Utilisations, and stresses [Pa], of the parts of a strip's stresses (2, sections, 3 angles)."""
    utilisations, stresses, (lines, parabola) = parts.utilisations, parts.stresses, diagram
    maxima, minima = _extremes(stress, parts.order, parts.starts)
    part_utilisations, part_stresses = np.empty(utilisations.shape[1]), np.empty(stresses.shape[1])
    samples = np.empty(3)
    for n in range(part_utilisations.size):
        fibre, group, piece = utilisations[0, n], utilisations[1, n], utilisations[4, n]
        for k in range(3 if group > 0 else 1):
            j = 3 * group - 2 + k if group > 0 else 0
            maximum, minimum = maxima[fibre, j, utilisations[2, n]], minima[fibre, j, utilisations[3, n]]
            amplitude, mean = 0.5 * (maximum - minimum), 0.5 * (maximum + minimum)
            if piece < lines.shape[0]:
                samples[k] = np.inf
                for line in range(lines.shape[1]):
                    samples[k] = min(samples[k], lines[piece, line, 0] * amplitude + lines[piece, line, 1] * mean)
            else:
                a, m = parabola[0] * amplitude, 2.0 * parabola[1] * max(mean, 0.0)
                samples[k] = 0.5 * (a + math.sqrt(a * a + m * m))
        part_utilisations[n] = peak_height(samples[0], samples[1], samples[2]) if group > 0 else samples[0]
    for n in range(part_stresses.size):
        fibre, group, cluster, is_minimum = stresses[0, n], stresses[1, n], stresses[2, n], stresses[3, n]
        for k in range(3 if group > 0 else 1):
            j = 3 * group - 2 + k if group > 0 else 0
            samples[k] = -minima[fibre, j, cluster] if is_minimum > 0 else maxima[fibre, j, cluster]
        part_stresses[n] = peak_height(samples[0], samples[1], samples[2]) if group > 0 else samples[0]
    return part_utilisations, part_stresses


@kernel
def _extremes(stress: Array, order: Index, starts: Index) -> tuple[Array, Array]:
    """Maximum and minimum stress of every cluster [Pa], (2, sections, clusters) each."""
    sections, clusters = stress.shape[1], starts.size
    maxima, minima = np.full((2, sections, clusters), -np.inf), np.full((2, sections, clusters), np.inf)
    for fibre in range(2):
        for j in range(sections):
            samples = stress[fibre, j]
            for cluster in range(clusters):
                for n in range(starts[cluster], starts[cluster + 1] if cluster + 1 < clusters else order.size):
                    i = 3 * order[n]
                    maximum = peak_height(samples[i], samples[i + 1], samples[i + 2])
                    minimum = -peak_height(-samples[i], -samples[i + 1], -samples[i + 2])
                    maxima[fibre, j, cluster] = max(maxima[fibre, j, cluster], maximum)
                    minima[fibre, j, cluster] = min(minima[fibre, j, cluster], minimum)
    return maxima, minima
