"""What can be asked of the piston pin, in the units of the contract, and the way into the solver's SI scene."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from app.designs.schema import (
    GIGA,
    MEGA,
    MILLI,
    Entry,
    NotNegative,
    Positive,
    SolverRequest,
    Strict,
    entry,
)
from solvers import pin

MICRO = 1e-6
MOST_POINTS = 5_000
FORMS = ("free", "drillable", "constant", "stepped", "double_cone", "cone_cylinder")
_PLAIN_FORMS = {
    "free": pin.Free(),
    "drillable": pin.Free(drillable=True),
    "constant": pin.Constant(),
    "double_cone": pin.Cone(),
    "cone_cylinder": pin.Cone(cylinder=True),
}


def _times(value: float | None, unit: float) -> float | None:
    return None if value is None else value * unit


class Geometry(Strict):
    outer_diameter_mm: Positive | None = Field(default=None, description="D; null only where the outside is sought")
    boss_length_mm: Positive = Field(description="a, the length in each boss of the piston")
    small_end_length_mm: Positive = Field(description="b, the length in the rod's small end")
    gap_mm: NotNegative = Field(default=0.0, description="between small end and boss")


class Load(Strict):
    force_n: float = Field(ge=0, le=1e12, description="greatest force on the piston")


class Material(Strict):
    allowable_stress_mpa: Positive
    allowable_shear_mpa: Positive | None = Field(default=None, description="null: the criterion alone")
    elastic_modulus_gpa: Positive
    poisson: float = Field(default=0.3, ge=0, lt=0.5)
    density_kg_m3: Positive

    def to_solver(self) -> pin.PinMaterial:
        return pin.PinMaterial(
            self.allowable_stress_mpa * MEGA,
            self.elastic_modulus_gpa * GIGA,
            self.poisson,
            self.density_kg_m3,
            _times(self.allowable_shear_mpa, MEGA),
        )


class PinLimits(Strict):
    """What the pin must keep besides strength; null: no such limit."""

    min_wall_mm: NotNegative | None = Field(default=0.0, description="least wall thickness")
    max_deflection_um: Positive | None = Field(default=None, description="of the middle against the bosses' edges")
    max_ovalization_um: Positive | None = Field(default=None, description="calls for the effect ovalization")
    max_slope: Positive | None = Field(default=None, description="change of the bore's diameter per length")

    def to_solver(self) -> pin.Limits:
        return pin.Limits(
            (self.min_wall_mm or 0.0) * MILLI,
            _times(self.max_deflection_um, MICRO),
            _times(self.max_ovalization_um, MICRO),
            self.max_slope,
        )


class BoreForm(Strict):
    """The shapes that the bore may have."""

    kind: Literal[FORMS] = "free"  # type: ignore[valid-type]
    steps: float | None = Field(
        default=None, ge=1, le=12, multiple_of=1, description="bores from each end to the middle; stepped only"
    )

    def to_solver(self) -> pin.Free | pin.Constant | pin.Stepped | pin.Cone:
        return pin.Stepped(int(self.steps or 2)) if self.kind == "stepped" else _PLAIN_FORMS[self.kind]


class PinRequest(SolverRequest):
    """The pin, its load, its material, and what it must keep."""

    geometry: Geometry
    load: Load
    material: Material
    criterion: Literal[tuple(pin.CRITERIA)] = Field(  # type: ignore[valid-type]
        default="tresca_paper", description="how bending and shear join in one equivalent stress"
    )
    limits: PinLimits = PinLimits()
    form: BoreForm = Field(default=BoreForm(), description="of the bore that a design seeks; a check keeps its own")

    def contradictions(self) -> list[Entry]:
        g, found = self.geometry, []
        wall = self.limits.min_wall_mm or 0.0
        if g.outer_diameter_mm is not None and 2.0 * wall > g.outer_diameter_mm:
            found.append(entry("/limits/min_wall_mm", "is more than the pin's radius", "at most half the diameter"))
        if self.form.kind == "stepped" and self.form.steps is None:
            found.append(entry("/form/steps", "a stepped bore needs the number of its steps", "1 … 12"))
        if self.form.kind != "stepped" and self.form.steps is not None:
            found.append(entry("/form/steps", "only a stepped bore has steps", "null"))
        return found

    def scene(self) -> pin.Scene:
        """The pin in SI units. Raises InvalidInput for what only the solver can see."""
        g = self.geometry
        return pin.Scene(
            pin.Geometry(
                (g.outer_diameter_mm or 0.0) * MILLI,
                g.boss_length_mm * MILLI,
                g.small_end_length_mm * MILLI,
                g.gap_mm * MILLI,
            ),
            self.load.force_n,
            self.material.to_solver(),
        )


def _needs_outside(request: PinRequest) -> list[Entry]:
    if request.geometry.outer_diameter_mm is not None:
        return []
    return [entry("/geometry/outer_diameter_mm", "the outer diameter is missing", "a positive number")]


class Point(Strict):
    x_mm: NotNegative
    bore_mm: NotNegative


Points = Annotated[list[Point], Field(min_length=1, max_length=MOST_POINTS)]


class CheckRequest(PinRequest):
    """A pin with a given bore: one all along, or points joined by straight lines."""

    bore_mm: NotNegative | None = Field(default=None, description="one bore all along")
    profile: Points | None = Field(
        default=None, description="points that do not fall in x; two at one x are a step; half a pin stands for both"
    )

    def contradictions(self) -> list[Entry]:
        g = self.geometry
        found = super().contradictions() + _needs_outside(self)
        if (self.bore_mm is None) == (self.profile is None):
            found.append(entry("/bore_mm", "a check needs a bore or a profile", "one of bore_mm and profile"))
        if g.outer_diameter_mm is not None and self.bore_mm is not None and self.bore_mm > g.outer_diameter_mm:
            found.append(entry("/bore_mm", "is wider than the pin", "at most geometry.outer_diameter_mm"))
        return found

    def bore(self) -> pin.Profile:
        """The profile in metres."""
        if self.profile is None:
            return pin.Profile((0.0,), (self.bore_mm * MILLI,))
        return pin.Profile(tuple(p.x_mm * MILLI for p in self.profile), tuple(p.bore_mm * MILLI for p in self.profile))


class DesignRequest(PinRequest):
    """The lightest pin of a form."""

    def contradictions(self) -> list[Entry]:
        return super().contradictions() + _needs_outside(self)

    def problem(self) -> pin.PinProblem:
        """The design problem in SI units. Raises InvalidInput for what only the solver can see."""
        return pin.PinProblem(
            self.scene(), self.limits.to_solver(), self.form.to_solver(), pin.CRITERIA[self.criterion]
        )
