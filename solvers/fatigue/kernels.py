"""Fatigue criteria as kernels take them: the straight lines and the parabola of a diagram on the Haigh plane.

Any severity that rises with a cycle's greatest value and falls with its least one can be such a diagram; the greatest
stress is one of two lines, amplitude + mean and amplitude - mean.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue.criteria import FatigueCriterion, Gerber, HaighLines
from solvers.numerics.jit import kernel

Array = NDArray[np.float64]


class Diagram(NamedTuple):
    """``lines`` (corners, lines, 3) as in ``HaighLines``, ``parabola`` (alpha, beta, 0) as in ``Gerber`` or zeros.

    What is last in either is of a mean that the cycles come without (see ``with_mean``).
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


def diagram_of(criterion: FatigueCriterion) -> Diagram:
    """The criterion's diagram; of a corner with fewer lines than others the last one is repeated."""
    if isinstance(criterion, Gerber):
        return Diagram(np.zeros((0, 1, 3)), np.array([criterion.alpha, criterion.beta, 0.0]))
    if isinstance(criterion, HaighLines):
        longest = max(len(lines) for lines in criterion.corners)
        padded = np.array([lines + (lines[-1],) * (longest - len(lines)) for lines in criterion.corners], dtype=float)
        return Diagram(np.concatenate([padded, np.zeros((*padded.shape[:2], 1))], axis=2), np.zeros(3))
    raise TypeError(f"there is no diagram of a criterion of type {type(criterion).__name__}")


@kernel
def utilisation_of(high: float, low: float, lines: Array, parabola: Array) -> float:
    """1/n of one stress cycle by the criterion."""
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
    """The criterion's utilisation of every cycle, shape of ``high``: (layers, sections)."""
    for layer in range(high.shape[0]):
        for j in range(high.shape[1]):
            out[layer, j] = utilisation_of(high[layer, j], low[layer, j], lines, parabola)
