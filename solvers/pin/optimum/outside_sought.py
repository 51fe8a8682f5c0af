"""Bushing problem: bore d given, outer diameter D sought.

The length unit of u is the bore (for a shaft: a length scale from the load), walls are t = D - d [m]. Both
flexibilities are convex and decreasing for u > 0: a feasible bushing exists for every finite load and every deflection
limit.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from solvers.pin.limits import Limits
from solvers.pin.optimum.sought import Sought
from solvers.pin.ring import ovalization
from solvers.pin.scene import Scene
from solvers.pin.section.outside_wall import least_gap
from solvers.pin.section.strength import StrengthConstraint

Array = NDArray[np.float64]


class OutsideSought(Sought):
    """The outer diameter of a bushing with bore ``given`` d [m], or of a shaft, d = 0."""

    unit_diameter: ClassVar[float] = 1.0

    @property
    def kappa(self) -> float:
        return 1.0 if self.given > 0.0 else 0.0

    def floor(self, scene: Scene, limits: Limits) -> float:
        """Minimum D - d [m] under the limits; inf if even a solid bar, whose ovalization is independent of its
        diameter, exceeds the ovalization limit."""
        length, m, floor = scene.geometry.length, scene.material, 2.0 * limits.min_wall
        if scene.force == 0:
            return floor
        if limits.max_ring_stress is not None:
            outer = ovalization.outer_within_stress(
                limits.max_ring_stress, scene.force, self.given, length, m.elastic_modulus, m.poisson
            )
            floor = max(floor, outer - self.given)
        if limits.max_ovalization is None:
            return floor
        ratio = ovalization.greatest_ratio(
            limits.max_ovalization, scene.force, 1.0, length, m.elastic_modulus, m.poisson
        )
        if ratio is None:
            return math.inf
        if ratio > 0.0:
            return max(floor, self.given * (1.0 - ratio) / ratio)
        return math.inf if self.given > 0.0 else floor

    def least_walls(self, constraints: tuple[StrengthConstraint, ...], floor: float, stations: int) -> Array:
        return least_gap(constraints, self.given, floor, stations)

    def fitted(self, walls: Array, length: float) -> OutsideSought:
        return replace(self, unit=self.given or float(walls.max()) or length)

    def diameters(self, walls: Array) -> tuple[Array, Array]:
        return np.full_like(walls, self.given), self.sizes(walls)

    def over_ring_stress(self, scene: Scene, allowable: float, walls: Array) -> tuple[NDArray[np.bool_], str]:
        m = scene.material
        outer = ovalization.outer_within_stress(
            allowable, scene.force, self.given, scene.geometry.length, m.elastic_modulus, m.poisson
        )
        return self.sizes(walls) < outer, f"the outer diameter is less than {outer * 1e3:.4g} mm"
