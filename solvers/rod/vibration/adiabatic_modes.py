"""Natural modes of the strip under the instantaneous axial force.

With the masses M and the geometric stiffness G of ``equation``, the modes w_n, scaled to w_n M w_n = 1, and frequencies
omega_n under a force that differs by F from its mean are those of

    (1 + F G) w_n = omega_n^2 M w_n

They depend on the force alone, smoothly, since natural frequencies of a strip are far apart. They are therefore solved
for few forces, the Chebyshev points of its range, and interpolated.

Source: for the interpolation, J.-P. Berrut, L. N. Trefethen, SIAM Review 46 (2004).
"""

from __future__ import annotations

import math

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import fusing_kernel
from solvers.numerics.radau import interpolation_weights
from solvers.rod.vibration.equation import StripEquation

_FORCES = 9
"""Number of forces; more change nothing, even close to buckling."""
_SOFTEST = 1e-3
"""Smallest squared frequency relative to that under the mean force, as if no force buckled the strip."""


@fusing_kernel
def adiabatic_modes(equation: StripEquation, fluctuation: Array) -> tuple[Array, Array]:
    """Frequencies omega_n (forces, n) and modes w_n, as columns in the modes under the mean force (forces, n, n), at
    fluctuations F [N] of the force. They vary continuously; at the mean they are those of ``equation``."""
    n, root = equation.masses.size, np.sqrt(equation.masses)
    least, greatest = fluctuation.min(), fluctuation.max()
    forces, weights, table = np.empty(_FORCES), np.empty(_FORCES), np.empty((_FORCES, n + n * n))
    matrix, previous = np.empty((n, n)), np.eye(n)
    for k in range(_FORCES):
        position = math.pi * (k + 0.5) / _FORCES
        forces[k] = 0.5 * (greatest + least) - 0.5 * (greatest - least) * math.cos(position)
        weights[k] = math.sin(position) * (1.0 if k % 2 == 0 else -1.0)
        for i in range(n):
            for j in range(n):
                stiffness = forces[k] * equation.geometric[i, j] + (1.0 if i == j else 0.0)
                matrix[i, j] = stiffness / (root[i] * root[j])
        squares, vectors = np.linalg.eigh(matrix)
        for j in range(n):
            projection = 0.0
            for i in range(n):
                projection += vectors[i, j] * previous[i, j]
            for i in range(n):
                previous[i, j] = math.copysign(vectors[i, j], vectors[i, j] * projection)
                table[k, n + i * n + j] = previous[i, j] / root[i]
            table[k, j] = squares[j]
    share = np.full((fluctuation.size, _FORCES), 1.0 / _FORCES)
    for i in range(fluctuation.size if greatest > least else 0):
        interpolation_weights(forces, weights, fluctuation[i], share[i])
    rows = np.dot(share, table)
    frequencies, modes = np.empty((fluctuation.size, n)), np.empty((fluctuation.size, n, n))
    for i in range(fluctuation.size):
        for j in range(n):
            frequencies[i, j] = math.sqrt(max(rows[i, j], _SOFTEST / equation.masses[j]))
            for k in range(n):
                modes[i, j, k] = rows[i, n + j * n + k]
    return frequencies, modes
