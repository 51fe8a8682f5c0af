"""Kernel representation of a limiting curve in the Haigh diagram, and the utilisation of stress cycles.

Any severity that increases with a cycle's maximum and decreases with its minimum can be represented; the maximum stress
magnitude consists of two lines, amplitude + mean and amplitude - mean.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel


class Diagram(NamedTuple):
    """Lines and a parabola; the utilisation 1/n of a cycle is the maximum over all of them.

    ``lines``     shape (corners, lines, 3): alpha, beta [1/Pa] and the contribution of a subtracted mean (see
                  ``with_mean``). A corner contributes the minimum of its lines alpha sigma_a + beta sigma_m.
    ``parabola``  alpha, beta [1/Pa] and the subtracted mean [Pa]: the ray meets Gerber's parabola at
                  1/n = (a + sqrt(a^2 + 4 m^2))/2, a = alpha sigma_a, m = beta max(sigma_m, 0). Zeros: none.
    """

    lines: Array
    parabola: Array


GREATEST = Diagram(np.array([[[1.0, 1.0, 0.0]], [[1.0, -1.0, 0.0]]]), np.zeros(3))
"""The maximum stress magnitude of the cycle."""


@kernel
def utilisation_of(high: float, low: float, lines: Array, parabola: Array) -> float:
    """1/n, dimensionless, of one stress cycle between ``low`` and ``high`` [Pa]."""
    a, m = 0.5 * (high - low), 0.5 * (high + low)
    worst = 0.0
    for c in range(lines.shape[0]):
        value = np.inf
        for k in range(lines.shape[1]):
            value = min(value, lines[c, k, 0] * a + lines[c, k, 1] * m + lines[c, k, 2])
        worst = max(worst, value)
    if parabola[0] > 0.0:
        pa, pm = parabola[0] * a, 2.0 * parabola[1] * max(m + parabola[2], 0.0)
        worst = max(worst, 0.5 * (pa + math.sqrt(pa * pa + pm * pm)))
    return worst


@kernel
def with_mean(lines: Array, parabola: Array, mean: float) -> tuple[Array, Array]:
    """The diagram for cycles from which this mean [Pa] is subtracted, which preserves small amplitudes beside a large
    mean."""
    lines, parabola = lines.copy(), parabola.copy()
    for corner in range(lines.shape[0]):
        for line in range(lines.shape[1]):
            lines[corner, line, 2] += mean * lines[corner, line, 1]
    parabola[2] += mean
    return lines, parabola


@kernel
def severities(high: Array, low: Array, lines: Array, parabola: Array, out: Array) -> None:
    """1/n of every cycle into ``out``; ``high``, ``low`` [Pa] and ``out`` have the shape (layers, sections)."""
    for layer in range(high.shape[0]):
        for j in range(high.shape[1]):
            out[layer, j] = utilisation_of(high[layer, j], low[layer, j], lines, parabola)
