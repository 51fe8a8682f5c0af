"""The flexible rod at the edge: its requests and results in millimetres, megapascals and watts."""

from __future__ import annotations

import json
import math
from importlib.resources import files
from typing import Annotated, Any, Literal

from pydantic import Field

from app.designs.kind import Answer, Job, Kind, Mode
from app.designs.schema import (
    GIGA,
    MEGA,
    MILLI,
    Finite,
    NotNegative,
    Positive,
    SolverRequest,
    Strict,
    entry,
    envelope,
    refusal_problem,
    scaled,
)
from app.designs.stability_map import stability_map
from solvers import rod
from solvers.errors import InvalidInput
from solvers.fatigue import CRITERIA


class Mechanism(Strict):
    crank_radius_mm: Positive = Field(description="r, crank radius; less than the rod's length")
    rod_length_mm: Positive = Field(description="L, clamp in the piston to crank pin")
    speed_hz: Positive = Field(description="revolutions per second")


class Piston(Strict):
    diameter_mm: Positive
    skirt_length_mm: Positive
    reciprocating_mass_kg: NotNegative = 0.0
    clamp_offset_mm: Finite = Field(default=0.0, description="e, clamp from mid-skirt toward the crank")
    friction_coefficient: float = Field(default=0.0, ge=0, le=1)


class SchmidtLoad(Strict):
    kind: Literal["schmidt"]
    p_min_mpa: NotNegative
    delta: float = Field(ge=0, lt=1, description="compression parameter")
    theta_rad: Finite = Field(description="angle of greatest pressure")
    back_pressure_mpa: Finite | None = Field(default=None, description="null: the mean of the cycle")

    def to_solver(self) -> rod.SchmidtLoad:
        return rod.SchmidtLoad(self.p_min_mpa * MEGA, self.delta, self.theta_rad, _pressure(self.back_pressure_mpa))


class TableLoad(Strict):
    kind: Literal["table"]
    angle_deg: list[Finite] = Field(min_length=3, max_length=10_000, description="rising, within one turn")
    pressure_mpa: list[Finite] = Field(min_length=3, max_length=10_000)
    back_pressure_mpa: Finite | None = Field(default=None, description="null: the mean of the cycle")

    def to_solver(self) -> rod.TableLoad:
        return rod.TableLoad(
            tuple(math.radians(a) for a in self.angle_deg),
            tuple(p * MEGA for p in self.pressure_mpa),
            _pressure(self.back_pressure_mpa),
        )


class ConstantLoad(Strict):
    kind: Literal["constant"]
    constant_pressure_mpa: Finite
    back_pressure_mpa: Finite | None = Field(default=None, description="null: none")

    def to_solver(self) -> rod.ConstantLoad:
        return rod.ConstantLoad(self.constant_pressure_mpa * MEGA, _pressure(self.back_pressure_mpa))


def _pressure(value: float | None) -> float | None:
    return None if value is None else value * MEGA


class CustomMaterial(Strict):
    elastic_modulus_gpa: Positive
    fatigue_limit_mpa: Positive = Field(description="alternating bending of a smooth specimen")
    fatigue_reduction: float = Field(ge=1, le=100, description="K: notch, size and surface together")
    mean_stress_sensitivity: float = Field(ge=0, lt=1, description="psi")
    yield_strength_mpa: Positive
    density_kg_m3: Positive
    poisson: float = Field(default=0.3, gt=-1, lt=0.5)
    ultimate_strength_mpa: Positive | None = Field(default=None, description="for Goodman and Gerber")

    def to_solver(self) -> rod.Material:
        return rod.Material(
            self.elastic_modulus_gpa * GIGA,
            self.fatigue_limit_mpa * MEGA,
            self.fatigue_reduction,
            self.mean_stress_sensitivity,
            self.yield_strength_mpa * MEGA,
            self.density_kg_m3,
            self.poisson,
            None if self.ultimate_strength_mpa is None else self.ultimate_strength_mpa * MEGA,
        )


class CatalogueMaterial(Strict):
    name: Literal[tuple(rod.CATALOGUE)] = Field(description="a name of the catalogue")  # type: ignore[valid-type]

    def to_solver(self) -> rod.Material:
        return rod.CATALOGUE[self.name]


class Dimensions(Strict):
    b_mm: Positive
    h_mm: Positive
    l_mm: Positive


class RodRequest(SolverRequest):
    """The machine, its load and its material."""

    mechanism: Mechanism
    piston: Piston
    load: Annotated[SchmidtLoad | TableLoad | ConstantLoad, Field(discriminator="kind")]
    material: CustomMaterial | CatalogueMaterial
    fatigue_criterion: Literal[tuple(CRITERIA)] = Field(  # type: ignore[valid-type]
        default="serensen", description="the convention of the fatigue safety"
    )

    def contradictions(self) -> list[dict[str, str]]:
        if self.mechanism.crank_radius_mm < self.mechanism.rod_length_mm:
            return []
        return [
            entry(
                "/mechanism/crank_radius_mm",
                "the crank is not shorter than the rod, so the mechanism cannot turn",
                "less than mechanism.rod_length_mm",
            )
        ]

    def scene(self) -> rod.Scene:
        m, p = self.mechanism, self.piston
        return rod.Scene(
            rod.Mechanism(m.crank_radius_mm * MILLI, m.rod_length_mm * MILLI, m.speed_hz),
            rod.Piston(
                p.diameter_mm * MILLI,
                p.skirt_length_mm * MILLI,
                p.reciprocating_mass_kg,
                p.clamp_offset_mm * MILLI,
                p.friction_coefficient,
            ),
            self.load.to_solver(),
            self.material.to_solver(),
        )


class CheckRequest(RodRequest):
    """A strip of given dimensions in its machine."""

    dimensions: Dimensions

    def contradictions(self) -> list[dict[str, str]]:
        found = super().contradictions()
        if self.dimensions.l_mm > self.mechanism.rod_length_mm:
            found.append(
                entry("/dimensions/l_mm", "the free length exceeds the rod", "at most mechanism.rod_length_mm")
            )
        return found


class RodResult(Strict):
    """What a strip does in its machine; null where a result does not exist (no load, no effect, no stability)."""

    dimensions: Dimensions
    fatigue_safety: float | None
    stability_safety: float | None
    yield_safety: float | None
    critical_force_n: float
    buckles_sideways: bool
    axial_force_min_n: float
    axial_force_max_n: float
    stress_amplitude_mpa: float | None
    stress_mean_mpa: float | None
    worst_section_mm: float | None
    worst_fibre: int | None
    side_force_max_n: float | None
    clamp_moment_max_nmm: float | None
    contact_pressure_max_mpa: float | None
    friction_power_w: float | None
    deflection_ratio: float | None
    natural_frequency_hz: float
    mass_g: float
    fatigue_criterion: str
    warnings: list[str]


def result_of(check: rod.RodCheck) -> dict[str, Any]:
    """A check in the names and units of the contract."""
    d, s = check.dimensions, check.stresses
    return {
        "dimensions": {"b_mm": d.b / MILLI, "h_mm": d.h / MILLI, "l_mm": d.l / MILLI},
        "fatigue_safety": s and s.fatigue_safety,
        "stability_safety": check.stability_safety,
        "yield_safety": s and s.yield_safety,
        "critical_force_n": check.critical_force,
        "buckles_sideways": check.buckles_sideways,
        "axial_force_min_n": check.axial_force_min,
        "axial_force_max_n": check.axial_force_max,
        "stress_amplitude_mpa": s and s.stress_amplitude / MEGA,
        "stress_mean_mpa": s and s.stress_mean / MEGA,
        "worst_section_mm": s and s.worst_section / MILLI,
        "worst_fibre": s and s.worst_fibre,
        "side_force_max_n": s and s.side_force_max,
        "clamp_moment_max_nmm": s and s.clamp_moment_max / MILLI,
        "contact_pressure_max_mpa": s and scaled(s.contact_pressure_max, MEGA),
        "friction_power_w": s and s.friction_power,
        "deflection_ratio": s and s.deflection_ratio,
        "natural_frequency_hz": check.natural_frequency,
        "mass_g": check.mass / MILLI,
        "fatigue_criterion": check.criterion,
        "warnings": list(check.warnings),
    }


def run_check(request: CheckRequest) -> Answer:
    """Evaluate the strip."""
    d = request.dimensions
    try:
        scene = request.scene()
        outcome = rod.check(
            scene,
            rod.Dimensions(d.b_mm * MILLI, d.h_mm * MILLI, d.l_mm * MILLI),
            request.selection(),
            request.effect_tolerance,
            request.accuracy,
            CRITERIA[request.fatigue_criterion](scene.material),
        )
    except InvalidInput as refusal:
        return Answer("refused", None, [], None, {}, refusal_problem(request, refusal))
    return Answer(**envelope(outcome, result_of(outcome.value)))


class Requirements(Strict):
    min_fatigue_safety: Positive
    min_stability_safety: float = Field(ge=1, le=1e6)
    max_contact_pressure_mpa: Positive | None = None
    max_friction_power_w: Positive | None = None
    min_yield_safety: Positive | None = None


Range = Annotated[list[Positive], Field(min_length=2, max_length=2, description="least and greatest")]


class RodBounds(Strict):
    b_mm: Range
    h_mm: Range
    l_mm: Range


class DesignRequest(RodRequest):
    """The best strip for a machine: requirements, bounds, and what is wanted."""

    requirements: Requirements
    bounds: RodBounds
    objective: Literal[tuple(rod.OBJECTIVES)] = "mass"  # type: ignore[valid-type]

    def contradictions(self) -> list[dict[str, str]]:
        found = super().contradictions()
        for name in ("b_mm", "h_mm", "l_mm"):
            low, high = getattr(self.bounds, name)
            if low > high:
                found.append(entry(f"/bounds/{name}", "the least exceeds the greatest", "[least, greatest]"))
        if self.bounds.l_mm[0] > self.mechanism.rod_length_mm:
            found.append(entry("/bounds/l_mm", "starts beyond the rod's own length", "at most mechanism.rod_length_mm"))
        return found

    def problem(self) -> rod.RodProblem:
        r, b = self.requirements, self.bounds
        return rod.RodProblem(
            self.scene(),
            rod.Bounds(*(tuple(v * MILLI for v in pair) for pair in (b.b_mm, b.h_mm, b.l_mm))),
            rod.Requirements(
                r.min_fatigue_safety,
                r.min_stability_safety,
                _pressure(r.max_contact_pressure_mpa),
                r.max_friction_power_w,
                r.min_yield_safety,
            ),
            rod.OBJECTIVES[self.objective],
        )


class Active(Strict):
    name: str
    sensitivity: float


class DesignResult(RodResult):
    """The strip found, with the constraints that shape it."""

    objective: str
    active_constraints: list[Active]


_UNITS = {
    "max_contact_pressure": ("max_contact_pressure_mpa", MEGA),
    "max_friction_power": ("max_friction_power_w", 1.0),
}


def run_design(request: DesignRequest) -> Answer:
    """Find the strip."""
    try:
        problem = request.problem()
        criterion = CRITERIA[request.fatigue_criterion](problem.scene.material)
        outcome = rod.design(problem, request.selection(), request.effect_tolerance, request.accuracy, criterion)
    except InvalidInput as refusal:
        return Answer("refused", None, [], None, {}, refusal_problem(request, refusal))
    if outcome.value is None:
        parts = envelope(outcome, None)
        for item in parts["result"]["diagnosis"]:
            item["requirement"], unit = _UNITS.get(item["requirement"], (item["requirement"], 1.0))
            item["required"], item["attainable"] = item["required"] / unit, scaled(item["attainable"], unit)
        return Answer(**parts)
    found = outcome.value
    result = {
        **result_of(found.check),
        "objective": found.objective,
        "active_constraints": [{"name": a.name, "sensitivity": a.sensitivity} for a in found.active],
    }
    return Answer(**envelope(outcome, result))


def effects() -> list[dict[str, Any]]:
    """The effects a rod's scene can call for."""
    return [{"name": e.name, "summary": e.summary, "measure": e.measure} for e in rod.EFFECTS]


def example(mode: Mode) -> dict[str, Any]:
    """The paper's machine as a request of the given mode."""
    return json.loads((files("app.designs") / "examples" / f"flexible-rod-{mode}.json").read_text("utf-8"))


FLEXIBLE_ROD = Kind(
    slug="flexible-rod",
    title="Flexible rod",
    summary="the strip rod of a crank-slider machine: width, thickness and free length",
    jobs={
        Mode.DESIGN: Job(DesignRequest, DesignResult, run_design),
        Mode.CHECK: Job(CheckRequest, RodResult, run_check),
    },
    effects=effects,
    example=example,
    plots={"stability-map": stability_map},
)
