"""The piston pin and the bushing at the edge: the calls into the solver, and the kind as the service knows it."""

from __future__ import annotations

from typing import Any

from app.designs.claims import Claim, of_pin
from app.designs.kind import Answer, Job, Kind, Mode
from app.designs.pin_profile.pictures import bore_picture, forces_picture, load_family, stress_picture
from app.designs.pin_profile.reference import check_reference, design_reference
from app.designs.pin_profile.request import CheckRequest, DesignRequest
from app.designs.pin_profile.result import (
    DesignResult,
    InfeasibleResult,
    PinResult,
    bushing_json,
    design_json,
    infeasible_json,
    pin_json,
)
from app.designs.schema import MILLI, envelope, refusal_problem
from solvers import pin
from solvers.errors import InvalidInput
from solvers.outcome import Outcome
from solvers.pin import bushing


def run_check(request: CheckRequest) -> Answer:
    """Evaluate the pin or the bushing."""
    how = (
        pin.CRITERIA[request.criterion], request.limits.to_solver(), request.selection(), request.effect_tolerance,
        request.accuracy,
    )  # fmt: skip
    try:
        if request.seeks_outside:
            outcome = bushing.check(request.bushing(), request.outside(), *how)
            return envelope(outcome, bushing_json(outcome.value))
        scene = request.scene()
        outcome = pin.check(scene, request.bore(), *how)
    except InvalidInput as refusal:
        return Answer("refused", None, [], None, {}, refusal_problem(request, refusal))
    return envelope(outcome, pin_json(outcome.value, scene.geometry.outer_diameter))


def run_design(request: DesignRequest) -> Answer:
    """Find the pin or the bushing."""
    try:
        return _design_bushing(request) if request.seeks_outside else _design_pin(request)
    except InvalidInput as refusal:
        return Answer("refused", None, [], None, {}, refusal_problem(request, refusal))


def _design_pin(request: DesignRequest) -> Answer:
    problem = request.problem()
    outcome = pin.design(problem, request.selection(), request.effect_tolerance, request.accuracy)
    found, outer = outcome.value, problem.scene.geometry.outer_diameter
    if found is None:
        why = pin.explain(problem, request.selection(), request.effect_tolerance)
        return envelope(outcome, infeasible_json(outcome, why, _claim(request, outcome)))
    corners = found.corners and [
        {"x_mm": x / MILLI, "bore_mm": bore / MILLI, "outer_diameter_mm": outer / MILLI} for x, bore in found.corners
    ]
    return envelope(outcome, design_json(outcome, pin_json(found.check, outer), corners, _claim(request, outcome)))


def _design_bushing(request: DesignRequest) -> Answer:
    problem = request.bushing_problem()
    outcome = bushing.design(problem, request.selection(), request.effect_tolerance, request.accuracy)
    found, bore = outcome.value, problem.scene.geometry.bore
    if found is None:
        return envelope(outcome, infeasible_json(outcome, None, _claim(request, outcome)))
    corners = found.corners and [
        {"x_mm": x / MILLI, "bore_mm": bore / MILLI, "outer_diameter_mm": outer / MILLI} for x, outer in found.corners
    ]
    return envelope(outcome, design_json(outcome, bushing_json(found.check), corners, _claim(request, outcome)))


def _claim(request: DesignRequest, outcome: Outcome[Any]) -> Claim:
    """What the certificate says."""
    limits = request.limits
    deflection, oval = limits.max_deflection_um is not None, limits.max_ovalization_um is not None
    return of_pin(outcome, request.form.kind, request.seeks_outside, deflection, oval)


MAIN_RESULTS = (
    "mass_g", "solid_mass_g", "constant_bore_mass_g", "max_moment_nmm", "force_limit_n", "deflection_um",
    "contact_pressures_mpa.small_end", "contact_pressures_mpa.boss_peak",
)  # fmt: skip
"""What an accuracy study judges. Not the bore itself: where the mass is flat in it, it is uncertain by the square root
of the mass's own error."""

GIVEN_RESULTS = ("ovalization_um", "ring_stresses_mpa.inner_side", "ring_stresses_mpa.outer_top")
"""They follow the bore in the middle."""

PIN_PROFILE = Kind(
    slug="pin-profile",
    title="Piston pin",
    summary="the lightest bore of a piston pin: free, drillable, stepped, conical",
    jobs={
        Mode.DESIGN: Job(
            DesignRequest, DesignResult, run_design, reference=design_reference, infeasible=InfeasibleResult
        ),
        Mode.CHECK: Job(CheckRequest, PinResult, run_check, reference=check_reference),
    },
    known_effects=pin.EFFECTS,
    plots={
        "bore": bore_picture,
        "forces": forces_picture,
        "stress": stress_picture,
        "load-family": load_family,
    },
    main_results=MAIN_RESULTS,
    given_results=GIVEN_RESULTS,
)
