"""The pin as a ring: how much it flattens under the pressure of rod and piston, and the stresses that come with it.

Up to d/D = 0.8 the textbook's formula for a thin ring under a pressure that goes with |sin| on both sides, with its
empirical factor K = 1.5 - 15 (alpha - 0.4)^3 for how the load spreads along the pin. Beyond, K falls to zero (at 0.864)
for no physical reason, and a mass optimiser would walk there; the plane elastic ring (Michell's series) takes over,
with K = 1. It gives more than the formula at the seam, so the deformation rises with the bore everywhere.

Sources: the ovalization formulas of the textbooks on engine design (Kolchin and Demidov); J. H. Michell (1899).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CLASSICAL_LIMIT = 0.8
"""d/D up to which the factor K is used."""

THIN_LIMIT = 0.999
"""d/D from which the plane elastic ring is a thin one."""

_LEAST_RATIO = 0.02
"""Below this d/D a pin is as good as solid: the inner fibre's stress formula has 1/alpha."""
_HARMONICS = 32


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
    # |sin theta| = 2/pi - (4/pi) sum over even n of cos(n theta)/(n^2 - 1), and the surface traction is -p.
    n = 2.0 * np.arange(1, _HARMONICS + 1)
    amplitude = 4.0 / (math.pi * (n * n - 1.0))
    hoops, displacement = _harmonics(n, ratio, poisson)
    side = hoop + amplitude @ hoops
    top = hoop + (amplitude * (-1.0) ** (n / 2.0)) @ hoops
    growth = float(hoop[0] - poisson * mean + amplitude @ displacement)
    stresses = RingStresses(*(float(pressure * s) for s in (side[0], side[1], top[0], top[1])))
    return Ring(2.0 * outer * pressure / modulus * growth, stresses, "plane elastic ring")


def _harmonics(n: Array, ratio: float, poisson: float) -> tuple[Array, Array]:
    """Hoop stress at the outer and inner surface (k, 2) and outer radial displacement (k,) for sigma_r = cos(n theta).

    Stress function f(r) cos(n theta), f = c1 r^n + c2 r^(n+2) + c3 (alpha/r)^n + c4 alpha^n r^(2-n), r relative to R.
    Stresses: sigma_r = f'/r - n^2 f/r^2, sigma_t = f'', tau = n (f/r)'. For f = r^p the displacement is
    E u_r = ((p - n^2)/(p - 1) - nu p) r^(p-1).
    """
    powers = np.stack([n, n + 2.0, -n, 2.0 - n], axis=1)
    k = n[:, None]
    decay = ratio**n

    def rows(r: float) -> tuple[Array, Array, Array]:
        fade = (ratio / r) ** n
        f = np.stack([r**n, r ** (n + 2.0), fade, fade * r * r], axis=1)
        first, second = powers * f / r, powers * (powers - 1.0) * f / r**2
        return first / r - k * k * f / r**2, second, k * (first / r - f / r**2)

    radial_out, hoop_out, shear_out = rows(1.0)
    radial_in, hoop_in, shear_in = rows(ratio)
    matrix = np.stack([radial_out, shear_out, radial_in, shear_in], axis=1)
    size = np.abs(matrix).max(axis=2)
    load = np.zeros_like(size)
    load[:, 0] = 1.0
    constants = np.linalg.solve(matrix / size[:, :, None], (load / size)[:, :, None])[:, :, 0]
    shift = (powers - k * k) / (powers - 1.0) - poisson * powers
    shift[:, 2:] *= decay[:, None]
    hoops = np.stack([(hoop_out * constants).sum(axis=1), (hoop_in * constants).sum(axis=1)], axis=1)
    return hoops, (shift * constants).sum(axis=1)


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


def greatest_ratio(
    limit: float, force: float, diameter: float, length: float, modulus: float, poisson: float
) -> float | None:
    """The greatest d/D whose ovalization, and that of every smaller bore, stays within ``limit``; None: not even 0."""

    def grows(ratio: float) -> float:
        return ring(force, diameter, length, ratio, modulus, poisson).ovalization

    if grows(0.0) > limit:
        return None
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        # Thinner than 1e-6 of the diameter no plane ring is solved any more: the thin ring's cube is far beyond.
        inside = middle < 1.0 - 1e-6 and grows(middle) <= limit
        low, high = (middle, high) if inside else (low, middle)
    return low


def ratio_at_stress(
    stress: float, force: float, diameter: float, length: float, modulus: float, poisson: float
) -> float:
    """The least d/D from 0.3 on, to 1e-6, at which the ring's greatest hoop stress reaches ``stress``.

    (Below 0.3 the formula's inner fibre has 1/alpha, for no ring any more.)
    """
    low, high = 0.3, 1.0
    if ring(force, diameter, length, low, modulus, poisson).stresses.greatest > stress:
        return low
    while high - low > 1e-6:
        middle = 0.5 * (low + high)
        beyond = (
            middle > 1.0 - 1e-6 or ring(force, diameter, length, middle, modulus, poisson).stresses.greatest > stress
        )
        low, high = (low, middle) if beyond else (middle, high)
    return high
