"""Which diameter is sought, with all that depends on it: walls, the measure u of material, flexibilities, masses.

With the given diameter G, the thickness t = D - d, and kappa = -1 for a pin's bore, 1 for a bushing's outer diameter
around a bore and 0 for a shaft's, D^2 - d^2 = t (2 G -+ t) and

    u = (D^2 - d^2)/l^2,

l being a length unit. Bending and shear flexibility are f(u) over 64/(E pi l^4) and g(u) over 4/(G pi l^2)
(``solvers.pin.section.flexibility``).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.limits import Limits
from solvers.pin.scene import Scene
from solvers.pin.section.strength import StrengthConstraint, uses

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Sought(ABC):
    """The diameter sought beside the ``given`` one G [m]; u, walls and sizes (the sought diameter [m]) are arrays (n,).

    Walls are D - d over ``unit_diameter`` [m], that of the strength constraints; ``unit`` l [m].
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
        """Bores and outer diameters [m] of walls."""

    @abstractmethod
    def over_ring_stress(self, scene: Scene, allowable: float, walls: Array) -> tuple[NDArray[np.bool_], str]:
        """Return the stations whose hoop stress exceeds the allowable, and a description of the sizes concerned."""

    def fitted(self, walls: Array, length: float) -> Sought:
        """Return a copy with its length unit set, if that depends on the walls."""
        return self

    def walls(self, constraints: tuple[StrengthConstraint, ...], floor: float, u: Array) -> Array:
        """Walls of u at the constraints' stations, to the precision of the constraints."""
        return self.wall_of(u)

    @property
    def _sign(self) -> float:
        """-1 if the given diameter is the outer one, 1 if it is the bore."""
        return -1.0 if self.kappa < 0.0 else 1.0

    def stiffness(self, scene: Scene) -> tuple[float, float]:
        """Return E I [N m^2] and G A [N] of f = g = 1, the divisors of M m and Q q that give B and S per length [1]."""
        m = scene.material
        return m.elastic_modulus * math.pi * self.unit**4 / 64.0, m.shear_modulus * math.pi * self.unit**2 / 4.0

    def uses(self, constraints: tuple[StrengthConstraint, ...], walls: Array) -> Array:
        """Return the strength utilisation of the criterion and of the shear allowable, (2, n)."""
        return uses(constraints, self.diameters(walls)[0] / self.unit_diameter, walls)

    def solidity_of(self, walls: Array) -> Array:
        """u of walls, t (2 G -+ t)/l^2."""
        scale = self.unit_diameter / self.unit
        return (scale * walls) * (2.0 * self.given / self.unit + (self._sign * scale) * walls)

    def wall_of(self, u: Array) -> Array:
        """Walls of u without cancellation: t = z/(G + sqrt(G^2 +- z)), z = u l^2; 0 where u is not positive."""
        out = np.empty_like(u)
        _walls_of(u, self.given / self.unit, self._sign, self.unit / self.unit_diameter, out)
        return out

    def sizes(self, walls: Array) -> Array:
        """Sought diameter [m] of walls."""
        return self.given + (self._sign * self.unit_diameter) * walls

    def thickness(self, sizes: Array) -> Array:
        """D - d [m] at sizes."""
        return np.maximum(self._sign * (sizes - self.given), 0.0)

    def mass_unit(self, scene: Scene) -> float:
        """Mass [kg] of a part with u = 1 throughout."""
        return scene.material.density * math.pi / 4.0 * self.unit**2 * scene.geometry.length

    def mass_of(self, scene: Scene, x: Array, sizes: Array) -> float:
        """Mass [kg] of sizes that are linear between positions x [m].

        Over a segment t (2 G -+ t) with t linear has the mean G (t0 + t1) -+ (t0^2 + t0 t1 + t1^2)/3: in terms of t
        it keeps the digits of a thin tube.
        """
        t = self.thickness(sizes)
        a, b = t[:-1], t[1:]
        mean = self.given * (a + b) + self._sign * (a * a + a * b + b * b) / 3.0
        return scene.material.density * math.pi / 4.0 * float(np.diff(x) @ mean)

    def growth(self, thickest: float) -> float:
        """Maximum derivative of u with respect to t [1/m], up to the thickest t [m]."""
        return 2.0 * (self.given + max(self._sign, 0.0) * thickest) / self.unit**2


@kernel
def _walls_of(u: Array, given: float, sign: float, scale: float, out: Array) -> None:
    """Write u/(G + sqrt(G^2 +- u)) times ``scale``, with G over the length unit; 0 where u is not positive."""
    for i in range(u.size):
        out[i] = 0.0 if u[i] <= 0.0 else scale * u[i] / (given + math.sqrt(max(given * given + sign * u[i], 0.0)))
