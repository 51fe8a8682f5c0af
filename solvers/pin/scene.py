"""Inputs: geometry of the pin or the bushing, loads, material, design limits. SI units throughout.

Every dataclass raises ``InvalidInput`` for values outside the model's domain.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from solvers.errors import require, require_not_negative, require_positive
from solvers.numerics.arrays import Array
from solvers.pin.load.macaulay import InternalForces, LoadCase, forces_of
from solvers.pin.load.piston_pin import own_forces


class _Lengths:
    """Axial dimensions common to pin and bushing."""

    boss_length: float
    small_end_length: float
    gap: float

    @property
    def length(self) -> float:
        """Total length [m]."""
        return 2.0 * (self.boss_length + self.gap) + self.small_end_length

    def __post_init__(self) -> None:
        require_positive(self, "geometry", "boss_length", "small_end_length")
        require_not_negative(self, "geometry", "gap")


@dataclass(frozen=True)
class Geometry(_Lengths):
    """Outer diameter D, boss length a, small-end length b, gap delta between them [m]; total length L = 2a + b + 2
    delta."""

    outer_diameter: float
    boss_length: float
    small_end_length: float
    gap: float = 0.0

    def __post_init__(self) -> None:
        require_positive(self, "geometry", "outer_diameter")
        super().__post_init__()

    def require_size(self, k: int, bore: float) -> None:
        """Raise InvalidInput if the k-th bore of a profile exceeds the outer diameter."""
        require(
            bore <= self.outer_diameter * (1.0 + 1e-12), f"profile.{k}.bore", "is wider than the pin",
            "at most the outer diameter",
        )  # fmt: skip

    @property
    def area(self) -> float:
        """Area of the solid section, A0 = pi D^2/4."""
        return math.pi * self.outer_diameter**2 / 4.0

    @property
    def inertia(self) -> float:
        """Second moment of area of the solid section, I0 = pi D^4/64."""
        return math.pi * self.outer_diameter**4 / 64.0


@dataclass(frozen=True)
class BushingGeometry(_Lengths):
    """Geometry of a bushing: bore d (0: a shaft), boss length a, small-end length b, gap delta [m].

    The outer diameter is sought.
    """

    bore: float
    boss_length: float
    small_end_length: float
    gap: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require_not_negative(self, "", "bore")

    def require_size(self, k: int, outer: float) -> None:
        """Raise InvalidInput if the k-th outer diameter of a profile is below the bore."""
        require(
            outer >= self.bore * (1.0 - 1e-12), f"profile.{k}.outer_diameter", "is narrower than the bore",
            "at least the bore",
        )  # fmt: skip


@dataclass(frozen=True)
class PinMaterial:
    """Allowable normal stress, optional separate allowable shear stress, E [Pa], nu, density [kg/m^3]."""

    allowable_stress: float
    elastic_modulus: float
    poisson: float
    density: float
    allowable_shear: float | None = None

    def __post_init__(self) -> None:
        require_positive(self, "material", "allowable_stress", "elastic_modulus", "density", "allowable_shear")
        require(0 <= self.poisson < 0.5, "material.poisson", "lies outside what a solid can have", "[0, 0.5)")

    @property
    def shear_modulus(self) -> float:
        return self.elastic_modulus / (2.0 * (1.0 + self.poisson))


@dataclass(frozen=True)
class Limits:
    """Design limits besides strength; None: no limit.

    min_wall         minimum wall thickness [m]
    max_deflection   maximum deflection of the middle relative to the bosses' inner edges [m]
    max_ovalization  maximum growth of a diameter [m]
    max_slope        maximum slope of the bore's diameter, |dd/dx|
    max_ring_stress  maximum hoop stress of the section as a ring [Pa]
    """

    min_wall: float = 0.0
    max_deflection: float | None = None
    max_ovalization: float | None = None
    max_slope: float | None = None
    max_ring_stress: float | None = None

    def __post_init__(self) -> None:
        require_not_negative(self, "limits", "min_wall")
        require_positive(self, "limits", "max_deflection", "max_ovalization", "max_slope", "max_ring_stress")


NO_LIMITS = Limits()


@dataclass(frozen=True)
class Scene:
    """A loaded pin with given outer diameter, or a loaded bushing with given bore.

    ``force`` [N] is the piston's maximum force: the rod force in the middle, half of it on each boss.
    ``further_cases`` are additional load cases on the same part (see ``solvers.pin.load.macaulay``). ``symmetric``: the
    sought diameter is symmetric about the middle, as all designs are. Such a part may be fitted either way round, so
    further cases count together with their mirror images; one half represents both.
    """

    geometry: Geometry | BushingGeometry
    force: float
    material: PinMaterial
    further_cases: tuple[LoadCase, ...] = ()
    symmetric: bool = True

    def __post_init__(self) -> None:
        require_not_negative(self, "load", "force")

    @property
    def breakpoints(self) -> set[float]:
        """Positions inside the part where a load begins or ends, [m]."""
        length, a, rod = self.geometry.length, self.geometry.boss_length, self.geometry.boss_length + self.geometry.gap
        starts = {term.start for case in self.further_cases for term in case.terms if 0.0 < term.start < length}
        return {a, rod, length - rod, length - a} | starts

    def own_forces(self, x: Array, side: Array) -> Array:
        """Return the resultants of the part's own load at stations; see ``solvers.pin.load.piston_pin``."""
        g = self.geometry
        return own_forces(x, side, g.boss_length, g.small_end_length, g.gap, self.force)

    def further_forces(self, x: Array, side: Array) -> list[InternalForces]:
        """Return the resultants of the further cases at stations; of a symmetric part also of their mirror images."""
        found, length = [forces_of(case, x, side) for case in self.further_cases], self.geometry.length
        if self.symmetric:
            found += [forces_of(case, length - x, length - side) for case in self.further_cases]
        return found
