"""Design variable: bore of a pin or outer diameter of a bushing, with its walls, measure u of material and masses.

With the given diameter G, the thickness t = D - d, and kappa = -1 for a pin's bore, 1 for a bushing's outer diameter
around a bore and 0 for a shaft's, D^2 - d^2 = t (2 G -+ t) and

    u = (D^2 - d^2)/l^2,

l being a length unit. Bending and shear flexibility are f(u) over 64/(E pi l^4) and g(u) over 4/(G pi l^2)
(``solvers.pin.section.flexibility``).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.pin.limits import Limits
from solvers.pin.ring import ovalization
from solvers.pin.scene import BushingGeometry, Scene
from solvers.pin.section.least_wall import least_bushing_wall, least_wall
from solvers.pin.section.strength import StrengthConstraint, utilisations


@dataclass(frozen=True)
class DesignVariable(ABC):
    """Diameter to be designed, for a fixed value ``given`` G [m] of the other diameter.

    u, walls and sizes (the unknown diameter [m]) are arrays (n,). Walls are (D - d)/``unit_diameter``, with the unit
    diameter [m] of the strength constraints; ``unit`` is l [m].
    """

    given: float
    unit: float

    @property
    @abstractmethod
    def unit_diameter(self) -> float:
        """D of a pin, 1 m for a bushing."""

    @property
    @abstractmethod
    def kappa(self) -> float:
        """kappa of the flexibilities: -1 for a pin, 1 for a bushing, 0 for a shaft."""

    @abstractmethod
    def floor(self, scene: Scene, limits: Limits) -> float:
        """Return the minimum wall under the limits on wall, ovalization and hoop stress; not finite if infeasible."""

    @abstractmethod
    def least_walls(self, constraints: tuple[StrengthConstraint, ...], floor: float, stations: int) -> Array:
        """Return the minimum walls that satisfy all constraints and the floor; NaN where even the solid section
        fails."""

    @abstractmethod
    def diameters(self, walls: Array) -> tuple[Array, Array]:
        """Return bores and outer diameters [m] for given walls."""

    @abstractmethod
    def relative_bores(self, walls: Array) -> Array:
        """Return bores over the unit diameter for given walls."""

    @abstractmethod
    def over_ring_stress(self, scene: Scene, allowable: float, walls: Array) -> tuple[NDArray[np.bool_], str]:
        """Return a mask of the stations whose hoop stress exceeds the allowable, and a description of their sizes."""

    @property
    def thickest(self) -> float:
        """Wall of the solid section; infinite for a bushing."""
        return 1.0 if self.kappa < 0.0 else math.inf

    def rescaled(self, walls: Array, length: float) -> DesignVariable:
        """Return a copy whose length unit suits the walls, if the unit depends on them."""
        return self

    @property
    def sign(self) -> float:
        """-1 if the given diameter is the outer one, 1 if it is the bore."""
        return -1.0 if self.kappa < 0.0 else 1.0

    def stiffness(self, scene: Scene) -> tuple[float, float]:
        """Return E I [N m^2] and G A [N] of f = g = 1, the divisors of M m and Q q that give B and S per length [1]."""
        m = scene.material
        return m.elastic_modulus * math.pi * self.unit**4 / 64.0, m.shear_modulus * math.pi * self.unit**2 / 4.0

    def utilisations(self, constraints: tuple[StrengthConstraint, ...], walls: Array) -> Array:
        """Return the strength utilisation of the criterion and of the shear allowable, (2, n)."""
        return utilisations(constraints, self.relative_bores(walls), walls)

    def solidity_of(self, walls: Array) -> Array:
        """Return u for given walls, t (2 G -+ t)/l^2."""
        scale = self.unit_diameter / self.unit
        return (scale * walls) * (2.0 * self.given / self.unit + (self.sign * scale) * walls)

    def wall_of(self, u: Array) -> Array:
        """Return the walls for given u without cancellation: t = z/(G + sqrt(G^2 +- z)), z = u l^2; 0 where u <= 0."""
        return _walls_of(u, self.given / self.unit, self.sign, self.unit / self.unit_diameter)

    def sizes(self, walls: Array) -> Array:
        """Unknown diameter [m] for given walls."""
        return self.given + (self.sign * self.unit_diameter) * walls

    def thickness(self, sizes: Array) -> Array:
        """Return D - d [m] for given sizes."""
        return np.maximum(self.sign * (sizes - self.given), 0.0)

    def mass_unit(self, scene: Scene) -> float:
        """Mass [kg] of a part with u = 1 throughout."""
        return scene.material.density * math.pi / 4.0 * self.unit**2 * scene.geometry.length

    def mass_of(self, scene: Scene, x: Array, sizes: Array) -> float:
        """Return the mass [kg] for sizes that vary linearly between positions x [m].

        With t linear over a segment the mean of t (2 G -+ t) is G (t0 + t1) -+ (t0^2 + t0 t1 + t1^2)/3, free of
        cancellation for a thin tube.
        """
        t = self.thickness(sizes)
        a, b = t[:-1], t[1:]
        mean = self.given * (a + b) + self.sign * (a * a + a * b + b * b) / 3.0
        return scene.material.density * math.pi / 4.0 * float(np.diff(x) @ mean)

    def max_derivative(self, thickest: float) -> float:
        """Maximum derivative of u with respect to t [1/m], up to the thickest t [m]."""
        return 2.0 * (self.given + max(self.sign, 0.0) * thickest) / self.unit**2


class BoreVariable(DesignVariable):
    """Bore of a pin with outer diameter ``given`` D [m].

    u = 1 - (d/D)^2 is the solid fraction of the section, walls are w = 1 - d/D, and the deflection coefficients are
    those of the solid section.
    """

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

    def relative_bores(self, walls: Array) -> Array:
        return 1.0 - walls

    def over_ring_stress(self, scene: Scene, allowable: float, walls: Array) -> tuple[NDArray[np.bool_], str]:
        m = scene.material
        of_pin = scene.force, self.given, scene.geometry.length, m.elastic_modulus, m.poisson
        ratio = ovalization.ratio_within_stress(allowable, *of_pin) or ovalization.MIN_HOOP_RATIO
        return 1.0 - walls > ratio, f"the bore is wider than {ratio * self.given * 1e3:.4g} mm"


class OuterDiameterVariable(DesignVariable):
    """Outer diameter of a bushing with bore ``given`` d [m], or of a shaft, d = 0.

    The length unit of u is the bore (for a shaft: a length scale from the load), walls are t = D - d [m]. Both
    flexibilities are convex and decreasing for u > 0: a feasible bushing exists for every finite load and every
    deflection limit.
    """

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
        return least_bushing_wall(constraints, self.given, floor, stations)

    def rescaled(self, walls: Array, length: float) -> OuterDiameterVariable:
        # Infinite walls: the limits are unattainable, which a check reports only.
        largest = float(walls.max())
        return replace(self, unit=self.given or (largest if 0.0 < largest < math.inf else length))

    def diameters(self, walls: Array) -> tuple[Array, Array]:
        return np.full_like(walls, self.given), self.sizes(walls)

    def relative_bores(self, walls: Array) -> Array:
        return np.full_like(walls, self.given)

    def over_ring_stress(self, scene: Scene, allowable: float, walls: Array) -> tuple[NDArray[np.bool_], str]:
        m = scene.material
        outer = ovalization.outer_within_stress(
            allowable, scene.force, self.given, scene.geometry.length, m.elastic_modulus, m.poisson
        )
        return self.sizes(walls) < outer, f"the outer diameter is less than {outer * 1e3:.4g} mm"


def design_variable_of(scene: Scene) -> DesignVariable:
    """Return the scene's design variable: the diameter that its geometry does not give."""
    g = scene.geometry
    if isinstance(g, BushingGeometry):
        return OuterDiameterVariable(g.bore, g.bore)
    return BoreVariable(g.outer_diameter, g.outer_diameter)


@kernel
def _walls_of(u: Array, given: float, sign: float, scale: float) -> Array:
    """Return u/(G + sqrt(G^2 +- u)) times ``scale``, with G over the length unit; 0 where u is not positive."""
    out = np.empty_like(u)
    for i in range(u.size):
        out[i] = 0.0 if u[i] <= 0.0 else scale * u[i] / (given + math.sqrt(max(given * given + sign * u[i], 0.0)))
    return out
