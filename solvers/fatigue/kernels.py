"""A limiting curve on the Haigh plane as kernels take it, and the utilisation of stress cycles by it.

Any severity that rises with a cycle's greatest value and falls with its least one can be such a diagram; the greatest
stress is one of two lines, amplitude + mean and amplitude - mean.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel

Array = NDArray[np.float64]


class Diagram(NamedTuple):
    """Straight pieces and one parabola; the utilisation 1/n of a cycle is the greatest that any of them gives.

    ``lines``     shape (corners, lines, 3): alpha, beta [1/Pa] and what a mean left out adds (see ``with_mean``). A
                  corner gives the least of its lines alpha sigma_a + beta sigma_m.
    ``parabola``  alpha, beta [1/Pa] and the mean left out [Pa]: the ray meets Gerber's parabola at
                  1/n = (a + sqrt(a^2 + 4 m^2))/2, a = alpha sigma_a, m = beta max(sigma_m, 0). Zeros for none.
    """

    lines: Array
    parabola: Array

    def with_mean(self, mean: float) -> Diagram:
        """The same for cycles told without this mean: beside a great one a small amplitude keeps its digits."""
        lines, parabola = self.lines.copy(), self.parabola.copy()
        lines[..., 2] += mean * lines[..., 1]
        parabola[2] += mean
        return Diagram(lines, parabola)


GREATEST = Diagram(np.array([[[1.0, 1.0, 0.0]], [[1.0, -1.0, 0.0]]]), np.zeros(3))
"""The greatest magnitude of the cycle."""


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
def severities(high: Array, low: Array, lines: Array, parabola: Array, out: Array) -> None:
    """1/n of every cycle into ``out``; ``high``, ``low`` [Pa] and ``out`` have the shape (layers, sections)."""
    for layer in range(high.shape[0]):
        for j in range(high.shape[1]):
            out[layer, j] = utilisation_of(high[layer, j], low[layer, j], lines, parabola)
