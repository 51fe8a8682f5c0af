"""The kind flexible-rod: result models in millimetres, megapascals and watts, and calls into the solver."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from pydantic import Field

from app.designs.claims import of_rod
from app.designs.flexible_rod.chain import FOLLOWED, calculation
from app.designs.flexible_rod.cycle_pictures import (
    forces_over_angle,
    has_stresses,
    stress_along_strip,
    stresses_over_angle,
)
from app.designs.flexible_rod.drawing import drawing
from app.designs.flexible_rod.feasible_region import feasible_region, is_design
from app.designs.flexible_rod.form import FORM
from app.designs.flexible_rod.part import part
from app.designs.flexible_rod.pictures import stability_map
from app.designs.flexible_rod.reference import check_reference, design_reference
from app.designs.flexible_rod.request import CheckRequest, DesignRequest, Dimensions
from app.designs.flexible_rod.verdict import WORDS
from app.designs.kind import Answer, Detail, Job, Kind, Mode
from app.designs.schema import (
    CertificateResult,
    RepairDone,
    Strict,
    bulk_answers,
    certificate_json,
    diagnosis_json,
    envelope,
    refusing,
    repairs_json,
    scaled,
)
from app.designs.units import MEGA, MILLI, by_solver_name, in_si
from app.designs.verdict import denials, labels, verdict_json
from solvers import rod
from solvers.fatigue import CRITERIA
from solvers.outcome import Outcome


class RodResult(Strict):
    """Results of a strip; null if a result does not exist (no load, effect not computed, unstable)."""

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
    repairs: list[RepairDone] = Field(description="repairs of the load's points; empty unless requested")
    warnings: list[str]


def result_of(check: rod.RodCheck, repairs: list[dict[str, str]]) -> dict[str, Any]:
    """A check as JSON."""
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
        "repairs": repairs,
        "warnings": list(check.warnings),
    }


def case_of(request: CheckRequest) -> rod.Case:
    """The solver's case. Raises InvalidInput for input only the solver can reject."""
    scene = request.scene()
    criterion = CRITERIA[request.fatigue_criterion](scene.material)
    return rod.Case(scene, request.strip(), request.selection(), request.effect_tolerance, request.accuracy, criterion)


@refusing
def run_check(request: CheckRequest) -> Answer:
    """Check a strip."""
    case = case_of(request)
    return _answer(request, case, case.evaluate())


def run_checks(requests: Sequence[CheckRequest], _detail: Detail) -> Iterator[Answer]:
    """Check strips in bulk."""
    return bulk_answers(requests, case_of, rod.check_many, _answer)


def _answer(request: CheckRequest, _case: rod.Case, outcome: Outcome[rod.RodCheck]) -> Answer:
    verdict = verdict_json(rod.judge(outcome.value, outcome.accuracy, effects=outcome.effects), WORDS, outcome.accuracy)
    return envelope(request, outcome, result_of(outcome.value, repairs_json(request, request.repairs())), verdict)


class Active(Strict):
    name: str = Field(description="a requirement, or a bound such as b_upper")
    sensitivity: float = Field(description="relative change of the objective for a relative change of the bound")


class DesignResult(RodResult):
    """The optimal strip, its active constraints, and the certificate."""

    objective: str
    active_constraints: list[Active]
    certificate: CertificateResult | None


_FIGURES = {
    "mass": "mass_g",
    "friction_power": "friction_power_w",
    "contact_pressure": "contact_pressure_max_mpa",
    "side_force": "side_force_max_n",
    "fatigue_safety": "fatigue_safety",
    "stability_safety": "stability_safety",
}
"""Result names of the objectives."""

_OF_THE_OBJECTIVE = {"core_optimum", "core_bound"}
"""Evidence of a certificate in the objective's unit."""

_LIMITS = by_solver_name("max_contact_pressure_mpa", "max_friction_power_w")
"""API names of requirements with a unit suffix."""


@refusing
def run_design(request: DesignRequest) -> Answer:
    """Design a strip."""
    problem = request.problem()
    criterion = CRITERIA[request.fatigue_criterion](problem.scene.material)
    outcome = rod.design(
        problem, request.selection(), request.effect_tolerance, request.accuracy, criterion, request.time_budget_s
    )
    unit = in_si(_FIGURES[request.objective])[1]
    certificate = certificate_json(outcome.certificate, unit)
    if certificate is not None:
        certificate |= of_rod(outcome, request.objective)
        evidence = certificate["evidence"]
        certificate["evidence"] = {n: v / unit if n in _OF_THE_OBJECTIVE else v for n, v in evidence.items()}
    found, repairs = outcome.value, repairs_json(request, request.repairs())
    if found is None:
        diagnosis = diagnosis_json(outcome, _LIMITS)
        result = {"diagnosis": diagnosis, "warnings": [], "certificate": certificate, "repairs": repairs}
        return envelope(request, outcome, result)
    active = [{"name": _LIMITS.get(a.name, a.name), "sensitivity": a.sensitivity} for a in found.active]
    result = {
        **result_of(found.check, repairs),
        "objective": found.objective,
        "active_constraints": active,
        "certificate": certificate,
    }
    of_check = replace(outcome.accuracy, estimated=found.error)
    verdict = rod.judge(found.check, of_check, problem.requirements, outcome.effects)
    return envelope(request, outcome, result, verdict_json(verdict, WORDS, outcome.accuracy))


MAIN_RESULTS = (
    "fatigue_safety",
    "stability_safety",
    "yield_safety",
    "critical_force_n",
    "axial_force_min_n",
    "axial_force_max_n",
    "side_force_max_n",
    "clamp_moment_max_nmm",
    "contact_pressure_max_mpa",
    "friction_power_w",
    "natural_frequency_hz",
    "mass_g",
)
"""Results judged by an accuracy study. Not the location of the worst section, which a flat maximum leaves uncertain by
the square root of its error, nor the mean stress, which may be zero."""

GIVEN_RESULTS = ("stress_amplitude_mpa",)
"""Where fatigue limits a design, two sections often govern equally, each with its own amplitude: rounding decides which
of the two is reported."""


def figure(_mode: Mode, result: Mapping[str, Any]) -> tuple[str, float | None]:
    """The objective of a design, the mass of a check."""
    name = _FIGURES[result.get("objective", "mass")]
    return name, result[name]


FLEXIBLE_ROD = Kind(
    slug="flexible-rod",
    title="Flexible rod",
    summary="the strip rod of a crank-slider machine: width, thickness and free length",
    jobs={
        Mode.DESIGN: Job(DesignRequest, DesignResult, run_design, reference=design_reference, best_in_time=True),
        Mode.CHECK: Job(CheckRequest, RodResult, run_check, reference=check_reference, run_many=run_checks),
    },
    known_effects=rod.EFFECTS,
    plots={
        "stability-map": stability_map,
        "forces-over-angle": forces_over_angle,
        "stresses-over-angle": stresses_over_angle,
        "stress-along-strip": stress_along_strip,
        "feasible-region": feasible_region,
    },
    drawn_if={
        "forces-over-angle": has_stresses,
        "stresses-over-angle": has_stresses,
        "stress-along-strip": has_stresses,
        "feasible-region": is_design,
    },
    main_results=MAIN_RESULTS,
    given_results=GIVEN_RESULTS,
    figure=figure,
    form=FORM,
    drawing=drawing,
    calculation=calculation,
    followed=frozenset(FOLLOWED),
    part=part,
    part_if=lambda result: "dimensions" in result,
    labels=labels(WORDS),
    denials=denials(WORDS),
)
