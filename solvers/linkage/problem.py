"""Design problem of the impact linkage: objective, and the resulting size of each member within the limits.

If the rocker strikes at its own joint, speed and frequency fix the scale V (see ``optimum.family``): V = v/omega. With
a tool at a given radius r they fix the free ratio instead, by v = omega r |u31(2 pi)|, and V is free within the limits.
If the speed or the frequency is the objective, both are free.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solvers.effects import Demand
from solvers.errors import InvalidInput, require
from solvers.linkage.limits import Limits, demands_of
from solvers.linkage.mechanism.change_point import KINDS, ChangePoint
from solvers.linkage.result import LinkageCheck
from solvers.linkage.scene import Scene
from solvers.numerics.arrays import Array


@dataclass(frozen=True)
class Objective:
    """The objective, as a positive cost to be minimised.

    cost                cost of members, or its lower bound over ranges of members (``optimum.quantities``)
    read                the objective [SI] of a checked linkage in its scene
    sign                -1 for maximisation: the cost is then the reciprocal
    effect              the effect required for its value
    set_motion          returns the scene with the optimised speed or frequency, from the stroke v/omega [m]; None if
                        both are given
    improves_with_scale whether it improves as V increases
    """

    name: str
    cost: Callable[[Any], Array]
    read: Callable[[LinkageCheck, Scene], float]
    sign: int = 1
    effect: str | None = None
    set_motion: Callable[[Scene, float], Scene] | None = None
    improves_with_scale: bool = False

    def value(self, cost: float) -> float:
        """The objective [SI] from a cost, and vice versa."""
        return cost if self.sign > 0 else 1.0 / cost


BOX_AREA = Objective("box_area", lambda q: q.area(q.sizes), lambda check, scene: check.box.area, effect="envelope")
LONGEST_LINK = Objective("longest_link", lambda q: q.longest(q.sizes), lambda check, scene: max(check.mechanism.links))
ENCLOSING_RADIUS = Objective(
    "enclosing_radius",
    lambda q: q.radius(q.sizes) + q.problem.limits.joint_radius,
    lambda check, scene: check.enclosing_radius,
    effect="envelope",
)
PEAK_TORQUE = Objective(
    "peak_torque",
    lambda q: q.problem.scene.impact_energy * q.torque,
    lambda check, scene: check.strike.peaks.torque,
)
PIN_FORCE = Objective(
    "pin_force",
    lambda q: q.problem.scene.impact_energy * q.force / q.greatest,
    lambda check, scene: check.strike.peaks.force,
    improves_with_scale=True,
)
IMPACT_SPEED = Objective(
    "impact_speed",
    lambda q: 1.0 / (q.problem.scene.crank_speed * q.problem.stroke(q.greatest, q.u31_end[1])),
    lambda check, scene: scene.impact_speed,
    sign=-1,
    set_motion=lambda scene, stroke: replace(scene, impact_speed=scene.crank_speed * stroke),
    improves_with_scale=True,
)
BLOW_FREQUENCY = Objective(
    "blow_frequency",
    lambda q: 2.0 * math.pi * q.problem.stroke(np.minimum(*q.sizes), q.u31_end[0]) / q.problem.scene.impact_speed,
    lambda check, scene: scene.blow_frequency,
    sign=-1,
    set_motion=lambda scene, stroke: replace(scene, blow_frequency=scene.impact_speed / (2.0 * math.pi * stroke)),
)
OBJECTIVES: dict[str, Objective] = {
    objective.name: objective
    for objective in (BOX_AREA, LONGEST_LINK, ENCLOSING_RADIUS, PEAK_TORQUE, PIN_FORCE, IMPACT_SPEED, BLOW_FREQUENCY)
}
"""The objectives by name."""


@dataclass(frozen=True)
class LinkageProblem:
    """A scene, its limits, the objective, and the allowed kinds."""

    scene: Scene
    limits: Limits
    objective: Objective
    kinds: tuple[ChangePoint, ...] = tuple(KINDS.values())

    def __post_init__(self) -> None:
        require(bool(self.kinds), "types", "allows no type at all", "at least one of " + ", ".join(KINDS))
        limits, grows = self.limits, self.objective.improves_with_scale
        if self.fixed_scale is not None:
            return
        if grows and not limits.sized:
            reason = f"the larger the mechanism the better its {self.objective.name}"
            raise InvalidInput("limits", reason, "a limit on its size")
        if not grows and limits.min_link == 0 and limits.max_pin_force is None:
            reason = "nothing keeps the mechanism from vanishing"
            raise InvalidInput("limits.min_link", reason, "a least link length above 0")

    @property
    def fixed_scale(self) -> float | None:
        """V [m] if fixed by speed and frequency."""
        if self.objective.set_motion is not None or self.scene.tool_radius is not None:
            return None
        return self.scene.impact_speed / self.scene.crank_speed

    @property
    def fixed_u31_end(self) -> float | None:
        """|u31(2 pi)| if fixed by speed, frequency and tool radius."""
        if self.objective.set_motion is not None or self.scene.tool_radius is None:
            return None
        return self.scene.impact_speed / (self.scene.crank_speed * self.scene.tool_radius)

    @property
    def room(self) -> tuple[float, float] | None:
        """Width and height less the pads on both sides, if either is limited."""
        (width, height), pads = self.limits.sides, 2.0 * self.limits.joint_radius
        return None if math.isinf(min(width, height)) else (width - pads, height - pads)

    def settled(self, scale: float, end: float) -> Scene:
        """The scene with the speed or the frequency of a member with this scale V and |u31(2 pi)|."""
        set_motion = self.objective.set_motion
        return self.scene if set_motion is None else set_motion(self.scene, self.stroke(scale, end))

    def stroke(self, scale: Array | float, end: Array | float) -> Array | float:
        """Impact speed over the crank's angular speed [m]: V, or |u31(2 pi)| times the tool radius."""
        radius = self.scene.tool_radius
        return scale if radius is None else radius * end

    def demands(self) -> tuple[Demand, ...]:
        """The effects required by limits and objective."""
        effect = self.objective.effect
        own = () if effect is None else (Demand(effect, f"objective {self.objective.name}"),)
        return (*own, *demands_of(self.limits))
