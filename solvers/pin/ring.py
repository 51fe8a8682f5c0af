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
from functools import lru_cache

import numpy as np

CLASSICAL_LIMIT = 0.8
"""d/D up to which the factor K is used."""

_LEAST_RATIO = 0.02
"""Below this d/D a pin is as good as solid: the inner fibre's stress formula has 1/alpha."""
_HARMONICS = 24


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
    side, top = np.zeros(2), np.zeros(2)
    growth = 0.0
    mean = -2.0 / math.pi
    # Lame: sigma_r = a + b/r^2 with r relative to R, zero at alpha and ``mean`` at 1.
    scale = mean / (1.0 - ratio**2)
    hoop = np.array([scale * (1.0 + ratio**2), 2.0 * scale])
    side, top = side + hoop, top + hoop
    growth += hoop[0] - poisson * mean
    for k in range(1, _HARMONICS + 1):
        n = 2 * k
        # |sin theta| = 2/pi - (4/pi) sum cos(2 k theta)/(4 k^2 - 1), and the surface traction is -p.
        hoops, displacement = _harmonic(n, ratio, poisson)
        amplitude = 4.0 / (math.pi * (n * n - 1.0))
        side = side + amplitude * hoops
        top = top + (-1.0) ** k * amplitude * hoops
        growth += amplitude * displacement
    stresses = RingStresses(*(float(pressure * s) for s in (side[0], side[1], top[0], top[1])))
    return Ring(float(2.0 * outer * pressure / modulus * growth), stresses, "plane elastic ring")


@lru_cache(maxsize=4096)
def _harmonic(n: int, ratio: float, poisson: float) -> tuple[np.ndarray, float]:
    """Hoop stress at the outer and inner surface and outer radial displacement for sigma_r = cos(n theta) outside.

    Stress function f(r) cos(n theta), f = c1 r^n + c2 r^(n+2) + c3 (alpha/r)^n + c4 alpha^n r^(2-n), r relative to R.
    Stresses per cos: sigma_r = f'/r - n^2 f/r^2, sigma_t = f''; per sin: tau = n (f/r)'. Displacement 2mu-free form:
    E u_r = integral of (sigma_r - nu sigma_t) plus what the hoop strain demands, term by term below.
    """

    def rows(r: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        decay = (ratio / r) ** n
        f = np.array([r**n, r ** (n + 2), decay, decay * r * r])
        p = np.array([n, n + 2, -n, 2 - n], dtype=float)
        first, second = p * f / r, p * (p - 1) * f / r**2
        radial = first / r - n * n * f / r**2
        return radial, second, n * (first / r - f / r**2)

    radial_out, hoop_out, shear_out = rows(1.0)
    radial_in, hoop_in, shear_in = rows(ratio)
    matrix = np.stack([radial_out, shear_out, radial_in, shear_in])
    size = np.abs(matrix).max(axis=1, keepdims=True)
    constants = np.linalg.solve(matrix / size, np.array([1.0, 0.0, 0.0, 0.0]) / size[:, 0])
    # E u_r of each term at r = 1 (plane stress): r^n, r^-n: -(1+nu) p r^(p-1); r^(n+2), r^(2-n) from Michell's table.
    decay = ratio**n
    radial_shift = np.array(
        [
            -(1.0 + poisson) * n,
            (2.0 - n) - poisson * (2.0 + n),
            (1.0 + poisson) * n * decay,
            ((2.0 + n) - poisson * (2.0 - n)) * decay,
        ]
    )
    return np.array([hoop_out @ constants, hoop_in @ constants]), float(radial_shift @ constants)


def ring(force: float, diameter: float, length: float, ratio: float, modulus: float, poisson: float) -> Ring:
    """The ring of bore ratio alpha = d/D, by the model that is valid there."""
    if ratio <= CLASSICAL_LIMIT:
        return classical(force, diameter, length, ratio, modulus)
    return thick_ring(force, diameter, length, ratio, modulus, poisson)


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
        # Thinner than 1e-6 of the diameter no plane ring is solved any more; the thin ring's cube is far beyond by then.
        inside = middle < 1.0 - 1e-6 and grows(middle) <= limit
        low, high = (middle, high) if inside else (low, middle)
    return low
