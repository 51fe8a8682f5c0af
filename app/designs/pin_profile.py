"""The piston pin at the edge: its results in millimetres, grams and megapascals, and the calls into the solver."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

import numpy as np
from pydantic import Field

from app.designs.kind import Answer, Job, Kind, Mode
from app.designs.pin_pictures import bore_picture, forces_picture, load_family, stress_picture
from app.designs.pin_profile_request import MICRO, CheckRequest, DesignRequest
from app.designs.schema import (
    MEGA,
    MILLI,
    CertificateResult,
    ShortfallResult,
    Strict,
    certificate_json,
    diagnosis_json,
    envelope,
    refusal_problem,
    scaled,
)
from solvers import pin
from solvers.errors import InvalidInput


class Section(Strict):
    """The pin at one place."""

    x_mm: float
    bore_mm: float
    moment_nmm: float
    shear_n: float
    equivalent_stress_mpa: float | None = Field(description="null: a load where there is no wall")


class RingStressesResult(Strict):
    """Hoop stresses in the middle of the pin: at the side and under the load, outside and inside."""

    outer_side: float
    inner_side: float
    outer_top: float
    inner_top: float


class PressuresResult(Strict):
    small_end: float
    boss_mean: float
    boss_peak: float


class PinResult(Strict):
    """What a pin does under its load; null where a result does not exist (an effect that did not run, no wall)."""

    mass_g: float
    solid_mass_g: float
    constant_bore_mass_g: float | None = Field(description="the best constant bore under the same limits")
    min_bore_mm: float
    bore_mid_mm: float
    max_moment_nmm: float
    max_shear_n: float
    equivalent_stress_max_mpa: float | None
    worst_section_mm: float
    shear_stress_max_mpa: float | None = Field(description="null without an allowable shear")
    strength_utilisation: float | None
    deflection_um: float | None
    ovalization_um: float | None = Field(description="in the middle of the pin")
    ovalization_max_um: float | None = Field(description="where the bore is widest; null where the wall runs out")
    ovalization_stress_max_mpa: float | None
    ring_model: str | None
    ring_stresses_mpa: RingStressesResult | None
    contact_pressures_mpa: PressuresResult | None
    force_limit_n: float = Field(description="the greatest force that a solid pin carries")
    profile: list[Section]
    warnings: list[str]


def result_of(check: pin.PinCheck) -> dict[str, Any]:
    """A check in the names and units of the contract."""
    along, ring, pressures = check.along, check.ring, check.pressures
    rows = zip(along.x, along.bore, along.moment, along.shear, along.equivalent, strict=True)
    return {
        "mass_g": check.mass / MILLI,
        "solid_mass_g": check.solid_mass / MILLI,
        "constant_bore_mass_g": scaled(check.constant_bore_mass, MILLI),
        "min_bore_mm": check.min_bore / MILLI,
        "bore_mid_mm": check.bore_mid / MILLI,
        "max_moment_nmm": check.max_moment / MILLI,
        "max_shear_n": check.max_shear,
        "equivalent_stress_max_mpa": scaled(check.equivalent_stress_max, MEGA),
        "worst_section_mm": check.worst_section / MILLI,
        "shear_stress_max_mpa": scaled(check.shear_stress_max, MEGA),
        "strength_utilisation": check.strength_utilisation,
        "deflection_um": scaled(check.deflection, MICRO),
        "ovalization_um": ring and ring.ovalization / MICRO,
        "ovalization_max_um": ring and scaled(ring.ovalization_max, MICRO),
        "ovalization_stress_max_mpa": ring and scaled(ring.stress_max, MEGA),
        "ring_model": ring and ring.model,
        "ring_stresses_mpa": ring
        and {
            name: getattr(ring.stresses, name) / MEGA for name in ("outer_side", "inner_side", "outer_top", "inner_top")
        },
        "contact_pressures_mpa": pressures
        and {name: getattr(pressures, name) / MEGA for name in ("small_end", "boss_mean", "boss_peak")},
        "force_limit_n": check.force_limit,
        "profile": [
            {
                "x_mm": float(x) / MILLI,
                "bore_mm": float(bore) / MILLI,
                "moment_nmm": float(moment) / MILLI,
                "shear_n": float(shear),
                "equivalent_stress_mpa": float(stress) / MEGA if np.isfinite(stress) else None,
            }
            for x, bore, moment, shear, stress in rows
        ],
        "warnings": list(check.warnings),
    }


def run_check(request: CheckRequest) -> Answer:
    """Evaluate the pin."""
    try:
        outcome = pin.check(
            request.scene(),
            request.bore(),
            pin.CRITERIA[request.criterion],
            request.limits.to_solver(),
            request.selection(),
            request.effect_tolerance,
            request.accuracy,
        )
    except InvalidInput as refusal:
        return Answer("refused", None, [], None, {}, refusal_problem(request, refusal))
    return envelope(outcome, result_of(outcome.value))


class PinCertificate(CertificateResult):
    """How a pin is known to be the lightest of its form."""

    lower_bound_g: float = Field(description="no pin of this form that keeps the limits is lighter")


class Corner(Strict):
    x_mm: float
    bore_mm: float


class DesignResult(PinResult):
    """The pin found, what other forms weigh beside it, and how it is known to be the lightest."""

    form: str
    free_mass_g: float = Field(description="the lightest bore of any form under the same limits, but for the slope")
    corners: list[Corner] | None = Field(description="where the bore is made of straight lines: its points")
    certificate: PinCertificate | None


class InfeasibleResult(Strict):
    """Why no pin of this outer diameter will do, and what would."""

    diagnosis: list[ShortfallResult]
    force_limit_n: float
    infeasible_from_mm: float | None
    infeasible_to_mm: float | None
    least_outer_diameter_mm: float | None = Field(description="all else equal; null where no diameter helps")
    certificate: CertificateResult | None = None


_LIMITS = {
    "force": ("force_n", 1.0),
    "max_deflection": ("max_deflection_um", MICRO),
    "max_ovalization": ("max_ovalization_um", MICRO),
}
"""Requirements whose name in the contract carries a unit."""


def run_design(request: DesignRequest) -> Answer:
    """Find the pin."""
    try:
        problem = request.problem()
        outcome = pin.design(problem, request.selection(), request.effect_tolerance, request.accuracy)
        why = pin.explain(problem, request.selection(), request.effect_tolerance) if outcome.value is None else None
    except InvalidInput as refusal:
        return Answer("refused", None, [], None, {}, refusal_problem(request, refusal))
    found = outcome.value
    if found is None:
        return envelope(outcome, _infeasible(outcome, why))
    certificate = certificate_json(outcome.certificate, MILLI)
    corners = found.corners and [{"x_mm": x / MILLI, "bore_mm": bore / MILLI} for x, bore in found.corners]
    result = {
        **result_of(found.check),
        "form": found.form,
        "free_mass_g": found.free_mass / MILLI,
        "corners": corners,
        "certificate": certificate and {**certificate, "lower_bound_g": certificate["bound"]},
    }
    return envelope(outcome, result)


def _infeasible(outcome: Any, why: pin.Diagnosis) -> dict[str, Any]:
    return {
        "diagnosis": diagnosis_json(outcome, _LIMITS),
        "force_limit_n": why.force_limit,
        "infeasible_from_mm": why.weak and why.weak.begin / MILLI,
        "infeasible_to_mm": why.weak and why.weak.end / MILLI,
        "least_outer_diameter_mm": why.least_outer_diameter / MILLI or None,
        "certificate": None,
    }


def effects() -> list[dict[str, Any]]:
    """The effects a pin's scene can call for."""
    return [{"name": e.name, "summary": e.summary, "measure": e.measure} for e in pin.EFFECTS]


def example(mode: Mode) -> dict[str, Any]:
    """The paper's pin as a request of the given mode."""
    return json.loads((files("app.designs") / "examples" / f"pin-profile-{mode}.json").read_text("utf-8"))


MAIN_RESULTS = (
    "mass_g", "solid_mass_g", "constant_bore_mass_g", "max_moment_nmm", "force_limit_n", "deflection_um",
)  # fmt: skip
"""What an accuracy study judges. Not the bore itself: where the mass is flat in it, it is uncertain by the square root
of the mass's own error."""

PIN_PROFILE = Kind(
    slug="pin-profile",
    title="Piston pin",
    summary="the lightest bore of a piston pin: free, drillable, stepped, conical",
    jobs={
        Mode.DESIGN: Job(DesignRequest, DesignResult, run_design),
        Mode.CHECK: Job(CheckRequest, PinResult, run_check),
    },
    effects=effects,
    example=example,
    plots={
        "bore": bore_picture,
        "forces": forces_picture,
        "stress": stress_picture,
        "load-family": load_family,
    },
    main_results=MAIN_RESULTS,
)
