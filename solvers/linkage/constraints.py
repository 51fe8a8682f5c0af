"""Table of the design limits: name, limited value and required scene data of each."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from solvers.linkage.limits import Limits
from solvers.linkage.result import LinkageCheck
from solvers.verdict import Sense


@dataclass(frozen=True)
class Constraint:
    """A limit [SI], None if not set, and the limited value, None if a check lacks it.

    ``needs`` names the scene data that must be actual values, not placeholders (``verdict.Given``); ``active_name`` is
    the name under which a design reports the limit as active. If not ``asked``, it is judged only if a value exists.
    """

    name: str
    sense: Sense
    limit: Callable[[Limits], float | None]
    reached: Callable[[LinkageCheck], float | None]
    needs: tuple[str, ...] = ("size",)
    active_name: str | None = None
    asked: bool = True


def _angle(check: LinkageCheck) -> float | None:
    """Mid-cycle transmission angle; it exists only if the crank rotates fully."""
    turning = check.strike is not None and check.mechanism.rotatable
    return float(check.mechanism.bar.middle_transmission_angle) if turning else None


def _force(check: LinkageCheck) -> float | None:
    return check.strike.peaks.force if check.strike is not None and check.strike.peaks is not None else None


def _coupler_peak(check: LinkageCheck) -> float | None:
    return check.coupler_peak if _force(check) is not None else None


def _least_angle(limits: Limits) -> float | None:
    return limits.transmission_angle[0] or None if limits.transmission_angle is not None else None


def _greatest_angle(limits: Limits) -> float | None:
    angles = limits.transmission_angle
    return angles[1] if angles is not None and angles[1] < math.pi else None


_LOADED = ("size", "energy")
CONSTRAINTS: tuple[Constraint, ...] = (
    Constraint("min_link", Sense.AT_LEAST, lambda x: x.min_link or None, lambda c: min(c.mechanism.links)),
    Constraint("longest_link", Sense.AT_MOST, lambda x: x.longest_link, lambda c: max(c.mechanism.links)),
    Constraint("width", Sense.AT_MOST, lambda x: x.width, lambda c: c.box and c.box.width),
    Constraint("height", Sense.AT_MOST, lambda x: x.height, lambda c: c.box and c.box.height),
    Constraint("enclosing_radius", Sense.AT_MOST, lambda x: x.enclosing_radius, lambda c: c.enclosing_radius),
    Constraint("least_transmission_angle", Sense.AT_LEAST, _least_angle, _angle, (), "transmission_angle_least"),
    Constraint(
        "greatest_transmission_angle", Sense.AT_MOST, _greatest_angle, _angle, (), "transmission_angle_greatest"
    ),
    Constraint("max_pin_force", Sense.AT_MOST, lambda x: x.max_pin_force, _force, _LOADED),
    Constraint("coupler_peak", Sense.AT_MOST, lambda x: x.max_pin_force, _coupler_peak, _LOADED, asked=False),
)
"""All limits."""


def active(limits: Limits, check: LinkageCheck, tolerance: float) -> tuple[str, ...]:
    """Limits that are active for a checked linkage, to a relative tolerance."""
    found = []
    for row in CONSTRAINTS:
        limit, reached = row.limit(limits), row.reached(check)
        if row.asked and limit is not None and reached is not None and abs(reached / limit - 1.0) <= tolerance:
            found.append(row.active_name or row.name)
    return tuple(found)
