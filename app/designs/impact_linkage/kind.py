"""The kind impact-linkage: result models in millimetres, degrees and newtons, and calls into the solver."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from pydantic import Field

from app.designs.claims import of_linkage, with_claim
from app.designs.impact_linkage.chain import FOLLOWED, calculation
from app.designs.impact_linkage.drawing import drawing
from app.designs.impact_linkage.form import FORM
from app.designs.impact_linkage.mechanism_picture import has_size, mechanism_picture
from app.designs.impact_linkage.part import part
from app.designs.impact_linkage.pictures import (
    front_picture,
    has_front,
    has_loads,
    has_transfer,
    loads_picture,
    transfer_picture,
)
from app.designs.impact_linkage.reference import check_reference, design_reference
from app.designs.impact_linkage.request import CheckRequest, DesignRequest
from app.designs.impact_linkage.result import (
    SQUARE_MILLI,
    Lengths,
    LinkageResult,
    Ratios,
    lengths_json,
    ratios_json,
    result_of,
    transfer_json,
)
from app.designs.impact_linkage.verdict import WORDS
from app.designs.kind import Answer, Detail, Job, Kind, Mode
from app.designs.progress import Counter, Report, ignore_progress
from app.designs.schema import (
    CertificateResult,
    Strict,
    bulk_answers,
    certificate_json,
    diagnosis_json,
    envelope,
    refusing,
    scaled,
)
from app.designs.units import MILLI, by_solver_name, in_si, split_unit
from app.designs.verdict import denials, labels, verdict_json
from solvers import linkage
from solvers.outcome import Outcome


def case_of(request: CheckRequest) -> linkage.Case:
    """The solver's case. Raises InvalidInput for input only the solver can reject."""
    scene, mechanism = request.mechanism()
    limits = request.limits.to_solver()
    demands = linkage.demands_of(limits)
    return linkage.Case(
        scene, mechanism, limits, request.selection(), request.effect_tolerance, request.accuracy, demands
    )


@refusing
def run_check(request: CheckRequest) -> Answer:
    """Check a linkage."""
    case = case_of(request)
    return _answer(request, case, case.evaluate())


def run_checks(requests: Sequence[CheckRequest], detail: Detail) -> Iterator[Answer]:
    """Check linkages in bulk."""
    return bulk_answers(requests, case_of, linkage.check_many, partial(_answer, detail=detail))


def _answer(
    request: CheckRequest, case: linkage.Case, outcome: Outcome[linkage.LinkageCheck], detail: Detail = Detail.FULL
) -> Answer:
    given = request.given()
    verdict = linkage.judge(outcome.value, case.scene, outcome.accuracy, case.limits, given)
    result = result_of(outcome.value, case.scene, request, given.size)
    if detail is Detail.FULL:
        result["transfer"] = transfer_json(outcome.value)
    return envelope(request, outcome, result, verdict_json(verdict, WORDS, outcome.accuracy))


class AlternativeResult(Strict):
    """The best linkage of a type, or why there is none."""

    type: str
    value: float | None = Field(description="value of the objective, in the unit of the certificate")
    lengths_mm: Lengths | None
    ratios: Ratios | None
    reason: str


class FrontPointResult(Strict):
    """A linkage on the front: no other is better in both quantities, up to the gap."""

    objective: float
    against: float
    gap: float
    type: str
    lengths_mm: Lengths
    box_area_mm2: float
    longest_link_mm: float
    enclosing_radius_mm: float
    peak_torque_nm: float | None
    pin_force_n: float | None


class FrontResult(Strict):
    """Trade-off of the objective against another quantity, in increasing order of that quantity."""

    objective: str
    objective_unit: str
    against: str
    against_unit: str
    points: list[FrontPointResult]


class DesignResult(LinkageResult):
    """The optimal linkage, its active limits, the best of every allowed type, and the certificate."""

    objective: str
    value: float
    value_unit: str
    active_limits: list[str]
    alternatives: list[AlternativeResult]
    front: FrontResult | None
    certificate: CertificateResult | None


_FIGURES = {
    "box_area": "box_area_mm2",
    "longest_link": "longest_link_mm",
    "enclosing_radius": "enclosing_radius_mm",
    "peak_torque": "peak_torque_nm",
    "pin_force": "pin_force_n",
    "impact_speed": "impact_speed_m_s",
    "blow_frequency": "blow_frequency_hz",
}
"""Result names of the objectives."""

_LIMITS = by_solver_name(
    "min_link_mm", "longest_link_mm", "enclosing_radius_mm", "width_mm", "height_mm", "max_pin_force_n",
    "impact_speed_m_s",
)  # fmt: skip
"""API names of requirements with a unit suffix."""


def _unit(objective: str) -> tuple[str, float]:
    """The unit of an objective in the API, and in SI."""
    name = _FIGURES[objective]
    return split_unit(name)[1], in_si(name)[1]


@refusing
def run_design(request: DesignRequest, report: Report = ignore_progress) -> Answer:
    """Design a linkage, with the Pareto front if requested, and report its progress: every point of a front is a design
    of its own."""
    problem = request.problem()
    outcome = linkage.design(problem, request.selection(), request.effect_tolerance, request.accuracy)
    traded = _traded(request, problem, report) if outcome.value is not None else ()
    words, unit = _unit(request.objective)
    claim = of_linkage(outcome, request.objective, problem.objective.sign, request.types)
    certificate = with_claim(certificate_json(outcome.certificate, unit), claim)
    found = outcome.value
    if found is None:
        diagnosis = diagnosis_json(outcome, _LIMITS)
        return envelope(request, outcome, {"diagnosis": diagnosis, "warnings": [], "certificate": certificate})
    result = {
        **result_of(found.check, found.scene, request),
        "transfer": transfer_json(found.check),
        "objective": request.objective,
        "value": found.value / unit,
        "value_unit": words,
        "active_limits": [_LIMITS.get(name, name) for name in found.active_limits],
        "alternatives": [
            {
                "type": other.kind.name,
                "value": scaled(other.value, unit),
                "lengths_mm": other.mechanism and lengths_json(other.mechanism),
                "ratios": other.mechanism and ratios_json(other.mechanism),
                "reason": other.reason,
            }
            for other in found.alternatives
        ],
        "front": _front(request, traded) if traded else None,
        "certificate": certificate,
    }
    verdict = linkage.judge(found.check, found.scene, outcome.accuracy, problem.limits, request.given(), designed=True)
    return envelope(request, outcome, result, verdict_json(verdict, WORDS, outcome.accuracy))


def _traded(request: DesignRequest, problem: linkage.LinkageProblem, report: Report) -> tuple[linkage.FrontPoint, ...]:
    if request.front.against == "none":
        return ()
    points = int(request.front.points)
    count = Counter(points, report)
    count.begin("the front, point by point")
    return linkage.front(problem, request.front.against, points, solved=count.increment)


def _front(request: DesignRequest, points: tuple[linkage.FrontPoint, ...]) -> dict[str, Any]:
    (words, unit), (other_words, other_unit) = _unit(request.objective), _unit(request.front.against)
    loaded = request.impact_energy_j is not None
    return {
        "objective": request.objective,
        "objective_unit": words,
        "against": request.front.against,
        "against_unit": other_words,
        "points": [
            {
                "objective": point.objective / unit,
                "against": point.against / other_unit,
                "gap": point.gap,
                "type": point.check.mechanism.bar.kind.name,
                "lengths_mm": lengths_json(point.check.mechanism),
                "box_area_mm2": point.check.box.area / SQUARE_MILLI,
                "longest_link_mm": point.check.mechanism.crank * point.check.mechanism.bar.longest / MILLI,
                "enclosing_radius_mm": point.check.enclosing_radius / MILLI,
                "peak_torque_nm": point.check.strike.peaks.torque if loaded else None,
                "pin_force_n": point.check.strike.peaks.force if loaded else None,
            }
            for point in points
        ],
    }


TABLES = ("transfer",)
"""Results that batches omit; not the front, each point of which is a design of its own."""

MAIN_RESULTS = (
    "u31_start",
    "u31_end",
    "u31_max",
    "kinematic_restitution",
    "transmission_angle_deg",
    "impact_speed_m_s",
    "longest_link_mm",
    "box_area_mm2",
    "enclosing_radius_mm",
    "peak_torque_nm",
    "pin_force_n",
    "running_frequency_hz",
    "running_speed_m_s",
    "irregularity",
    "motor_power_w",
)
"""Results judged by an accuracy study. Not the box's sides or angle, nor the angles of peaks: where area or load are
flat in them, they are uncertain by the square root of its error."""


def figure(mode: Mode, result: Mapping[str, Any]) -> tuple[str, float | None]:
    """The objective of a design, the longest link of a check if lengths are known."""
    if mode is Mode.DESIGN:
        return _FIGURES[result["objective"]], result["value"]
    return "longest_link_mm", result["longest_link_mm"]


IMPACT_LINKAGE = Kind(
    slug="impact-linkage",
    title="Impact linkage",
    summary="the crank-rocker that strikes once a turn: its type, its four lengths and how it lies in its box",
    jobs={
        Mode.DESIGN: Job(
            DesignRequest, DesignResult, run_design, reference=design_reference, in_steps=True, tables=TABLES
        ),
        Mode.CHECK: Job(
            CheckRequest, LinkageResult, run_check, reference=check_reference, run_many=run_checks, tables=TABLES
        ),
    },
    known_effects=linkage.EFFECTS,
    plots={
        "mechanism": mechanism_picture,
        "transfer": transfer_picture,
        "loads": loads_picture,
        "front": front_picture,
    },
    main_results=MAIN_RESULTS,
    drawn_if={"mechanism": has_size, "transfer": has_transfer, "loads": has_loads, "front": has_front},
    figure=figure,
    form=FORM,
    drawing=drawing,
    calculation=calculation,
    followed=frozenset(FOLLOWED),
    part=part,
    part_if=lambda result: bool(result.get("lengths_mm")),
    labels=labels(WORDS),
    denials=denials(WORDS),
)
