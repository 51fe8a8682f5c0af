"""The strip as a vibrating body: modes in place, under a constant axial force.

    EI V'''' - P V'' + rho A V_tt = 0,  V(0) = V'(0) = 0,  V(l) + e V'(l) = 0,  M(L) = 0

Ritz's method with polynomials z^2 p_j(z) (p_j Legendre's on [0, l]) that satisfy the pin's constraint exactly; the
moment condition is natural. The rigid head turns with the strip's end, so the axial force works through
P (int V'^2 dz + e V'(l)^2)/2. The head's own mass is not modelled (it is guided by the crank). Frequencies come
from above and converge faster than any power of the number of polynomials.

Source: W. Ritz (1909); S. P. Timoshenko, Vibration Problems in Engineering.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from solvers.rod.scene import Dimensions, Scene

Array = NDArray[np.float64]

POLYNOMIALS = 14
_POINTS = POLYNOMIALS + 6


@lru_cache(maxsize=1)
def _basis() -> tuple[Array, Array, Array, Array]:
    """Gauss weights on [0, 1] and, at its points, zeta^2 p_j with first and second derivative, (points, basis)."""
    x, w = legendre.leggauss(_POINTS)
    zeta, weights = 0.5 * (x + 1.0), 0.5 * w
    value, first, second = (_derivatives(zeta, order) for order in range(3))
    return weights, value, first, second


@lru_cache(maxsize=8)
def _coefficients(order: int) -> Array:
    """Legendre coefficients of d^order/dzeta^order of zeta^2 p_j: (degree, basis)."""
    square = legendre.Legendre.fromroots([0.0, 0.0], domain=[0.0, 1.0])
    columns = np.zeros((POLYNOMIALS + 2, POLYNOMIALS))
    for j in range(POLYNOMIALS):
        polynomial = legendre.Legendre.basis(j, domain=[0.0, 1.0]) * square * (math.sqrt(2 * j + 1) / square(1.0))
        series = (polynomial.deriv(order) if order else polynomial).coef
        columns[: series.size, j] = series
    return columns


def _derivatives(zeta: Array, order: int) -> Array:
    """d^order/dzeta^order of zeta^2 p_j(2 zeta - 1), p_j scaled to unit norm: (points, basis)."""
    return legendre.legvander(2.0 * np.asarray(zeta) - 1.0, POLYNOMIALS + 1) @ _coefficients(order)


@dataclass(frozen=True)
class StripBasis:
    """Matrices of the strip in place in a basis that satisfies the constraints, per unit EI, P and rho A.

    bending  int psi_i'' psi_j'' dz [1/m^3]; geometric  int psi_i' psi_j' dz + e psi_i'(l) psi_j'(l) [1/m];
    mass  int psi_i psi_j dz [m]; combination maps the basis to zeta^2 p_j, shape (polynomials, basis).
    """

    length: float
    combination: Array
    bending: Array
    geometric: Array
    mass: Array

    def values(self, stations: Array, order: int) -> Array:
        """d^order psi/dz^order at the stations: (stations, basis)."""
        return _derivatives(np.asarray(stations) / self.length, order) @ self.combination / self.length**order


def strip_basis(length: float, rod_length: float) -> StripBasis:
    """The constrained basis for a strip of free length l on a rod of length L."""
    weights, value, first, second = _basis()
    end_value, end_slope = _derivatives(np.array([1.0]), 0)[0], _derivatives(np.array([1.0]), 1)[0]
    e = rod_length - length
    constraint = end_value + (e / length) * end_slope
    # The null space of the one constraint: the trailing columns of a full QR factorisation.
    combination = np.linalg.qr(constraint[:, None], mode="complete")[0][:, 1:]
    value, first, second = value @ combination, first @ combination, second @ combination
    tip = end_slope @ combination
    return StripBasis(
        length=length,
        combination=combination,
        bending=second.T @ (weights[:, None] * second) / length**3,
        geometric=first.T @ (weights[:, None] * first) / length + e / length**2 * np.outer(tip, tip),
        mass=value.T @ (weights[:, None] * value) * length,
    )


def natural_frequency(scene: Scene, dimensions: Dimensions, axial_force: float) -> float:
    """First natural frequency [Hz] of the strip in place under a constant axial force [N]; 0 where it buckles."""
    from scipy.linalg import eigh

    basis = strip_basis(dimensions.l, scene.mechanism.rod_length)
    stiffness = scene.material.elastic_modulus * dimensions.b * dimensions.h**3 / 12.0
    line_mass = scene.material.density * dimensions.b * dimensions.h
    system = stiffness * basis.bending + axial_force * basis.geometric
    least = float(eigh(system, line_mass * basis.mass, eigvals_only=True, subset_by_index=[0, 0])[0])
    return math.sqrt(max(least, 0.0)) / (2.0 * math.pi)
