"""Lower bound of a bushing's volume under a deflection limit.

As ``solvers.pin.optimum.dual_bound`` for the pin, with the bushing's flexibilities, which are convex everywhere; u
has no upper bound.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.optimum.dual_bound import halves, least_rising
from solvers.pin.optimum.program import Program
from solvers.pin.section.tube import bending, shearing

Array = NDArray[np.float64]


def bound(program: Program, low: Array, multiplier: float, y: Array, monotone: bool) -> float:
    """Return a lower bound of the volume over all y >= low (optionally monotone) that satisfy the deflection limit.

    Tangents of the Lagrangian at y, over [low, top]; every slope is positive at ``top``, so no minimum lies beyond.
    """
    share, scale = program.share, multiplier / program.limit
    pulls = (program.bending > 0.0) | (program.shear > 0.0)

    def slopes(at: Array) -> Array:
        safe = np.where(pulls, at, 1.0)
        f, g = _slopes(safe, program.sought.kappa, program.law.a, program.law.b)
        return share * (1.0 + scale * (program.bending * f + program.shear * g))

    top = float(y.max())
    while np.any(slopes(np.full_like(y, top)) < 0.0):
        top *= 1.5
    value = share * (y + scale * program.densities(np.where(pulls, y, 1.0)))
    slope = slopes(y)
    total = float(value.sum()) - multiplier
    if not monotone:
        return total + float(np.sum(np.where(slope > 0.0, slope * (low - y), slope * (top - y))))
    return total + sum(least_rising(y[half], slope[half], low[half], top) for half in halves(program))


@kernel
def _slopes(y: Array, kappa: float, a: float, b: float) -> tuple[Array, Array]:
    f, g = np.empty_like(y), np.empty_like(y)
    for i in range(y.size):
        f[i], g[i] = bending(y[i], kappa)[1], shearing(y[i], kappa, a, b)[1]
    return f, g
