"""The kind pin-profile: calls into the solver and the kind's definition."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

from app.designs.claims import Claim, of_pin
from app.designs.kind import Answer, Detail, Job, Kind, Mode
from app.designs.pin_profile.chain import FOLLOWED, calculation
from app.designs.pin_profile.drawing import drawing
from app.designs.pin_profile.form import FORM
from app.designs.pin_profile.part import has_wall, part
from app.designs.pin_profile.pictures import (
    bore_picture,
    forces_picture,
    has_ring,
    load_family,
    ring_picture,
    stress_picture,
)
from app.designs.pin_profile.reference import check_reference, design_reference
from app.designs.pin_profile.request import CheckRequest, DesignRequest
from app.designs.pin_profile.result import (
    DesignResult,
    InfeasibleResult,
    PinResult,
    design_json,
    infeasible_json,
    pin_json,
    profile_json,
)
from app.designs.pin_profile.verdict import WORDS
from app.designs.schema import bulk_answers, envelope, refusing
from app.designs.units import MILLI
from app.designs.verdict import denials, labels, verdict_json
from solvers import pin
from solvers.outcome import Outcome


def case_of(request: CheckRequest) -> pin.Case:
    """The solver's case. Raises InvalidInput for input only the solver can reject."""
    return pin.Case(
        request.scene(), request.given(), pin.CRITERIA[request.criterion], request.limits.to_solver(),
        request.selection(), request.effect_tolerance, request.accuracy,
    )  # fmt: skip


@refusing
def run_check(request: CheckRequest) -> Answer:
    """Check a pin or bushing."""
    case = case_of(request)
    return _answer(request, case, case.evaluate())


def run_checks(requests: Sequence[CheckRequest], detail: Detail) -> Iterator[Answer]:
    """Check pins and bushings in bulk."""
    return bulk_answers(requests, case_of, pin.check_many, partial(_answer, detail=detail))


def _answer(
    request: CheckRequest, case: pin.Case, outcome: Outcome[pin.PinCheck], detail: Detail = Detail.FULL
) -> Answer:
    verdict = pin.judge(outcome.value, case.scene, outcome.accuracy, case.limits, outcome.effects)
    result = pin_json(outcome.value)
    if detail is Detail.FULL:
        result |= profile_json(outcome.value)
    return envelope(request, outcome, result, verdict_json(verdict, WORDS, outcome.accuracy))


@refusing
def run_design(request: DesignRequest) -> Answer:
    """Design a pin or bushing."""
    problem = request.problem()
    outcome = pin.design(problem, request.selection(), request.effect_tolerance, request.accuracy)
    found = outcome.value
    if found is None:
        why = None
        if not request.seeks_outside:
            why = pin.explain(problem, request.selection(), request.effect_tolerance)
        return envelope(request, outcome, infeasible_json(outcome, why, _claim(request, outcome)))
    given = found.check.min_bore if request.seeks_outside else found.check.max_outer
    names = ("outer_diameter_mm", "bore_mm") if request.seeks_outside else ("bore_mm", "outer_diameter_mm")
    corners = found.corners and [
        {"x_mm": x / MILLI, **dict(zip(names, (size / MILLI, given / MILLI), strict=True))} for x, size in found.corners
    ]
    verdict = pin.judge(found.check, problem.scene, outcome.accuracy, problem.limits, outcome.effects, designed=True)
    result = design_json(
        outcome, {**pin_json(found.check), **profile_json(found.check)}, corners, _claim(request, outcome)
    )
    return envelope(request, outcome, result, verdict_json(verdict, WORDS, outcome.accuracy))


def _claim(request: DesignRequest, outcome: Outcome[Any]) -> Claim:
    """The certificate's claim."""
    limited = [name for name, limit in request.limits if limit is not None]
    return of_pin(outcome, request.form.kind, request.seeks_outside, limited)


MAIN_RESULTS = (
    "mass_g", "solid_mass_g", "constant_bore_mass_g", "max_moment_nmm", "force_limit_n", "deflection_um",
    "contact_pressures_mpa.small_end", "contact_pressures_mpa.boss_peak",
)  # fmt: skip
"""Results judged by an accuracy study. Not the bore itself: where the mass is flat in it, it is uncertain by the square
root of the mass's error."""

TABLES = ("profile",)
"""Results that batches omit."""

GIVEN_RESULTS = ("ovalization_um", "ring_stresses_mpa.inner_side", "ring_stresses_mpa.outer_top")
"""Results determined by the bore in the middle."""


PIN_PROFILE = Kind(
    slug="pin-profile",
    title="Piston pin",
    titles={("variable", "outer"): "Bushing"},
    summary="the lightest bore of a piston pin: free, drillable, stepped, conical",
    jobs={
        Mode.DESIGN: Job(
            DesignRequest,
            DesignResult,
            run_design,
            reference=design_reference,
            infeasible=InfeasibleResult,
            tables=TABLES,
        ),
        Mode.CHECK: Job(
            CheckRequest, PinResult, run_check, reference=check_reference, run_many=run_checks, tables=TABLES
        ),
    },
    known_effects=pin.EFFECTS,
    plots={
        "bore": bore_picture,
        "forces": forces_picture,
        "stress": stress_picture,
        "ring": ring_picture,
        "load-family": load_family,
    },
    drawn_if={"ring": has_ring},
    main_results=MAIN_RESULTS,
    given_results=GIVEN_RESULTS,
    figure=lambda _mode, result: ("mass_g", result["mass_g"]),
    form=FORM,
    drawing=drawing,
    calculation=calculation,
    followed=frozenset(FOLLOWED),
    part=part,
    part_if=has_wall,
    labels=labels(WORDS),
    denials=denials(WORDS),
)
