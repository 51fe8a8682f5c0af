"""Bushing problem: bore d given, outer diameter D sought.

u = y = (D^2 - d^2)/l^2 with l the bore (for a shaft: a length scale from the load), walls are t = D - d [m]. f is
the section's bending flexibility over 64/(E pi l^4), g its shear flexibility over 4/(G pi l^2)
(``solvers.pin.section.flexibility``), kappa 1 with a bore and 0 without. Both are convex and decreasing for y > 0: a
feasible bushing exists for every finite load and every deflection limit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from solvers.pin.limits import Limits
from solvers.pin.optimum.program import Program
from solvers.pin.ring import ovalization
from solvers.pin.scene import Scene
from solvers.pin.section.outside_wall import least_gap
from solvers.pin.section.strength import StrengthConstraint, uses

Array = NDArray[np.float64]


@dataclass(frozen=True)
class OutsideSought:
    """Bushing with ``bore`` d [m] (0: a shaft) and length unit ``unit`` l [m]; see
    ``solvers.pin.optimum.program.Sought``."""

    bore: float
    unit: float
    unit_diameter: ClassVar[float] = 1.0

    @property
    def kappa(self) -> float:
        return 1.0 if self.bore > 0.0 else 0.0

    def floor(self, scene: Scene, limits: Limits) -> float:
        """inf if even a solid bar exceeds the ovalization limit (its ovalization is independent of the diameter)."""
        length, m, floor = scene.geometry.length, scene.material, 2.0 * limits.min_wall
        if scene.force == 0:
            return floor
        if limits.max_ring_stress is not None:
            outer = ovalization.outer_within_stress(
                limits.max_ring_stress, scene.force, self.bore, length, m.elastic_modulus, m.poisson
            )
            floor = max(floor, outer - self.bore)
        if limits.max_ovalization is None:
            return floor
        ratio = ovalization.greatest_ratio(
            limits.max_ovalization, scene.force, 1.0, length, m.elastic_modulus, m.poisson
        )
        if ratio is None:
            return math.inf
        if ratio > 0.0:
            return max(floor, self.bore * (1.0 - ratio) / ratio)
        return math.inf if self.bore > 0.0 else floor

    def least_walls(self, constraints: tuple[StrengthConstraint, ...], floor: float, stations: int) -> Array:
        return least_gap(constraints, self.bore, floor, stations)

    def fitted(self, walls: Array, length: float) -> OutsideSought:
        return replace(self, unit=self.bore or float(walls.max()) or length)

    def stiffness(self, scene: Scene) -> tuple[float, float]:
        m, unit = scene.material, self.unit
        return m.elastic_modulus * math.pi * unit**4 / 64.0, m.shear_modulus * math.pi * unit**2 / 4.0

    def uses(self, constraints: tuple[StrengthConstraint, ...], walls: Array) -> Array:
        return uses(constraints, np.full_like(walls, self.bore), walls)

    def solidity_of(self, walls: Array) -> Array:
        """y = t (2d + t)/l^2."""
        return walls * (2.0 * self.bore + walls) / self.unit**2

    def wall_of(self, u: Array) -> Array:
        """t = D - d [m], without cancellation: z/(d + sqrt(d^2 + z)), z = y l^2."""
        z, d = u * self.unit**2, self.bore
        with np.errstate(invalid="ignore"):
            return np.where(z > 0.0, z / (d + np.sqrt(d * d + z)), 0.0)

    def walls(self, program: Program, u: Array) -> Array:
        return self.wall_of(u)

    def sizes(self, walls: Array) -> Array:
        return self.bore + walls

    def diameters(self, sizes: Array) -> tuple[Array, Array]:
        return np.full_like(sizes, self.bore), sizes

    def pair(self, size: float) -> tuple[float, float]:
        return self.bore, size

    def thinnest(self, sizes: Array) -> float:
        return float(sizes.min())

    def thickness(self, wall: Array | float) -> Array | float:
        return wall

    def over_ring_stress(self, scene: Scene, allowable: float, walls: Array) -> tuple[NDArray[np.bool_], str]:
        m = scene.material
        outer = ovalization.outer_within_stress(
            allowable, scene.force, self.bore, scene.geometry.length, m.elastic_modulus, m.poisson
        )
        return self.sizes(walls) < outer, f"the outer diameter is less than {outer * 1e3:.4g} mm"

    def with_wall(self, size: float, share: float) -> float:
        return max(size, self.bore / (1.0 - share), 1e-9)

    def mass_unit(self, scene: Scene) -> float:
        return scene.material.density * math.pi / 4.0 * self.unit**2 * scene.geometry.length

    def mass_of(self, scene: Scene, x: Array, sizes: Array) -> float:
        """Mass of frustums minus the bore: D^2 - d^2 over linear segments, in t = D - d to keep the digits of thin
        walls."""
        d, t = self.bore, self.points(sizes)
        a, b = t[:-1], t[1:]
        mean = d * (a + b) + (a * a + a * b + b * b) / 3.0
        return scene.material.density * math.pi / 4.0 * float(np.diff(x) @ mean)

    def points(self, sizes: Array) -> Array:
        return np.maximum(sizes - self.bore, 0.0)

    def relative(self, points: Array) -> Array:
        return points

    def growth(self, thickest: float) -> float:
        """y = t (2d + t)/l^2."""
        return 2.0 * (self.bore + thickest) / self.unit**2
