"""Pin problem: outer diameter D given, bore d sought.

u = 1 - (d/D)^2 is the solid fraction of the section, walls are w = 1 - d/D; f = 1/v = 1/(u (2 - u)) and g are those of
``solvers.pin.section.flexibility``, so the deflection coefficients are those of the solid section.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput
from solvers.pin.limits import Limits
from solvers.pin.optimum.program import Program
from solvers.pin.ring import ovalization
from solvers.pin.scene import Scene
from solvers.pin.section.strength import StrengthConstraint, least_wall, uses
from solvers.pin.section.variables import solidity_of, wall_of

Array = NDArray[np.float64]
_NEARLY_SOLID = 0.99
"""Value of u above which 1 - u has lost a significant digit."""


@dataclass(frozen=True)
class BoreSought:
    """Pin with outer diameter ``diameter`` D [m]; see ``solvers.pin.optimum.program.Sought``."""

    diameter: float
    kappa: ClassVar[float] = -1.0

    @property
    def unit_diameter(self) -> float:
        return self.diameter

    def floor(self, scene: Scene, limits: Limits) -> float:
        """NaN if even a solid pin violates the limits. Raises InvalidInput for a minimum wall above the radius."""
        m = scene.material
        floor = 2.0 * limits.min_wall / self.diameter
        if floor > 1.0:
            raise InvalidInput("limits.min_wall", "is more than the pin's radius", "at most half the outer diameter")
        if scene.force == 0:
            return floor
        of_pin = scene.force, self.diameter, scene.geometry.length, m.elastic_modulus, m.poisson
        for limit, greatest in (
            (limits.max_ovalization, ovalization.greatest_ratio),
            (limits.max_ring_stress, ovalization.ratio_within_stress),
        ):
            ratio = None if limit is None else greatest(limit, *of_pin)
            if ratio is not None:
                floor = max(floor, 1.0 - ratio)
            elif limit is not None:
                return math.nan
        return floor

    def least_walls(self, constraints: tuple[StrengthConstraint, ...], floor: float, stations: int) -> Array:
        return least_wall(constraints, floor, stations)

    def fitted(self, walls: Array, length: float) -> BoreSought:
        return self

    def stiffness(self, scene: Scene) -> tuple[float, float]:
        g, m = scene.geometry, scene.material
        return m.elastic_modulus * g.inertia, m.shear_modulus * g.area

    def uses(self, constraints: tuple[StrengthConstraint, ...], walls: Array) -> Array:
        return uses(constraints, 1.0 - walls, walls)

    def solidity_of(self, walls: Array) -> Array:
        return solidity_of(walls)

    def wall_of(self, u: Array) -> Array:
        return wall_of(u)

    def walls(self, program: Program, u: Array) -> Array:
        """Return the walls of u, restoring digits lost near the solid section.

        u = 1 - (d/D)^2 cannot resolve bores below 1e-8 of the diameter. Where u equals a station's lower bound, w is
        taken from the wall computed at that station (preferably the station itself).
        """
        found, near = wall_of(u), np.flatnonzero(u > _NEARLY_SOLID)
        if not near.size:
            return found
        constraints = [replace(c, bending=c.bending[near], shear=c.shear[near]) for c in program.constraints]
        least = least_wall(constraints, program.floor, near.size)
        rising = np.sort(least)
        lower, own, wanted = solidity_of(rising), solidity_of(least), u[near]
        like = np.searchsorted(lower, wanted, side="right") - 1
        like = np.where((like >= 0) & (lower[like] == wanted), rising[like], found[near])
        found[near] = np.where(own == wanted, least, like)
        return found

    def sizes(self, walls: Array) -> Array:
        return self.diameter * (1.0 - walls)

    def diameters(self, sizes: Array) -> tuple[Array, Array]:
        return sizes, np.full_like(sizes, self.diameter)

    def pair(self, size: float) -> tuple[float, float]:
        return size, self.diameter

    def thinnest(self, sizes: Array) -> float:
        return float(sizes.max())

    def thickness(self, wall: Array | float) -> Array | float:
        return self.diameter * wall

    def over_ring_stress(self, scene: Scene, allowable: float, walls: Array) -> tuple[NDArray[np.bool_], str]:
        m = scene.material
        of_pin = scene.force, self.diameter, scene.geometry.length, m.elastic_modulus, m.poisson
        ratio = ovalization.ratio_within_stress(allowable, *of_pin) or ovalization.MIN_HOOP_RATIO
        return 1.0 - walls > ratio, f"the bore is wider than {ratio * self.diameter * 1e3:.4g} mm"

    def with_wall(self, size: float, share: float) -> float:
        return min(size, self.diameter * (1.0 - share))

    def mass_unit(self, scene: Scene) -> float:
        g = scene.geometry
        return scene.material.density * g.area * g.length

    def mass_of(self, scene: Scene, x: Array, sizes: Array) -> float:
        """Mass of frustums, in terms of walls to keep the significant digits of a thin tube.

        Over a segment u = w (2 - w) with w linear: mean 2 m - (w0^2 + w0 w1 + w1^2)/3, m = (w0 + w1)/2.
        """
        w = self.relative(self.points(sizes))
        a, b = w[:-1], w[1:]
        mean = (a + b) - (a * a + a * b + b * b) / 3.0
        return self.mass_unit(scene) * float(np.sum(np.diff(x) * mean) / scene.geometry.length)

    def points(self, sizes: Array) -> Array:
        return np.maximum(self.diameter - sizes, 0.0)

    def relative(self, points: Array) -> Array:
        return points / self.diameter

    def growth(self, thickest: float) -> float:
        return 2.0 / self.diameter
