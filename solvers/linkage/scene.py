"""Inputs of the impact linkage: the blow, the drive, part properties and tolerances. SI units throughout.

Every dataclass rejects values outside the model with ``InvalidInput``; all others can be computed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from solvers.errors import InvalidInput, require, require_positive
from solvers.linkage.mechanism.change_point import Gain
from solvers.linkage.mechanism.lengths import Mechanism

LEAST_RESTITUTION, GREATEST_RESTITUTION = 1e-6, 0.95
"""At restitution 0 the mechanism is a kite that never strikes again; near 1 the links grow without bound."""

STRENGTH_SPEED = 10.0
"""Impact speed [m/s] above which the striking parts fail prematurely, according to the paper."""

TRANSMISSION = (math.radians(40.0), math.radians(140.0))
"""Usual limits of the mid-cycle transmission angle; at the change point itself it is 0 in every cycle."""


@dataclass(frozen=True)
class Restitution:
    """Range of the physical coefficient of restitution of the struck body; low = high if it is known."""

    low: float
    high: float

    def __post_init__(self) -> None:
        for name in ("low", "high"):
            if not LEAST_RESTITUTION <= getattr(self, name) <= GREATEST_RESTITUTION:
                inside = f"[{LEAST_RESTITUTION:g}, {GREATEST_RESTITUTION:g}]"
                raise InvalidInput(f"restitution.{name}", "lies outside what the mechanism can be made for", inside)
        require(self.low <= self.high, "restitution.low", "exceeds restitution.high", "at most restitution.high")

    @property
    def middle(self) -> float:
        """The design value R_k, which minimises the worst mismatch."""
        return 0.5 * (self.low + self.high)

    @property
    def gain(self) -> Gain:
        return Gain(self.middle)


@dataclass(frozen=True)
class Drive:
    """A motor with a linear torque-speed line at the crank: stall torque [N m] and no-load speed [rad/s]; the combined
    inertia of crank and flywheel [kg m^2]."""

    stall_torque: float
    free_speed: float
    crank_inertia: float

    def __post_init__(self) -> None:
        require_positive(self, "drive", "stall_torque", "free_speed", "crank_inertia")

    @property
    def slope(self) -> float:
        """Slope of the torque-speed line [N m s], as a positive number."""
        return self.stall_torque / self.free_speed


_GIVEN = ("blow_frequency", "impact_speed", "impact_energy")


@dataclass(frozen=True)
class Scene:
    """The blow: restitution, blows per second, impact speed [m/s] and energy [J], tool radius [m].

    ``tool_radius`` None: the rocker itself strikes at its joint. ``drive``, ``coupler_stiffness`` [N/m] and
    ``length_tolerance`` [m] are required by the corresponding effects only.
    """

    restitution: Restitution
    blow_frequency: float
    impact_speed: float
    impact_energy: float
    tool_radius: float | None = None
    drive: Drive | None = None
    coupler_stiffness: float | None = None
    length_tolerance: float | None = None

    def __post_init__(self) -> None:
        require_positive(self, "", *_GIVEN, "tool_radius", "coupler_stiffness", "length_tolerance")
        for name in _GIVEN:
            require(getattr(self, name) is not None, name, "is missing", "(0, inf)")

    @property
    def crank_speed(self) -> float:
        """omega [rad/s]: one blow per revolution."""
        return 2.0 * math.pi * self.blow_frequency

    def striking_radius(self, mechanism: Mechanism) -> float:
        """Radius [m] about the rocker's pivot at which the tool strikes."""
        rocker = mechanism.crank * float(mechanism.bar.ratios.rocker)
        return rocker if self.tool_radius is None else self.tool_radius

    def tool_speed(self, mechanism: Mechanism) -> float:
        """Speed [m/s] of the tool before the blow; 0 for a mechanism that cannot strike."""
        if not mechanism.can_strike:
            return 0.0
        return self.crank_speed * self.striking_radius(mechanism) * mechanism.bar.u31_end
