"""Limits of a linkage: sizes, pin force and transmission angle."""

from __future__ import annotations

import math
from dataclasses import dataclass

from solvers.effects import Demand
from solvers.errors import InvalidInput, require, require_not_negative, require_positive
from solvers.linkage.scene import TRANSMISSION


@dataclass(frozen=True)
class Limits:
    """Size limits [m], maximum pin force [N], and range [rad] of the mid-cycle transmission angle."""

    min_link: float = 0.0
    joint_radius: float = 0.0
    longest_link: float | None = None
    width: float | None = None
    height: float | None = None
    enclosing_radius: float | None = None
    max_pin_force: float | None = None
    transmission_angle: tuple[float, float] | None = TRANSMISSION

    @property
    def sides(self) -> tuple[float, float]:
        """Width and height, inf if not limited."""
        return math.inf if self.width is None else self.width, math.inf if self.height is None else self.height

    @property
    def sized(self) -> bool:
        """Whether a limit bounds the mechanism's size from above."""
        return any(v is not None for v in (self.longest_link, self.enclosing_radius, self.width, self.height))

    def __post_init__(self) -> None:
        require_positive(self, "limits", "longest_link", "width", "height", "enclosing_radius", "max_pin_force")
        require_not_negative(self, "limits", "min_link", "joint_radius")
        for name, pads in (("width", 2.0), ("height", 2.0), ("enclosing_radius", 1.0)):
            value = getattr(self, name)
            if value is not None and value <= pads * self.joint_radius:
                reason = "leaves no room beside the joints themselves"
                raise InvalidInput(f"limits.{name}", reason, "more than the joints need")
        if self.transmission_angle is not None:
            low, high = self.transmission_angle
            ok = 0 <= low <= high <= math.pi
            require(ok, "limits.transmission_angle", "is not a range of angles", "0 <= low <= high <= 180 degrees")


def demands_of(limits: Limits) -> tuple[Demand, ...]:
    """The effects required by these limits."""
    names = ("width", "height", "enclosing_radius")
    return tuple(Demand("envelope", f"limits.{name}") for name in names if getattr(limits, name) is not None)
