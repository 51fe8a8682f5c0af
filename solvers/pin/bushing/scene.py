"""The inputs of a bushing: a bore d, the pin's loads and material; the outer diameter is what is sought. SI units."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from solvers.errors import InvalidInput
from solvers.pin.load.macaulay import LoadCase
from solvers.pin.load.piston_pin import DeflectionReference, pin_places, piston_pin_case
from solvers.pin.scene import PinMaterial, require_positive


@dataclass(frozen=True)
class BushingGeometry:
    """Bore d (0: a shaft), boss length a, small-end length b, gap delta between them; length L = 2a + b + 2 delta."""

    bore: float
    boss_length: float
    small_end_length: float
    gap: float = 0.0

    def __post_init__(self) -> None:
        require_positive(self, "geometry", "boss_length", "small_end_length")
        if not (math.isfinite(self.gap) and self.gap >= 0):
            raise InvalidInput("geometry.gap", "must not be negative", "[0, inf)")
        if not (math.isfinite(self.bore) and self.bore >= 0):
            raise InvalidInput("bore", "must not be negative", "[0, inf)")

    @property
    def length(self) -> float:
        return self.places[-1][0]

    @property
    def places(self) -> tuple[tuple[float, float], ...]:
        """See ``piston_pin.pin_places``."""
        return pin_places(self.boss_length, self.small_end_length, self.gap)


@dataclass(frozen=True)
class BushingScene:
    """A bushing under its load: as ``solvers.pin.Scene``, with the bore in the place of the outer diameter."""

    geometry: BushingGeometry
    force: float
    material: PinMaterial
    further_cases: tuple[LoadCase, ...] = ()
    mirrored: bool = True

    def __post_init__(self) -> None:
        if not (math.isfinite(self.force) and self.force >= 0):
            raise InvalidInput("load.force", "must not be negative", "[0, inf)")

    @cached_property
    def cases(self) -> tuple[LoadCase, ...]:
        g = self.geometry
        return (piston_pin_case(self.force, g.boss_length, g.small_end_length, g.gap), *self.further_cases)

    @property
    def symmetric(self) -> bool:
        return self.mirrored and not self.further_cases

    @property
    def reference(self) -> DeflectionReference:
        g = self.geometry
        right, rest = g.places[4]
        return DeflectionReference(g.boss_length, right, rest)
