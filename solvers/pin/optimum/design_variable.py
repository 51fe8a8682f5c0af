"""Design variable: bore of a pin or outer diameter of a bushing, with its walls, measure u of material and masses.

With the given diameter G, the thickness t = D - d, and kappa = -1 for a pin's bore, 1 for a bushing's outer diameter
around a bore and 0 for a shaft's, D^2 - d^2 = t (2 G -+ t) and

    u = (D^2 - d^2)/l^2,

l being a length unit (flexibilities as functions of u: ``solvers.pin.section.flexibility``).

A pin's l is its outer diameter: u = 1 - (d/D)^2 is the solid fraction of the section, walls are w = 1 - d/D. A
bushing's l is its bore (a shaft's: a length scale from the load), walls are t [m]; a feasible bushing exists for every
finite load and every deflection limit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.pin.ring import ovalization
from solvers.pin.scene import BushingGeometry, Limits, Scene
from solvers.pin.section.least_wall import least_bushing_wall, least_wall
from solvers.pin.section.strength import StrengthConstraint, utilisations


@dataclass(frozen=True)
class DesignVariable:
    """Diameter to be designed, for a fixed value ``given`` G [m] of the other diameter.

    ``sign``: -1 if G is the outer diameter, that of a pin, 1 if it is a bushing's bore. u, walls and sizes (the unknown
    diameter [m]) are arrays (n,). Walls are (D - d)/``unit_diameter``; ``unit`` is l [m].
    """

    sign: float
    given: float
    unit: float

    @property
    def unit_diameter(self) -> float:
        """Unit of walls and of strength constraints: D of a pin, 1 m for a bushing."""
        return self.given if self.sign < 0.0 else 1.0

    @property
    def kappa(self) -> float:
        """kappa of the flexibilities: -1 for a pin, 1 for a bushing, 0 for a shaft."""
        return self.sign if self.given > 0.0 else 0.0

    @property
    def thickest(self) -> float:
        """Wall of the solid section; infinite for a bushing."""
        return 1.0 if self.sign < 0.0 else math.inf

    def floor(self, scene: Scene, limits: Limits) -> float:
        """Return the minimum wall under the limits on wall, ovalization and hoop stress; not finite if infeasible.

        Raises InvalidInput for a minimum wall above a pin's radius. The ovalization of a bar depends on d/D alone.
        """
        floor, is_pin = 2.0 * limits.min_wall / self.unit_diameter, self.sign < 0.0
        if is_pin and floor > 1.0:
            raise InvalidInput("limits.min_wall", "is more than the pin's radius", "at most half the outer diameter")
        if scene.force == 0.0:
            return floor
        length, m = scene.geometry.length, scene.material
        if limits.max_ovalization is not None:
            ratio = ovalization.greatest_ratio(
                limits.max_ovalization, scene.force, 1.0, length, m.elastic_modulus, m.poisson
            )
            if ratio is None or (ratio == 0.0 < self.given and not is_pin):
                return math.inf
            floor = max(floor, 1.0 - ratio if is_pin else self.given * (1.0 - ratio) / ratio if ratio else 0.0)
        if limits.max_ring_stress is not None:
            size = self.size_for_ring_stress(scene, limits.max_ring_stress)
            if size is None:
                return math.inf
            floor = max(floor, abs(size - self.given) / self.unit_diameter)
        return floor

    def size_for_ring_stress(self, scene: Scene, allowable: float) -> float | None:
        """Return the greatest bore or the least outer diameter [m] up to or from which the hoop stress is allowable;
        None if even a solid pin exceeds it."""
        of_ring = allowable, scene.force, self.given, scene.geometry.length, scene.material.elastic_modulus
        if self.sign > 0.0:
            return ovalization.outer_within_stress(*of_ring, scene.material.poisson)
        ratio = ovalization.ratio_within_stress(*of_ring, scene.material.poisson)
        return None if ratio is None else ratio * self.given

    def over_ring_stress(self, scene: Scene, allowable: float, walls: Array) -> tuple[NDArray[np.bool_], str]:
        """Return a mask of the stations whose hoop stress exceeds the allowable, and a description of their sizes."""
        size = self.size_for_ring_stress(scene, allowable) or ovalization.MIN_HOOP_RATIO * self.given
        if self.sign < 0.0:
            return self.sizes(walls) > size, f"the bore is wider than {size * 1e3:.4g} mm"
        return self.sizes(walls) < size, f"the outer diameter is less than {size * 1e3:.4g} mm"

    def least_walls(self, constraints: tuple[StrengthConstraint, ...], floor: float, stations: int) -> Array:
        """Return the minimum walls that satisfy all constraints and the floor; NaN where even the solid section
        fails."""
        if self.sign < 0.0:
            return least_wall(constraints, floor, stations)
        return least_bushing_wall(constraints, self.given, floor, stations)

    def rescaled(self, largest: float, length: float) -> DesignVariable:
        """Return a copy whose length unit suits the largest wall, if the unit depends on it."""
        if self.given > 0.0:
            return self
        # An infinite wall: the limits are unattainable, which a check reports only.
        return replace(self, unit=largest if 0.0 < largest < math.inf else length)

    def diameters(self, walls: Array) -> tuple[Array, Array]:
        """Return bores and outer diameters [m] for given walls."""
        given, sizes = np.full_like(walls, self.given), self.sizes(walls)
        return (sizes, given) if self.sign < 0.0 else (given, sizes)

    def stiffness(self, scene: Scene) -> tuple[float, float]:
        """Return E I [N m^2] and G A [N] of f = g = 1, the divisors of M m and Q q that give B and S per length [1]."""
        m = scene.material
        return m.elastic_modulus * math.pi * self.unit**4 / 64.0, m.shear_modulus * math.pi * self.unit**2 / 4.0

    def utilisations(self, constraints: tuple[StrengthConstraint, ...], walls: Array) -> Array:
        """Return the strength utilisation of the criterion and of the shear allowable, (2, n)."""
        return utilisations(constraints, 1.0 - walls if self.sign < 0.0 else np.full_like(walls, self.given), walls)

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


def design_variable_of(scene: Scene) -> DesignVariable:
    """Return the scene's design variable: the diameter that its geometry does not give."""
    g = scene.geometry
    if isinstance(g, BushingGeometry):
        return DesignVariable(1.0, g.bore, g.bore)
    return DesignVariable(-1.0, g.outer_diameter, g.outer_diameter)


@kernel
def _walls_of(u: Array, given: float, sign: float, scale: float) -> Array:
    """Return u/(G + sqrt(G^2 +- u)) times ``scale``, with G over the length unit; 0 where u is not positive."""
    out = np.empty_like(u)
    for i in range(u.size):
        out[i] = 0.0 if u[i] <= 0.0 else scale * u[i] / (given + math.sqrt(max(given * given + sign * u[i], 0.0)))
    return out
