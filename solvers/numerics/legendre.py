"""Legendre polynomials."""

from __future__ import annotations

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel


@kernel
def legendre_at(x: Array, degree: int) -> Array:
    """Evaluate the Legendre polynomials up to ``degree`` >= 1 at ``x`` by Bonnet's recursion: (points, degree + 1)."""
    out = np.empty((x.size, degree + 1))
    for i in range(x.size):
        out[i, 0], out[i, 1] = 1.0, x[i]
        for n in range(2, degree + 1):
            out[i, n] = ((2 * n - 1) * x[i] * out[i, n - 1] - (n - 1) * out[i, n - 2]) / n
    return out
