"""Requests of the pin in the units of the API, and their conversion to SI scenes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from app.designs.references import RunForce
from app.designs.schema import (
    DesignSettings,
    Entry,
    NotNegative,
    Positive,
    SolverRequest,
    Strict,
    entry,
    listed_or_own,
    named,
    one_of,
)
from app.designs.units import MILLI, si
from solvers import pin

MAX_POINTS = 5_000
_NO_BORE_MM, _NO_FORCE_N = 1e-12, 1e-100
"""A bushing with a smaller bore is a shaft, and a smaller force is none: squares or stresses of such numbers
underflow."""
FORMS = ("free", "drillable", "constant", "stepped", "double_cone", "cone_cylinder")
CONES = ("double_cone", "cone_cylinder")
VARIABLES = ("bore", "outer")
_PLAIN_FORMS = {
    "free": pin.Free(),
    "drillable": pin.Free(drillable=True),
    "constant": pin.Constant(),
    "double_cone": pin.Cone(),
    "cone_cylinder": pin.Cone(cylinder=True),
}


class Geometry(Strict):
    outer_diameter_mm: Positive | None = Field(
        default=None, description="D, outer diameter; omitted in the design of a bushing, which determines it"
    )
    boss_length_mm: Positive = Field(description="a, length in each boss of the piston")
    small_end_length_mm: Positive = Field(description="b, length in the rod's small end")
    gap_mm: NotNegative = Field(default=0.0, description="δ, gap between small end and boss")


class Load(Strict):
    force_n: float = Field(ge=0, le=1e12, description="maximum force on the piston")

    @property
    def force(self) -> float:
        """The force [N]."""
        return self.force_n


def _form_of_load(value: Any) -> str:
    return "run" if named(value, "kind") == "run" or named(value, "run_id") is not None else "force"


_Load = one_of(_form_of_load, {"force": Load, "run": RunForce}, 'an object with force_n, or one whose "kind" is run')


class PinMaterial(Strict):
    """The properties of any material."""

    allowable_stress_mpa: Positive
    allowable_shear_mpa: Positive | None = Field(
        default=None, description="allowable shear stress; null: only the strength criterion applies"
    )
    elastic_modulus_gpa: Positive
    poisson: float = Field(default=0.3, ge=0, lt=0.5)
    density_kg_m3: Positive

    def to_solver(self) -> pin.PinMaterial:
        return pin.PinMaterial(**si(self))


class PinSteel(Strict):
    """A steel of the catalogue, with an optional allowable stress that overrides the catalogue's."""

    name: Literal[tuple(pin.CATALOGUE)] = Field(description="name of a material in the catalogue")  # type: ignore[valid-type]
    allowable_stress_mpa: Positive | None = Field(
        default=None, description="allowable stress; null: that of the catalogue"
    )
    allowable_shear_mpa: Positive | None = Field(
        default=None, description="allowable shear stress; null: only the strength criterion applies"
    )

    def to_solver(self) -> pin.PinMaterial:
        listed = pin.CATALOGUE[self.name]
        own = si(self)
        return pin.PinMaterial(
            own.get("allowable_stress", listed.allowable_stress), listed.elastic_modulus, listed.poisson,
            listed.density, own.get("allowable_shear"),
        )  # fmt: skip


Material = listed_or_own(PinSteel, PinMaterial)


def material_of(spec: Mapping[str, Any]) -> pin.PinMaterial:
    """The material of a stored request, SI units."""
    given = spec["material"]
    return (PinSteel if "name" in given else PinMaterial).model_validate(given).to_solver()


class PinLimits(Strict):
    """Constraints in addition to strength; null: none."""

    min_wall_mm: NotNegative | None = Field(default=0.0, description="minimum wall thickness")
    max_deflection_um: Positive | None = Field(
        default=None, description="deflection of the middle relative to the edges of the bosses"
    )
    max_ovalization_um: Positive | None = Field(
        default=None, description="increase of the diameter by ovalization; needs the effect ovalization"
    )
    max_slope: Positive | None = Field(default=None, description="change of the bore's diameter per unit length")
    max_ring_stress_mpa: Positive | None = Field(
        default=None,
        description="hoop stress of the ring; needs the effect ovalization. null: no limit in a design, but the "
        "verdict compares it with the allowable stress. Textbooks allow 300 to 350 MPa for hardened "
        "pins",
    )

    def to_solver(self) -> pin.Limits:
        return pin.Limits(**si(self))


class BoreForm(Strict):
    """The allowed shapes of the bore."""

    kind: Literal[FORMS] = "free"  # type: ignore[valid-type]
    steps: float | None = Field(
        default=None,
        ge=1,
        le=12,
        multiple_of=1,
        description="number of bore steps from each end to the middle; stepped shapes only",
    )

    def to_solver(self) -> pin.Free | pin.Constant | pin.Stepped | pin.Cone:
        return pin.Stepped(int(self.steps or 2)) if self.kind == "stepped" else _PLAIN_FORMS[self.kind]


class PinRequest(SolverRequest):
    """Pin, load, material and limits."""

    geometry: Geometry
    load: _Load
    material: Material
    criterion: Literal[tuple(pin.CRITERIA)] = Field(  # type: ignore[valid-type]
        default="tresca_paper", description="strength criterion that combines bending and shear in an equivalent stress"
    )
    limits: PinLimits = PinLimits()
    form: BoreForm = Field(
        default=BoreForm(),
        description="family of shapes that a design searches; a drillable outside does not narrow toward the middle",
    )
    variable: Literal[VARIABLES] = Field(  # type: ignore[valid-type]
        default="bore", description="bore: a pin of given outer diameter; outer: a bushing of given bore_mm"
    )
    bore_mm: NotNegative | None = Field(
        default=None, description="one bore over the whole length: of the pin to be checked, or of the bushing"
    )

    @property
    def seeks_outside(self) -> bool:
        return self.variable == "outer"

    def contradictions(self) -> list[Entry]:
        g, found = self.geometry, []
        wall = self.limits.min_wall_mm or 0.0
        if not self.seeks_outside and g.outer_diameter_mm is not None and 2.0 * wall > g.outer_diameter_mm:
            found.append(entry("/limits/min_wall_mm", "is more than the pin's radius", "at most half the diameter"))
        if self.form.kind == "stepped" and self.form.steps is None:
            found.append(entry("/form/steps", "a stepped bore needs the number of its steps", "1 … 12"))
        if self.form.kind != "stepped" and self.form.steps is not None:
            found.append(entry("/form/steps", "only a stepped bore has steps", "null"))
        if self.seeks_outside and self.form.kind in CONES:
            found.append(entry("/form/kind", "is no form of a bushing's outside", "free, drillable, constant, stepped"))
        if self.seeks_outside and self.bore_mm is None:
            found.append(entry("/bore_mm", "the bushing's bore is missing", "a number that is not negative"))
        return found

    def scene(self) -> pin.Scene:
        """The scene in SI units. Raises InvalidInput for input only the solver can reject."""
        g = self.geometry
        lengths = g.boss_length_mm * MILLI, g.small_end_length_mm * MILLI, g.gap_mm * MILLI
        geometry: pin.Geometry | pin.BushingGeometry
        if self.seeks_outside:
            bore = self.bore_mm or 0.0
            geometry = pin.BushingGeometry(bore * MILLI if bore > _NO_BORE_MM else 0.0, *lengths)
        else:
            geometry = pin.Geometry((g.outer_diameter_mm or 0.0) * MILLI, *lengths)
        force = self.load.force
        return pin.Scene(geometry, force if force > _NO_FORCE_N else 0.0, self.material.to_solver())


def _needs_outside(request: PinRequest) -> list[Entry]:
    if request.geometry.outer_diameter_mm is not None:
        return []
    return [entry("/geometry/outer_diameter_mm", "the outer diameter is missing", "a positive number")]


class Point(Strict):
    """A position and the diameter there: a pin's bore or a bushing's outer diameter."""

    x_mm: NotNegative
    bore_mm: NotNegative | None = None
    outer_diameter_mm: NotNegative | None = None


Points = Annotated[list[Point], Field(min_length=1, max_length=MAX_POINTS)]


class CheckRequest(PinRequest):
    """A check: a pin with a given bore, or a bushing with a given outer diameter; constant, or points joined by
    straight lines."""

    profile: Points | None = Field(
        default=None,
        description="points with non-decreasing x; two points at the same x are a step; half a pin stands for "
        "both halves. Instead of bore_mm, or of outer_diameter_mm for a bushing",
    )

    @classmethod
    def meant_by(cls, value: dict[str, Any]) -> bool:
        """Whether a raw object, or a stored one with every field filled in, is a check rather than a design."""
        if value.get("variable") == "outer":
            given = value.get("geometry")
            outside = isinstance(given, dict) and given.get("outer_diameter_mm") is not None
            return "profile" in value or (outside and "form" not in value)
        return value.get("profile") is not None or value.get("bore_mm") is not None

    def contradictions(self) -> list[Entry]:
        return (
            super().contradictions() + (self._of_bushing() if self.seeks_outside else self._of_pin()) + self._points()
        )

    def _of_pin(self) -> list[Entry]:
        g, found = self.geometry, _needs_outside(self)
        if (self.bore_mm is None) == (self.profile is None):
            found.append(entry("/bore_mm", "a check needs a bore or a profile", "exactly one of the two"))
        if g.outer_diameter_mm is not None and self.bore_mm is not None and self.bore_mm > g.outer_diameter_mm:
            found.append(entry("/bore_mm", "is wider than the pin", "at most geometry.outer_diameter_mm"))
        return found

    def _of_bushing(self) -> list[Entry]:
        outer = self.geometry.outer_diameter_mm
        if self.profile is None and outer is None:
            return [entry("/geometry/outer_diameter_mm", "the outside is missing", "a number here, or a profile")]
        if self.profile is None and self.bore_mm is not None and self.bore_mm > outer:
            return [entry("/bore_mm", "is wider than the bushing", "at most geometry.outer_diameter_mm")]
        return []

    def _points(self) -> list[Entry]:
        wanted, other = ("outer_diameter_mm", "bore_mm") if self.seeks_outside else ("bore_mm", "outer_diameter_mm")
        found = []
        for k, point in enumerate(self.profile or []):
            if getattr(point, wanted) is None:
                found.append(entry(f"/profile/{k}/{wanted}", "is missing", "a number that is not negative"))
            if getattr(point, other) is not None:
                found.append(entry(f"/profile/{k}/{other}", "is not what this profile gives", "null"))
        return found[:20]

    def given(self) -> pin.Profile:
        """The pin's bore or the bushing's outer diameter [m]."""
        if self.profile is None:
            size = self.geometry.outer_diameter_mm if self.seeks_outside else self.bore_mm
            return pin.Profile((0.0,), (size * MILLI,))
        sizes = (p.outer_diameter_mm if self.seeks_outside else p.bore_mm for p in self.profile)
        return pin.Profile(tuple(p.x_mm * MILLI for p in self.profile), tuple(size * MILLI for size in sizes))


class DesignRequest(PinRequest, DesignSettings):
    """A design: the lightest pin or bushing of a form."""

    @classmethod
    def meant_by(cls, value: dict[str, Any]) -> bool:
        """Whether a raw object is a design rather than a check."""
        return not CheckRequest.meant_by(value)

    def contradictions(self) -> list[Entry]:
        found = super().contradictions()
        if (self.form.steps or 1) > 1 and self.limits.max_slope is not None:
            found.append(entry("/limits/max_slope", "a step has no slope", "no slope limit with steps"))
        if self.seeks_outside:
            return found
        if self.bore_mm is not None:
            found.append(entry("/bore_mm", "is what a pin's design seeks", 'null, or "variable": "outer"'))
        return found + _needs_outside(self)

    def problem(self) -> pin.PinProblem:
        """The problem in SI units. Raises InvalidInput for input only the solver can reject."""
        return pin.PinProblem(
            self.scene(), self.limits.to_solver(), self.form.to_solver(), pin.CRITERIA[self.criterion]
        )
