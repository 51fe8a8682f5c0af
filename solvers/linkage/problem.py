"""A design problem of the impact linkage: what is required, what is wanted, and the size each member then takes.

The scale V (see ``family``) is fixed by speed and frequency where the rocker strikes at its own joint: V = v/omega.
With a tool at a given radius r the free ratio is fixed instead, by v = omega r |u31(2 pi)|, and V is free within the
limits. Where the speed or the frequency is what is sought, both are free.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.effects import Demand
from solvers.errors import InvalidInput, require
from solvers.linkage.kinds import KINDS, ChangePoint
from solvers.linkage.scene import Limits, Scene

Array = NDArray[np.float64]


class Figures(Protocol):
    """What members (one a row) are, or bounds of what ranges of members can be, at least as good as any in the range.

    ``scale`` is the least and greatest V allowed; ``crank``, ``end_high`` are upper bounds, the others lower ones:
    per V the crank, the longest link, the enclosing radius; per energy torque and force times crank; |u31(2 pi)|;
    the least orientation's max(W/width, H/height) per V; and nu(pi) from the wanted range.
    """

    question: Question

    @property
    def scale(self) -> tuple[Array, Array]: ...
    @property
    def crank(self) -> Array: ...
    @property
    def longest(self) -> Array: ...
    @property
    def radius(self) -> Array: ...
    @property
    def fit(self) -> Array: ...
    @property
    def torque(self) -> Array: ...
    @property
    def force(self) -> Array: ...
    @property
    def end_low(self) -> Array: ...
    @property
    def end_high(self) -> Array: ...
    def area(self, scale: Array) -> Array: ...


class Objective(Protocol):
    """What is wanted, as a positive cost to be made small; ``grows`` says that a larger V lowers it, ``slows`` that
    with a tool at its own radius a smaller |u31(2 pi)| does."""

    name: str
    sign: int
    effect: str | None
    settles_motion: bool
    grows: bool
    slows: bool

    def cost(self, figures: Figures) -> Array: ...


@dataclass(frozen=True)
class BoxArea:
    name: str = "box_area"
    sign: int = 1
    effect: str | None = "envelope"
    settles_motion: bool = False
    grows: bool = False
    slows: bool = False

    def cost(self, figures: Figures) -> Array:
        return figures.area(figures.scale[0])


@dataclass(frozen=True)
class LongestLink:
    name: str = "longest_link"
    sign: int = 1
    effect: str | None = None
    settles_motion: bool = False
    grows: bool = False
    slows: bool = False

    def cost(self, figures: Figures) -> Array:
        return figures.scale[0] * figures.longest


@dataclass(frozen=True)
class EnclosingRadius:
    name: str = "enclosing_radius"
    sign: int = 1
    effect: str | None = "envelope"
    settles_motion: bool = False
    grows: bool = False
    slows: bool = False

    def cost(self, figures: Figures) -> Array:
        return figures.scale[0] * figures.radius + figures.question.limits.joint_radius


@dataclass(frozen=True)
class PeakTorque:
    name: str = "peak_torque"
    sign: int = 1
    effect: str | None = None
    settles_motion: bool = False
    grows: bool = False
    slows: bool = False

    def cost(self, figures: Figures) -> Array:
        return figures.question.scene.impact_energy * figures.torque


@dataclass(frozen=True)
class PinForce:
    name: str = "pin_force"
    sign: int = 1
    effect: str | None = None
    settles_motion: bool = False
    grows: bool = True
    slows: bool = False

    def cost(self, figures: Figures) -> Array:
        return figures.question.scene.impact_energy * figures.force / (figures.crank * figures.scale[1])


@dataclass(frozen=True)
class ImpactSpeed:
    name: str = "impact_speed"
    sign: int = -1
    effect: str | None = None
    settles_motion: bool = True
    grows: bool = True
    slows: bool = False

    def cost(self, figures: Figures) -> Array:
        radius = figures.question.scene.tool_radius
        stroke = figures.scale[1] if radius is None else radius * figures.end_high
        return 1.0 / (figures.question.scene.crank_speed * stroke)


@dataclass(frozen=True)
class BlowFrequency:
    name: str = "blow_frequency"
    sign: int = -1
    effect: str | None = None
    settles_motion: bool = True
    grows: bool = False
    slows: bool = True

    def cost(self, figures: Figures) -> Array:
        radius = figures.question.scene.tool_radius
        stroke = figures.scale[0] if radius is None else radius * figures.end_low
        return 2.0 * math.pi * stroke / figures.question.scene.impact_speed


OBJECTIVES: dict[str, Objective] = {
    objective.name: objective
    for objective in (
        BoxArea(), LongestLink(), EnclosingRadius(), PeakTorque(), PinForce(), ImpactSpeed(), BlowFrequency(),
    )
}  # fmt: skip
"""The objectives by name."""


@dataclass(frozen=True)
class Question:
    """Scene, limits and objective: all that a search over one family needs to know."""

    scene: Scene
    limits: Limits
    objective: Objective
    boxed: bool = True
    """Whether width and height limit what is allowed, or are only what the fit is measured by."""

    @property
    def fixed_scale(self) -> float | None:
        """V [m] where speed and frequency fix it."""
        if self.objective.settles_motion or self.scene.tool_radius is not None:
            return None
        return self.scene.impact_speed / self.scene.crank_speed

    @property
    def fixed_end(self) -> float | None:
        """|u31(2 pi)| where speed, frequency and tool radius fix it."""
        if self.objective.settles_motion or self.scene.tool_radius is None:
            return None
        return self.scene.impact_speed / (self.scene.crank_speed * self.scene.tool_radius)

    @property
    def room(self) -> tuple[float, float] | None:
        """Width and height left beside the pads, where one of them is limited."""
        width, height, pads = self.limits.width, self.limits.height, 2.0 * self.limits.joint_radius
        if width is None and height is None:
            return None
        return (math.inf if width is None else width - pads), (math.inf if height is None else height - pads)

    def settled(self, scale: float, end: float) -> Scene:
        """The scene with the speed or the frequency that a member of scale V has."""
        scene = self.scene
        stroke = scale if scene.tool_radius is None else scene.tool_radius * end
        if self.objective.name == "impact_speed":
            return replace(scene, impact_speed=scene.crank_speed * stroke)
        if self.objective.name == "blow_frequency":
            return replace(scene, blow_frequency=scene.impact_speed / (2.0 * math.pi * stroke))
        return scene


@dataclass(frozen=True)
class LinkageProblem:
    """A scene, its limits, the kinds allowed, and what is wanted."""

    scene: Scene
    limits: Limits
    objective: Objective
    kinds: tuple[ChangePoint, ...] = tuple(KINDS.values())

    def __post_init__(self) -> None:
        require(bool(self.kinds), "types", "allows no type at all", "at least one of " + ", ".join(KINDS))
        sized = any(
            value is not None
            for value in (self.limits.longest_link, self.limits.enclosing_radius, self.limits.width, self.limits.height)
        )
        free = self.question.fixed_scale is None
        if free and self.objective.grows and not sized:
            raise InvalidInput(
                "limits", f"the larger the mechanism the better its {self.objective.name}", "a limit on its size"
            )
        if free and not self.objective.grows and self.limits.min_link == 0 and self.limits.max_pin_force is None:
            raise InvalidInput(
                "limits.min_link", "nothing keeps the mechanism from vanishing", "a least link length above 0"
            )

    @property
    def question(self) -> Question:
        return Question(self.scene, self.limits, self.objective)

    def demands(self) -> tuple[Demand, ...]:
        """The effects without which limits and objective mean nothing."""
        out = (
            [] if self.objective.effect is None else [Demand(self.objective.effect, f"objective {self.objective.name}")]
        )
        return (*out, *demands_of(self.limits))


def demands_of(limits: Limits) -> tuple[Demand, ...]:
    """The effects that these limits cannot do without."""
    names = ("width", "height", "enclosing_radius")
    return tuple(Demand("envelope", f"limits.{name}") for name in names if getattr(limits, name) is not None)
