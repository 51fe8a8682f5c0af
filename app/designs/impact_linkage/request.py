"""Requests of the impact linkage in the units of the API, and their conversion to SI scenes.

A form sends every field it shows, so a group of null values is equivalent to an omitted one.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from app.designs.schema import DesignSettings, Entry, NotNegative, Positive, SolverRequest, Strict, entry, one_of
from app.designs.units import MILLI, si
from solvers import linkage
from solvers.errors import InvalidInput
from solvers.linkage.scene import GREATEST_RESTITUTION, LEAST_RESTITUTION

TYPES = tuple(linkage.KINDS)
TypeName = Literal[TYPES]  # type: ignore[valid-type]
Coefficient = Annotated[float, Field(ge=LEAST_RESTITUTION, le=GREATEST_RESTITUTION, allow_inf_nan=False)]
Angle = Annotated[float, Field(ge=0, le=180, allow_inf_nan=False)]
Range = Annotated[list[Angle], Field(min_length=2, max_length=2, description="minimum and maximum")]


class RestitutionRange(Strict):
    """A range of restitution coefficients; the mechanism is designed for the middle."""

    low: Coefficient
    high: Coefficient


def _form_of_restitution(value: Any) -> str | None:
    if isinstance(value, (dict, BaseModel)):
        return "range"
    return "number" if isinstance(value, (int, float)) and not isinstance(value, bool) else None


_Restitution = one_of(
    _form_of_restitution, {"number": Coefficient, "range": RestitutionRange}, "a number, or an object with low and high"
)


class LinkageLimits(Strict):
    """Limits of the mechanism; null: none."""

    min_link_mm: NotNegative | None = Field(default=0.0, description="minimum length of any link")
    joint_radius_mm: NotNegative | None = Field(
        default=0.0, description="clearance around every joint, added on all sides"
    )
    longest_link_mm: Positive | None = None
    width_mm: Positive | None = Field(
        default=None, description="side of the bounding box of the swept area; needs the effect envelope"
    )
    height_mm: Positive | None = Field(
        default=None, description="side of the bounding box of the swept area; needs the effect envelope"
    )
    enclosing_radius_mm: Positive | None = Field(
        default=None, description="radius of a circle (a pipe) that encloses the swept area"
    )
    max_pin_force_n: Positive | None = None
    transmission_angle_deg: Range | None = Field(
        default=[40.0, 140.0],
        description="range of the transmission angle between coupler and rocker in mid-cycle; null: any",
    )

    def to_solver(self) -> linkage.Limits:
        return linkage.Limits(**{"transmission_angle": None, **si(self)})


class Group(Strict):
    """Positive quantities of which all or none must be given."""

    @property
    def given(self) -> bool:
        """Whether any field is not null."""
        return any(vars(self).values())

    def gaps(self, pointer: str) -> list[Entry]:
        """An entry for every null field if another one is given."""
        if not self.given:
            return []
        missing = [name for name, value in self if value is None]
        return [entry(f"{pointer}/{name}", "is missing beside the others", "a number") for name in missing]


class Drive(Group):
    """A motor with a linear torque-speed curve, and the inertia it drives; activates the effect impact_dynamics."""

    stall_torque_nm: Positive | None = Field(default=None, description="stall torque of the motor, at the crank")
    free_speed_hz: Positive | None = Field(
        default=None, description="no-load speed at the crank, in revolutions per second"
    )
    crank_inertia_kg_m2: Positive | None = Field(
        default=None, description="moment of inertia of crank and flywheel together"
    )

    def to_solver(self) -> linkage.Drive:
        return linkage.Drive(self.stall_torque_nm, 2.0 * math.pi * self.free_speed_hz, self.crank_inertia_kg_m2)


class LinkageRequest(SolverRequest):
    """Blow, drive and limits of the mechanism."""

    restitution: _Restitution = Field(description="physical coefficient of restitution of the impact")
    blow_frequency_hz: Positive | None = Field(
        default=None, description="blows per second: one per revolution of the crank"
    )
    impact_speed_m_s: Positive | None = Field(default=None, description="speed of the tool just before the blow")
    impact_energy_j: Positive | None = Field(
        default=None, description="kinetic energy of rocker and tool just before the blow"
    )
    tool_radius_mm: Positive | None = Field(default=None, description="null: the rocker's length")
    limits: LinkageLimits = LinkageLimits()
    drive: Drive | None = None
    coupler_stiffness_n_m: Annotated[float, Field(ge=1.0, le=1e12, allow_inf_nan=False)] | None = Field(
        default=None, description="stiffness of the coupler; activates the effect coupler_elasticity"
    )
    length_tolerance_mm: Positive | None = Field(
        default=None, description="tolerance of each length; activates the effect tolerances"
    )

    def contradictions(self) -> list[Entry]:
        found = [] if self.drive is None else self.drive.gaps("/drive")
        if isinstance(self.restitution, RestitutionRange) and self.restitution.low > self.restitution.high:
            found.append(entry("/restitution/low", "exceeds restitution.high", "at most restitution.high"))
        angle = self.limits.transmission_angle_deg
        if angle is not None and angle[0] > angle[1]:
            at = "/limits/transmission_angle_deg/0"
            found.append(entry(at, "the least exceeds the greatest", "at most the greatest"))
        if self.impact_energy_j is None:
            needing = {"drive": self.motor, "coupler_stiffness_n_m": self.coupler_stiffness_n_m}
            names = [name for name, value in needing.items() if value is not None]
            found += [_missing("impact_energy_j", f"{name} means nothing without it") for name in names]
        if self.blow_frequency_hz is None and self.motor is not None:
            found.append(_missing("blow_frequency_hz", "drive means nothing without it"))
        return found

    @property
    def motor(self) -> Drive | None:
        """The drive, if given."""
        return self.drive if self.drive is not None and self.drive.given else None

    @property
    def range(self) -> linkage.Restitution:
        found = self.restitution
        if isinstance(found, RestitutionRange):
            return linkage.Restitution(found.low, found.high)
        return linkage.Restitution(float(found), float(found))

    @property
    def timed(self) -> bool:
        """Whether the request determines the frequency of the blows."""
        return self.blow_frequency_hz is not None

    def scene(self) -> linkage.Scene:
        """The scene in SI units; frequency, speed and energy default to 1.

        Raises InvalidInput for input only the solver can reject.
        """
        return linkage.Scene(
            self.range,
            self.blow_frequency_hz or 1.0,
            self.impact_speed_m_s or 1.0,
            self.impact_energy_j or 1.0,
            None if self.tool_radius_mm is None else self.tool_radius_mm * MILLI,
            self.motor and self.motor.to_solver(),
            self.coupler_stiffness_n_m,
            None if self.length_tolerance_mm is None else self.length_tolerance_mm * MILLI,
        )


def _missing(name: str, why: str) -> Entry:
    return entry(f"/{name}", f"is missing: {why}", "a positive number")


class RatioGiven(Strict):
    """The free ratio of the type: lambda2 (coupler/crank), or lambda0 (base/crank) for largest_base."""

    lambda0: Positive | None = None
    lambda2: Positive | None = None


class LinkLengths(Group):
    base: Positive | None = None
    crank: Positive | None = None
    coupler: Positive | None = None
    rocker: Positive | None = None

    def to_solver(self) -> linkage.Lengths:
        return linkage.Lengths(*(length * MILLI for _, length in self))


class CheckRequest(LinkageRequest):
    """A check of a linkage given by type and free ratio, then with R_k = R, or by its four lengths.

    Results that require a missing frequency, speed or energy are null.
    """

    type: TypeName | None = Field(default=None, description="null: recognised from the lengths")
    ratios: RatioGiven | None = None
    lengths_mm: LinkLengths | None = None

    def contradictions(self) -> list[Entry]:
        found = super().contradictions()
        lengths = self.lengths_mm is not None and self.lengths_mm.given
        ratios = self.ratios is not None and (self.ratios.lambda0, self.ratios.lambda2) != (None, None)
        if lengths == ratios:
            why = "not both ratios and lengths can be given" if lengths else "a check needs ratios or lengths"
            return [*found, entry("/ratios", why, "exactly one of the two")]
        if lengths:
            return found + (self.lengths_mm.gaps("/lengths_mm") or self._other_type())
        if self.type is None:
            return [*found, entry("/type", "a free ratio needs the type it belongs to", ", ".join(TYPES))]
        wanted = linkage.KINDS[self.type].parameter
        for name in ("lambda0", "lambda2"):
            if (getattr(self.ratios, name) is None) == (name == wanted):
                why = "is the free ratio of this type" if name == wanted else "is no free ratio of this type"
                found.append(entry(f"/ratios/{name}", why, f"{wanted} alone"))
        return found

    def _other_type(self) -> list[Entry]:
        """A type beside lengths that close as another one."""
        try:
            found = linkage.of_lengths(self.lengths_mm.to_solver(), self.type and linkage.KINDS[self.type])
        except InvalidInput:
            return []  # reported by the check itself
        told = found.bar.kind.name
        if self.type in (None, told) or not found.closure.closes:
            return []
        return [entry("/type", f"these lengths are those of a {told}", f"{told}, or null")]

    @property
    def sized(self) -> bool:
        """Whether the request determines the size of the mechanism."""
        if (self.lengths_mm is not None and self.lengths_mm.given) or self.tool_radius_mm is not None:
            return True
        return self.blow_frequency_hz is not None and self.impact_speed_m_s is not None

    def given(self) -> linkage.Given:
        """The parts of the scene that the request determines."""
        sized = self.sized
        timed = sized and self.timed
        return linkage.Given(
            size=sized,
            speed=timed,
            speed_asked=timed and self.impact_speed_m_s is not None,
            energy=self.impact_energy_j is not None,
        )

    def mechanism(self) -> tuple[linkage.Scene, linkage.Mechanism]:
        """Scene and linkage; without a requested speed, the scene has the linkage's own."""
        scene = self.scene()
        if self.lengths_mm is not None and self.lengths_mm.given:
            kind = None if self.type is None else linkage.KINDS[self.type]
            found = linkage.of_lengths(self.lengths_mm.to_solver(), kind)
        else:
            kind = linkage.KINDS[self.type]
            found = linkage.of_ratio(scene, kind, getattr(self.ratios, kind.parameter))
        if self.impact_speed_m_s is None or self.blow_frequency_hz is None:
            own = scene.tool_speed(found)
            scene = replace(scene, impact_speed=own) if own > 0 and math.isfinite(own) else scene
        return scene, found


class FrontRequest(Strict):
    """A Pareto front: the optimal objective for limits on another quantity, from its minimum up."""

    against: Literal[("none", *linkage.AGAINST)] = Field(  # type: ignore[valid-type]
        default="none", description="the quantity traded against the objective"
    )
    points: float = Field(default=9, ge=2, le=linkage.MOST_POINTS, multiple_of=1)


class DesignRequest(LinkageRequest, DesignSettings):
    """A design: the best linkage over the allowed types."""

    types: list[TypeName] = Field(
        default=list(TYPES), min_length=1, max_length=3, description="allowed types of linkage"
    )
    objective: Literal[tuple(linkage.OBJECTIVES)] = "box_area"  # type: ignore[valid-type]
    front: FrontRequest = Field(
        default=FrontRequest(), description="trade-off with another quantity; against none: the best linkage alone"
    )

    def contradictions(self) -> list[Entry]:
        found = super().contradictions()
        for name in ("blow_frequency", "impact_speed"):
            field = next(f for f in type(self).model_fields if f.startswith(name))
            if getattr(self, field) is None and self.objective != name:
                found.append(_missing(field, "nothing else settles how fast the mechanism moves"))
        loads = self.objective in ("peak_torque", "pin_force") or self.limits.max_pin_force_n is not None
        if self.impact_energy_j is None and (loads or self.front.against == "pin_force"):
            found.append(_missing("impact_energy_j", "loads are asked about"))
        if self.front.against == self.objective:
            found.append(entry("/front/against", "is the objective itself", "another quantity than the objective"))
        return found

    @property
    def timed(self) -> bool:
        return super().timed or self.objective == "blow_frequency"

    def given(self) -> linkage.Given:
        """The parts of the scene that the request determines; the design determines the rest."""
        return linkage.Given(
            speed_asked=self.objective != "impact_speed" and self.impact_speed_m_s is not None,
            energy=self.impact_energy_j is not None,
        )

    def problem(self) -> linkage.LinkageProblem:
        """The design problem in SI units. Raises InvalidInput for input only the solver can reject."""
        kinds = tuple(kind for name, kind in linkage.KINDS.items() if name in self.types)
        return linkage.LinkageProblem(self.scene(), self.limits.to_solver(), linkage.OBJECTIVES[self.objective], kinds)
