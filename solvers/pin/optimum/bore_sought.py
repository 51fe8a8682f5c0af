"""Pin problem: outer diameter D given, bore d sought.

u = 1 - (d/D)^2 is the solid fraction of the section, walls are w = 1 - d/D, and the deflection coefficients are those
of the solid section.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput
from solvers.pin.limits import Limits
from solvers.pin.optimum.sought import Sought
from solvers.pin.ring import ovalization
from solvers.pin.scene import Scene
from solvers.pin.section.strength import StrengthConstraint, least_wall

Array = NDArray[np.float64]
_NEARLY_SOLID = 0.99
"""Value of u above which 1 - u has lost a significant digit."""


class BoreSought(Sought):
    """The bore of a pin with outer diameter ``given`` D [m]."""

    kappa: ClassVar[float] = -1.0

    @property
    def unit_diameter(self) -> float:
        return self.given

    def floor(self, scene: Scene, limits: Limits) -> float:
        """Minimum relative wall under the limits; NaN if even a solid pin violates them. Raises InvalidInput for a
        minimum wall above the radius."""
        m = scene.material
        floor = 2.0 * limits.min_wall / self.given
        if floor > 1.0:
            raise InvalidInput("limits.min_wall", "is more than the pin's radius", "at most half the outer diameter")
        if scene.force == 0:
            return floor
        of_pin = scene.force, self.given, scene.geometry.length, m.elastic_modulus, m.poisson
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

    def diameters(self, walls: Array) -> tuple[Array, Array]:
        return self.sizes(walls), np.full_like(walls, self.given)

    def over_ring_stress(self, scene: Scene, allowable: float, walls: Array) -> tuple[NDArray[np.bool_], str]:
        m = scene.material
        of_pin = scene.force, self.given, scene.geometry.length, m.elastic_modulus, m.poisson
        ratio = ovalization.ratio_within_stress(allowable, *of_pin) or ovalization.MIN_HOOP_RATIO
        return 1.0 - walls > ratio, f"the bore is wider than {ratio * self.given * 1e3:.4g} mm"

    def walls(self, constraints: tuple[StrengthConstraint, ...], floor: float, u: Array) -> Array:
        """Return the walls of u, restoring digits lost near the solid section.

        u = 1 - (d/D)^2 cannot resolve bores below 1e-8 of the diameter. Where u equals a station's lower bound, w is
        taken from the wall computed at that station (preferably the station itself).
        """
        found = self.wall_of(u)
        if not (u > _NEARLY_SOLID).any():
            return found
        near = np.flatnonzero(u > _NEARLY_SOLID)
        own = [replace(c, bending=c.bending[near], shear=c.shear[near]) for c in constraints]
        least = least_wall(own, floor, near.size)
        rising = np.sort(least)
        lower, exact, wanted = self.solidity_of(rising), self.solidity_of(least), u[near]
        like = np.searchsorted(lower, wanted, side="right") - 1
        like = np.where((like >= 0) & (lower[like] == wanted), rising[like], found[near])
        found[near] = np.where(exact == wanted, least, like)
        return found
