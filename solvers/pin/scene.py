"""Inputs: geometry of the pin or the bushing, loads, material. SI units throughout.

Every dataclass raises ``InvalidInput`` for values outside the model's domain.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from solvers.errors import require, require_not_negative, require_positive
from solvers.pin.load.macaulay import LoadCase
from solvers.pin.load.piston_pin import DeflectionReference, pin_places, piston_pin_case


class _Lengths:
    """Axial dimensions common to pin and bushing."""

    boss_length: float
    small_end_length: float
    gap: float

    @cached_property
    def length(self) -> float:
        """Total length [m]."""
        return self.places[-1][0]

    @cached_property
    def places(self) -> tuple[tuple[float, float], ...]:
        """Axial positions; see ``piston_pin.pin_places``."""
        return pin_places(self.boss_length, self.small_end_length, self.gap)

    def _require_lengths(self) -> None:
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
        self._require_lengths()

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
        self._require_lengths()
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
        require_positive(self, "material", "allowable_stress", "elastic_modulus", "density")
        require(0 <= self.poisson < 0.5, "material.poisson", "lies outside what a solid can have", "[0, 0.5)")
        if self.allowable_shear is not None:
            require_positive(self, "material", "allowable_shear")

    @property
    def shear_modulus(self) -> float:
        return self.elastic_modulus / (2.0 * (1.0 + self.poisson))


@dataclass(frozen=True)
class Scene:
    """A loaded pin with given outer diameter, or a loaded bushing with given bore.

    ``force`` [N] is the piston's maximum force: the rod force in the middle, half of it on each boss.
    ``further_cases`` are additional load cases on the same part (see ``solvers.pin.load.macaulay``). ``mirrored``:
    the sought diameter may be assumed symmetric about the middle.
    """

    geometry: Geometry | BushingGeometry
    force: float
    material: PinMaterial
    further_cases: tuple[LoadCase, ...] = ()
    mirrored: bool = True

    def __post_init__(self) -> None:
        require_not_negative(self, "load", "force")

    @cached_property
    def cases(self) -> tuple[LoadCase, ...]:
        g = self.geometry
        own = piston_pin_case(self.force, g.boss_length, g.small_end_length, g.gap)
        return (own, *self.further_cases)

    @property
    def symmetric(self) -> bool:
        """Whether one half represents both: true for the pin's own load, not assumed for further cases."""
        return self.mirrored and not self.further_cases

    @property
    def reference(self) -> DeflectionReference:
        """The middle relative to the inner edges of the bosses."""
        g = self.geometry
        right, residual = g.places[4]
        return DeflectionReference(g.boss_length, right, residual)
