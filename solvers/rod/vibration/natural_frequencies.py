"""Natural frequencies and modes of the strip in place, under a constant axial force.

    EI V'''' - P V'' + rho A V_tt = 0,  V(0) = V'(0) = 0,  V(l) + e V'(l) = 0,  M(L) = 0

Ritz method with polynomials whose second derivatives are Legendre polynomials: the bending energy is then a sum of
squares, and low frequencies keep their accuracy for any number of polynomials. The clamp's conditions hold for each
polynomial, the pin's for a combination of the first two; the moment condition is natural. The rigid head rotates with
the strip's end, so the work of the axial force is P (int V'^2 dz + e V'(l)^2)/2. The head's own mass is not modelled
(it is guided by the crank). Frequencies converge from above, faster than any power of the number of polynomials.

Source: W. Ritz (1909); S. P. Timoshenko, Vibration Problems in Engineering.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.legendre import legendre_at
from solvers.numerics.periodic import TURN

POLYNOMIALS = 14
FEW_POLYNOMIALS, FEW_POLYNOMIALS_ERROR = 9, 5e-11
"""Sufficient for the first frequency at low accuracy, and its relative error then, times 1 + P/P_cr: 2.6e-11 was the
largest for 30,000 strips from l = L/11 to L, from 1e-6 beside buckling to strong tension."""
_EXTRA_POINTS = 6
_MAX_ITERATIONS = 500
_MAX_POLYNOMIALS = 60
_EPS = float(np.finfo(float).eps)


@lru_cache(maxsize=64)
def _coefficients(polynomials: int, order: int) -> Array:
    """Legendre coefficients over [0, 1] of the derivatives of this order of the basis polynomials: (degree, basis)."""
    columns = np.zeros((polynomials + 2, polynomials))
    for j in range(polynomials):
        series = np.zeros(j + 1)
        series[j] = math.sqrt(2 * j + 1)
        # Legendre's variable is 2 zeta - 1, i.e. -1 at the clamp.
        if order < 2:
            series = legendre.legint(series, 2 - order, lbnd=-1.0, scl=0.5)
        else:
            series = legendre.legder(series, order - 2, scl=2.0)
        columns[: series.size, j] = series
    return columns


@lru_cache(maxsize=256)
def _derivatives(zeta: tuple[float, ...], polynomials: int, order: int) -> Array:
    """Derivatives d^order/dzeta^order of the polynomials, whose second derivatives have unit norm: (points, basis)."""
    return legendre_at(2.0 * np.array(zeta) - 1.0, polynomials + 1) @ _coefficients(polynomials, order)


class Polynomials(NamedTuple):
    """Table of n polynomials on a strip of unit length.

    zeta, weights     Gauss points and weights that integrate the product of two polynomials exactly
    values, slopes    at these points (points, n)
    end, tip          value and slope at the far end (n,)
    clamp             second and third derivatives at the clamp (2, n)
    mass, geometric   int psi_i psi_j dz and int psi_i' psi_j' dz (n, n)
    """

    zeta: Array
    weights: Array
    values: Array
    slopes: Array
    end: Array
    tip: Array
    clamp: Array
    mass: Array
    geometric: Array


@lru_cache(maxsize=16)
def polynomials_of(count: int) -> Polynomials:
    """Table of ``count`` polynomials."""
    x, w = legendre.leggauss(count + _EXTRA_POINTS)
    zeta, weights = 0.5 * (x + 1.0), 0.5 * w
    value, slope = (np.ascontiguousarray(_derivatives(tuple(zeta.tolist()), count, order)) for order in (0, 1))
    end, tip = (_derivatives((1.0,), count, order)[0] for order in (0, 1))
    clamp = np.concatenate([_derivatives((0.0,), count, order) for order in (2, 3)])
    mass, geometric = (np.ascontiguousarray(f.T @ (weights[:, None] * f)) for f in (value, slope))
    return Polynomials(zeta, weights, value, slope, end, tip, clamp, mass, geometric)


class StripBasis(NamedTuple):
    """Polynomials on a strip of free ``length`` [m] that satisfy the constraints; ``combination`` (polynomials, basis)
    expresses them in those of ``Polynomials``. Sections are given by zeta = z/l."""

    length: float
    combination: Array

    @property
    def polynomials(self) -> int:
        """Number of polynomials before the constraint."""
        return self.combination.shape[0]

    def values(self, zeta: Array, order: int) -> Array:
        """d^order psi/dz^order at the sections: (sections, basis)."""
        derivatives = _derivatives(tuple(zeta.tolist()), self.polynomials, order)
        return derivatives @ self.combination / self.length**order

    def series(self, order: int) -> Array:
        """Legendre coefficients over the strip of d^order psi/dz^order of the basis: (terms, basis)."""
        return _coefficients(self.polynomials, order) @ self.combination / self.length**order


def all_polynomials() -> Polynomials:
    """Table of the largest number of polynomials used for any force; its first n are those of the smaller tables."""
    return polynomials_of(_MAX_POLYNOMIALS)


@kernel
def pin_combination(table: Polynomials, head_ratio: float) -> tuple[float, float]:
    """Normalized combination of the first two polynomials without displacement of the pin, which the other polynomials
    do not displace; ``head_ratio`` is e/l."""
    first, second = table.end[0] + head_ratio * table.tip[0], table.end[1] + head_ratio * table.tip[1]
    norm = math.hypot(first, second)
    return -second / norm, first / norm


@kernel
def combine(row: Array, combination: tuple[float, float], out: Array) -> None:
    """Transform a row for the polynomials (n,) to the basis (n - 1,)."""
    out[0] = combination[0] * row[0] + combination[1] * row[1]
    for j in range(1, out.size):
        out[j] = row[j + 1]


@kernel
def energy_matrices(table: Polynomials, head_ratio: float, n: int) -> tuple[Array, Array, Array]:
    """Ritz matrices of the basis made of the first n + 1 polynomials, for a strip of unit length with its head: mass,
    int psi_i psi_j dz, and geometric stiffness, int psi_i' psi_j' dz + e psi_i'(l) psi_j'(l), (n, n) each; and the
    slopes psi_i'(l), (n,). The bending stiffness is the unit matrix."""
    combination = pin_combination(table, head_ratio)
    mass, geometric, tip, rows = np.empty((n, n)), np.empty((n, n)), np.empty(n), np.empty((n + 1, n))
    combine(table.tip[: n + 1], combination, tip)
    for k in range(2):
        for i in range(n + 1):
            combine(table.geometric[i, : n + 1] if k else table.mass[i, : n + 1], combination, rows[i])
        for j in range(n):
            combine(rows[:, j], combination, geometric[:, j] if k else mass[:, j])
    for i in range(n):
        for j in range(n):
            geometric[i, j] += head_ratio * tip[i] * tip[j]
    return mass, geometric, tip


@kernel
def frequency_under(
    table: Polynomials, stiffness: float, line_mass: float, length: float, rod_length: float, axial_force: float,
    polynomials: int,
) -> float:  # fmt: skip
    """First natural frequency [Hz] under an axial force [N], from EI [N m^2], rho A [kg/m], l and L [m], with a number
    of polynomials that grows under tension; 0 where the strip buckles."""
    # Tension confines bending to boundary layers of relative length 1/decay.
    decay = math.sqrt(max(axial_force, 0.0) / stiffness) * length
    # Limited before it becomes an integer, which an extreme tension would exceed.
    n = int(min(polynomials + math.ceil(min(0.5 * decay, 1.0 * _MAX_POLYNOMIALS)), _MAX_POLYNOMIALS))
    mass, system, _ = energy_matrices(table, rod_length / length - 1.0, n - 1)
    for i in range(n - 1):
        for j in range(n - 1):
            mass[i, j] *= length
            system[i, j] *= axial_force / length
        system[i, i] += stiffness / length**3
    square = line_mass * greatest_ratio(mass, system)
    return 1.0 / (TURN * math.sqrt(square)) if square > 0.0 else 0.0


@kernel
def greatest_ratio(mass: Array, system: Array) -> float:
    """Greatest x' mass x/(x' system x), or 0 if the second matrix is not positive definite.

    By power iteration with C^-1 mass C^-T, where system = C C'; the error of the Rayleigh quotient is of second order
    in that of the vector. Iterating for the greatest 1/omega^2 retains accuracy that the least omega^2 would lose to
    the greatest.
    """
    n = system.shape[0]
    c = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            total = system[i, j]
            for k in range(j):
                total -= c[i, k] * c[j, k]
            if i > j:
                c[i, j] = total / c[j, j]
            elif total > 0.0:
                c[i, i] = math.sqrt(total)
            else:
                return 0.0
    x, y = np.full(n, 1.0 / math.sqrt(n)), np.empty(n)
    value = 0.0
    for _ in range(_MAX_ITERATIONS):
        for i in range(n - 1, -1, -1):
            total = x[i]
            for k in range(i + 1, n):
                total -= c[k, i] * y[k]
            y[i] = total / c[i, i]
        image = np.zeros(n)
        for i in range(n):
            for k in range(n):
                image[i] += mass[i, k] * y[k]
        for i in range(n):
            total = image[i]
            for k in range(i):
                total -= c[i, k] * image[k]
            image[i] = total / c[i, i]
        before, value, size = value, 0.0, 0.0
        for i in range(n):
            value += x[i] * image[i]
            size += image[i] * image[i]
        if abs(value - before) <= _EPS * value:
            break
        for i in range(n):
            x[i] = image[i] / math.sqrt(size)
    return value
