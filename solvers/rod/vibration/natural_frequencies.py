"""The strip as a vibrating body: modes in place, under a constant axial force.

    EI V'''' - P V'' + rho A V_tt = 0,  V(0) = V'(0) = 0,  V(l) + e V'(l) = 0,  M(L) = 0

Ritz's method with polynomials whose second derivatives are Legendre's, so that the bending energy is a sum of squares
and low frequencies keep their digits however many polynomials there are. They satisfy the clamp's conditions by
themselves and the pin's by a combination; the moment condition is natural. The rigid head turns with the strip's end,
so the axial force works through P (int V'^2 dz + e V'(l)^2)/2. The head's own mass is not modelled (it is guided by the
crank). Frequencies come from above and converge faster than any power of the number of polynomials.

Source: W. Ritz (1909); S. P. Timoshenko, Vibration Problems in Engineering.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.numerics.legendre import legendre_at
from solvers.rod.scene import Dimensions, Scene

Array = NDArray[np.float64]

POLYNOMIALS = 14
FEW_POLYNOMIALS, OF_FEW = 9, 1e-8
"""Enough for the first frequency alone where little accuracy is asked for, and what they may miss of it: 1e-9 was the
most of 4,000 strips from l = L/11 to L, from the edge of buckling to strong tension."""
_MORE_POINTS = 6
_MOST_POWERS = 500
_MOST_POLYNOMIALS = 60
_EPS = float(np.finfo(float).eps)


@lru_cache(maxsize=64)
def _coefficients(polynomials: int, order: int) -> Array:
    """Legendre coefficients over [0, 1] of the basis polynomials' derivatives of this order: (degree, basis)."""
    columns = np.zeros((polynomials + 2, polynomials))
    for j in range(polynomials):
        series = np.zeros(j + 1)
        series[j] = math.sqrt(2 * j + 1)
        # Legendre's variable runs twice as fast as zeta, and from -1, where the clamp is.
        if order < 2:
            series = legendre.legint(series, 2 - order, lbnd=-1.0, scl=0.5)
        else:
            series = legendre.legder(series, order - 2, scl=2.0)
        columns[: series.size, j] = series
    return columns


@lru_cache(maxsize=256)
def _derivatives(zeta: tuple[float, ...], polynomials: int, order: int) -> Array:
    """Derivatives d^order/dzeta^order of the polynomials, whose second ones have unit norm: (points, basis)."""
    return legendre_at(2.0 * np.array(zeta) - 1.0, polynomials + 1) @ _coefficients(polynomials, order)


class Polynomials(NamedTuple):
    """Over a strip of unit length: Gauss's points and weights that integrate products of two of them exactly, value and
    slope there, (points, n); value and slope at the far end, (n,); second and third derivatives at the clamp, (2, n);
    int psi_i psi_j dz and int psi_i' psi_j' dz, (n, n)."""

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
    """So many polynomials."""
    x, w = legendre.leggauss(count + _MORE_POINTS)
    zeta, weights = 0.5 * (x + 1.0), 0.5 * w
    value, slope = (np.ascontiguousarray(_derivatives(tuple(zeta.tolist()), count, order)) for order in (0, 1))
    end, tip = (_derivatives((1.0,), count, order)[0] for order in (0, 1))
    clamp = np.concatenate([_derivatives((0.0,), count, order) for order in (2, 3)])
    mass, geometric = (np.ascontiguousarray(f.T @ (weights[:, None] * f)) for f in (value, slope))
    return Polynomials(zeta, weights, value, slope, end, tip, clamp, mass, geometric)


class StripBasis(NamedTuple):
    """Polynomials on a strip of free ``length`` [m] that satisfy the constraints; ``combination`` maps them to those of
    ``Polynomials``, shape (polynomials, basis). Sections are told by zeta = z/l."""

    length: float
    combination: Array

    @property
    def polynomials(self) -> int:
        """How many there are."""
        return self.combination.shape[0]

    def values(self, zeta: Array, order: int) -> Array:
        """d^order psi/dz^order at the sections: (sections, basis)."""
        one = _derivatives(tuple(zeta.tolist()), self.polynomials, order)
        return one @ self.combination / self.length**order

    def series(self, order: int) -> Array:
        """Legendre coefficients over the strip of d^order psi/dz^order of the basis: (terms, basis)."""
        return _coefficients(self.polynomials, order) @ self.combination / self.length**order


def all_polynomials() -> Polynomials:
    """As many polynomials as any force asks for; the first so many of them are those of a smaller basis."""
    return polynomials_of(_MOST_POLYNOMIALS)


def natural_frequency(scene: Scene, dimensions: Dimensions, axial_force: float) -> float:
    """First natural frequency [Hz] of the strip in place under a constant axial force [N]; 0 where it buckles."""
    stiffness = scene.material.elastic_modulus * dimensions.b * dimensions.h**3 / 12.0
    line_mass = scene.material.density * dimensions.b * dimensions.h
    return frequency_under(
        all_polynomials(),
        stiffness,
        line_mass,
        dimensions.l,
        scene.mechanism.rod_length,
        float(axial_force),
        POLYNOMIALS,
    )


@kernel
def pinned(table: Polynomials, lever: float) -> tuple[float, float]:
    """The combination of the first two polynomials that leaves the pin where it is, (e/l = ``lever``); of all
    polynomials these alone move it."""
    first, second = table.end[0] + lever * table.tip[0], table.end[1] + lever * table.tip[1]
    size = math.hypot(first, second)
    return -second / size, first / size


@kernel
def combined(row: Array, blend: tuple[float, float], out: Array) -> None:
    """What belongs to the basis (n - 1,) from what belongs to the polynomials (n,)."""
    out[0] = blend[0] * row[0] + blend[1] * row[1]
    for j in range(1, out.size):
        out[j] = row[j + 1]


@kernel
def energies(table: Polynomials, lever: float, n: int) -> tuple[Array, Array, Array]:
    """Of the basis made of the first n + 1 polynomials, over a strip of unit length with its head: int psi_i psi_j dz,
    and int psi_i' psi_j' dz + e psi_i'(l) psi_j'(l), (n, n); psi_i'(l), (n,). The bending energy is the unit matrix."""
    blend = pinned(table, lever)
    mass, geometric, tip, rows = np.empty((n, n)), np.empty((n, n)), np.empty(n), np.empty((n + 1, n))
    combined(table.tip[: n + 1], blend, tip)
    for k in range(2):
        for i in range(n + 1):
            combined(table.geometric[i, : n + 1] if k else table.mass[i, : n + 1], blend, rows[i])
        for j in range(n):
            combined(rows[:, j], blend, geometric[:, j] if k else mass[:, j])
    for i in range(n):
        for j in range(n):
            geometric[i, j] += lever * tip[i] * tip[j]
    return mass, geometric, tip


@kernel
def frequency_under(
    table: Polynomials, stiffness: float, line_mass: float, length: float, rod_length: float, axial_force: float,
    polynomials: int,
) -> float:  # fmt: skip
    """First natural frequency [Hz] under an axial force [N], from EI [N m^2], rho A [kg/m], l and L [m], by so many
    polynomials and, in tension, some more."""
    # Under tension the strip bends in layers at its ends, 1/decay of its length.
    decay = math.sqrt(max(axial_force, 0.0) / stiffness) * length
    n = int(min(polynomials + math.ceil(0.5 * decay), _MOST_POLYNOMIALS))
    mass, system, _ = energies(table, rod_length / length - 1.0, n - 1)
    for i in range(n - 1):
        for j in range(n - 1):
            mass[i, j] *= length
            system[i, j] *= axial_force / length
        system[i, i] += stiffness / length**3
    square = line_mass * greatest_ratio(mass, system)
    return 1.0 / (2.0 * math.pi * math.sqrt(square)) if square > 0.0 else 0.0


@kernel
def greatest_ratio(mass: Array, system: Array) -> float:
    """The greatest x' mass x/(x' system x), or 0 where the second matrix is not positive definite.

    By powers of C^-1 mass C^-T, with system = C C'; the quotient's error falls with the square of the vector's. The
    greatest 1/omega^2 keeps the digits that the least omega^2 would lose to the greatest.
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
    for _ in range(_MOST_POWERS):
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
