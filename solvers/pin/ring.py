"""The pin as a ring: how much it flattens under the pressure of rod and piston, and the stresses that come with it.

Up to d/D = 0.8 the textbook's formula for a thin ring under a pressure that goes with |sin| on both sides, with its
empirical factor K = 1.5 - 15 (alpha - 0.4)^3 for how the load spreads along the pin. Beyond, K falls to zero (at 0.864)
for no physical reason, and a mass optimiser would walk there; the plane elastic ring (Michell's series) takes over,
with K = 1. It gives more than the formula at the seam, so the deformation rises with the bore everywhere.

Sources: the ovalization formulas of the textbooks on engine design (Kolchin and Demidov); J. H. Michell (1899).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel

Array = NDArray[np.float64]

CLASSICAL_LIMIT = 0.8
"""d/D up to which the factor K is used."""

THIN_LIMIT = 0.999
"""d/D from which the plane elastic ring is a thin one."""

_LEAST_RATIO = 0.02
"""Below this d/D a pin is as good as solid: the inner fibre's stress formula has 1/alpha."""
_HARMONICS = 2.0 * np.arange(1, 33)
_AMPLITUDES = 4.0 / (math.pi * (_HARMONICS**2 - 1.0))
_TURNED = _AMPLITUDES * (-1.0) ** (_HARMONICS / 2.0)
"""|sin theta| = 2/pi - (4/pi) sum over even n of cos(n theta)/(n^2 - 1); and the same from the top on."""
_LOOKS = 32
"""Steps in which the formula's first excess is looked for."""


@dataclass(frozen=True)
class RingStresses:
    """Hoop stresses [Pa] at the outer and inner fibre, at the side (the mean plane) and at the top (under the load)."""

    outer_side: float
    inner_side: float
    outer_top: float
    inner_top: float

    @property
    def greatest(self) -> float:
        return max(abs(self.outer_side), abs(self.inner_side), abs(self.outer_top), abs(self.inner_top))


@dataclass(frozen=True)
class Ring:
    """What the ring does: growth of the diameter across the load [m], stresses, and by which model."""

    ovalization: float
    stresses: RingStresses
    model: str


def load_factor(ratio: float) -> float:
    """K = 1.5 - 15 (alpha - 0.4)^3."""
    return 1.5 - 15.0 * (ratio - 0.4) ** 3


def classical(force: float, diameter: float, length: float, ratio: float, modulus: float) -> Ring:
    """0.09 (P/(E l)) ((1 + alpha)/(1 - alpha))^3 K and the stresses at the four points; alpha = d/D up to 0.8."""
    k, wall = load_factor(ratio), 1.0 - ratio
    a = max(ratio, _LEAST_RATIO)
    growth = 0.09 * force / (modulus * length) * ((1.0 + ratio) / wall) ** 3 * k
    f, g = k * force / (length * diameter), (1.0 + ratio) / wall**2
    stresses = RingStresses(
        outer_side=f * (0.19 * (2.0 + ratio) * g - 1.0 / wall),
        inner_side=-f * (0.19 * (1.0 + 2.0 * a) * g / a + 1.0 / wall),
        outer_top=-f * (0.174 * (2.0 + ratio) * g + 0.636 / wall),
        inner_top=f * (0.174 * (1.0 + 2.0 * a) * g / a - 0.636 / wall),
    )
    return Ring(growth, stresses, "thin ring with load factor")


def thick_ring(force: float, diameter: float, length: float, ratio: float, modulus: float, poisson: float) -> Ring:
    """The plane elastic ring under p = (2 P/(pi R l)) |sin theta| on its outer surface, inner surface free.

    theta is counted from the side; per harmonic Michell's four terms, whose constants meet the tractions of both
    surfaces. Plane stress. Hoop stresses at the four points; growth of the outer diameter at the side.
    """
    outer = 0.5 * diameter
    pressure = 2.0 * force / (math.pi * outer * length)
    mean = -2.0 / math.pi
    # Lame: sigma_r = a + b/r^2 with r relative to R, zero at alpha and ``mean`` at 1.
    scale = mean / (1.0 - ratio**2)
    hoop = np.array([scale * (1.0 + ratio**2), 2.0 * scale])
    # The surface traction is -p.
    hoops, displacement = _harmonics(_HARMONICS, ratio, poisson)
    side, top = hoop + _AMPLITUDES @ hoops, hoop + _TURNED @ hoops
    growth = float(hoop[0] - poisson * mean + _AMPLITUDES @ displacement)
    stresses = RingStresses(*(float(pressure * s) for s in (side[0], side[1], top[0], top[1])))
    return Ring(2.0 * outer * pressure / modulus * growth, stresses, "plane elastic ring")


def _harmonics(n: Array, ratio: float, poisson: float) -> tuple[Array, Array]:
    """Hoop stress at the outer and inner surface (k, 2) and outer radial displacement (k,) for sigma_r = cos(n theta).

    Stress function f(r) cos(n theta), f = c1 r^n + c2 r^(n+2) + c3 (alpha/r)^n + c4 alpha^n r^(2-n), r relative to R.
    Stresses: sigma_r = f'/r - n^2 f/r^2, sigma_t = f'', tau = n (f/r)'. For f = r^p the displacement is
    E u_r = ((p - n^2)/(p - 1) - nu p) r^(p-1).
    """
    hoops, growth = np.empty((n.size, 2)), np.empty(n.size)
    _solve_harmonics(n, ratio, poisson, hoops, growth)
    return hoops, growth


@kernel
def _solve_harmonics(harmonics: Array, ratio: float, poisson: float, hoops: Array, growth: Array) -> None:
    powers, f, size = np.empty(4), np.empty((2, 4)), np.empty(4)
    matrix, hoop, constants = np.empty((4, 4)), np.empty((2, 4)), np.empty(4)
    for k in range(harmonics.size):
        n = harmonics[k]
        decay = ratio**n
        powers[0], powers[1], powers[2], powers[3] = n, n + 2.0, -n, 2.0 - n
        f[0, 0], f[0, 1], f[0, 2], f[0, 3] = 1.0, 1.0, decay, decay
        f[1, 0], f[1, 1], f[1, 2], f[1, 3] = decay, decay * ratio * ratio, 1.0, ratio * ratio
        for side in range(2):
            r = 1.0 if side == 0 else ratio
            for j in range(4):
                first, p = powers[j] * f[side, j] / r, powers[j]
                hoop[side, j] = p * (p - 1.0) * f[side, j] / (r * r)
                matrix[2 * side, j] = first / r - n * n * f[side, j] / (r * r)
                matrix[2 * side + 1, j] = n * (first / r - f[side, j] / (r * r))
        for i in range(4):
            size[i] = 0.0
            for j in range(4):
                size[i] = max(size[i], abs(matrix[i, j]))
            for j in range(4):
                matrix[i, j] /= size[i]
            constants[i] = 1.0 / size[0] if i == 0 else 0.0
        _eliminate(matrix, constants)
        hoops[k, 0], hoops[k, 1], growth[k] = 0.0, 0.0, 0.0
        for j in range(4):
            p = powers[j]
            shift = (p - n * n) / (p - 1.0) - poisson * p
            hoops[k, 0] += hoop[0, j] * constants[j]
            hoops[k, 1] += hoop[1, j] * constants[j]
            growth[k] += shift * f[0, j] * constants[j]


@kernel
def _eliminate(matrix: Array, load: Array) -> None:
    """Solve a small linear system in place, the greatest pivot of a column first; the answer is in ``load``."""
    n = load.size
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        for j in range(n):
            matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        load[k], load[best] = load[best], load[k]
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            for j in range(k, n):
                matrix[i, j] -= factor * matrix[k, j]
            load[i] -= factor * load[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            load[k] -= matrix[k, j] * load[j]
        load[k] /= matrix[k, k]


def ring(force: float, diameter: float, length: float, ratio: float, modulus: float, poisson: float) -> Ring:
    """The ring of bore ratio alpha = d/D, by the model that is valid there."""
    if ratio <= CLASSICAL_LIMIT:
        return classical(force, diameter, length, ratio, modulus)
    if ratio <= THIN_LIMIT:
        return thick_ring(force, diameter, length, ratio, modulus, poisson)
    return _thin_ring(thick_ring(force, diameter, length, THIN_LIMIT, modulus, poisson), ratio)


def _thin_ring(least: Ring, ratio: float) -> Ring:
    """The ring at THIN_LIMIT, its growth and bending stresses taken on as a thin ring's: exact to 1e-6 and to 1e-3.

    Beyond, the series' four constants cancel until nothing is left of them.
    """
    thinner = (1.0 - THIN_LIMIT) / (1.0 - ratio)
    wider = (1.0 + ratio) / (1.0 + THIN_LIMIT)
    bend = wider * thinner**2
    s = least.stresses
    stresses = RingStresses(bend * s.outer_side, bend * s.inner_side, bend * s.outer_top, bend * s.inner_top)
    return Ring(least.ovalization * (wider * thinner) ** 3, stresses, "thin elastic ring")


def _crossing(
    ring_at: Callable[[float], Ring], measure: Callable[[Ring], float], limit: float, start: float, tolerance: float
) -> float:
    """The greatest d/D up to which ``measure`` stays within ``limit``, from ``start`` on, where it does.

    The formula's values need not rise all the way (its K falls), so its first excess is looked for step by step; those
    of the elastic ring do.
    """

    def fits(ratio: float) -> bool:
        return measure(ring_at(ratio)) <= limit

    steps = [start + (CLASSICAL_LIMIT - start) * k / _LOOKS for k in range(_LOOKS)] + [CLASSICAL_LIMIT]
    # Thinner than 1e-6 of the diameter no plane ring is solved any more: the thin ring's cube is far beyond.
    low, high = CLASSICAL_LIMIT, 1.0 - 1e-6
    for before, after in pairwise(steps):
        if not fits(after):
            low, high = before, after
            break
    while high - low > tolerance:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low


def greatest_ratio(
    limit: float, force: float, diameter: float, length: float, modulus: float, poisson: float
) -> float | None:
    """The greatest d/D whose ovalization, and that of every smaller bore, stays within ``limit``; None: not even 0."""

    def at(ratio: float) -> Ring:
        return ring(force, diameter, length, ratio, modulus, poisson)

    return None if at(0.0).ovalization > limit else _crossing(at, lambda found: found.ovalization, limit, 0.0, 2e-16)


def ratio_at_stress(
    stress: float, force: float, diameter: float, length: float, modulus: float, poisson: float
) -> float:
    """The least d/D from 0.3 on, to 1e-6, at which the ring's greatest hoop stress reaches ``stress``.

    (Below 0.3 the formula's inner fibre has 1/alpha, for no ring any more.)
    """

    def at(ratio: float) -> Ring:
        return ring(force, diameter, length, ratio, modulus, poisson)

    least = 0.3
    if at(least).stresses.greatest > stress:
        return least
    return _crossing(at, lambda found: found.stresses.greatest, stress, least, 1e-6)
