"""The impact linkage at the edge: its results in millimetres, degrees and newtons, and the calls into the solver."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import Field

from app.designs.claims import of_linkage, with_claim
from app.designs.impact_linkage.drawing import drawing
from app.designs.impact_linkage.form import FORM
from app.designs.impact_linkage.mechanism_picture import has_size, mechanism_picture
from app.designs.impact_linkage.pictures import (
    front_picture,
    has_front,
    has_loads,
    has_transfer,
    loads_picture,
    transfer_picture,
)
from app.designs.impact_linkage.reference import check_reference, design_reference
from app.designs.impact_linkage.request import CheckRequest, DesignRequest, LinkageRequest
from app.designs.impact_linkage.verdict import WORDS
from app.designs.kind import Answer, Job, Kind, Mode
from app.designs.progress import Count, Report, to_nobody
from app.designs.schema import (
    MILLI,
    CertificateResult,
    Strict,
    certificate_json,
    diagnosis_json,
    envelope,
    refusal_problem,
    scaled,
)
from app.designs.verdict import denials, verdict_json
from solvers import linkage
from solvers.errors import InvalidInput
from solvers.linkage.result import Mechanism, Strike
from solvers.linkage.tolerances import Window

SQUARE_MILLI = MILLI**2


class Lengths(Strict):
    base: float
    crank: float
    coupler: float
    rocker: float


class Ratios(Strict):
    """Links over crank."""

    lambda0: float
    lambda2: float
    lambda3: float


class SweptBox(Strict):
    """The least box around all that links and joints sweep; ``angle_deg`` from the base line to its width."""

    width: float
    height: float
    angle_deg: float


class Sample(Strict):
    phi_deg: float
    u31: float


class ClosureResult(Strict):
    """How well the lengths close; the surplus is 0 for a change-point mechanism."""

    surplus_mm: float
    relative: float = Field(description="surplus over the longest link")
    closes: bool


class WindowResult(Strict):
    """What a missed closure does about the blow."""

    angle_deg: float = Field(description="half width of the crank angles concerned")
    blocked: bool = Field(description="true: the crank cannot enter; false: the rocker turns back early")
    short_stop_deg: float


class LinkageResult(Strict):
    """What a linkage does; null where a result does not exist (it cannot strike, an effect or an input is missing)."""

    type: str
    lengths_mm: Lengths | None
    ratios: Ratios
    closure: ClosureResult
    rotatable: bool
    confined_deg: float | None = Field(description="a crank that cannot turn stays within ± this of the blow")
    u31_start: float | None = Field(description="magnitude, just after the blow")
    u31_end: float | None = Field(description="magnitude, just before it")
    u31_max: float | None = Field(description="greatest magnitude over the cycle")
    kinematic_restitution: float | None
    restitution_mismatch: float | None = Field(description="worst |R - R_k| over the range asked for")
    rocker_swing_deg: float | None
    transmission_angle_deg: float | None = Field(description="between coupler and rocker in mid-cycle")
    blow_frequency_hz: float | None
    impact_speed_m_s: float | None
    longest_link_mm: float | None
    box_mm: SweptBox | None
    box_area_mm2: float | None
    enclosing_radius_mm: float | None
    peak_torque_nm: float | None = Field(description="at the crank, from the rocker's inertia alone")
    peak_torque_at_deg: float | None
    pin_force_n: float | None = Field(description="peak along the coupler, likewise")
    pin_force_at_deg: float | None
    coupler_peak_n: float | None = Field(description="peak after a blow that mismatches, from the coupler's elasticity")
    window: WindowResult | None = Field(description="null: the lengths close")
    restitution_error: float | None = Field(description="relative, for lengths off by their tolerance")
    tolerance_window: WindowResult | None
    running_frequency_hz: float | None = Field(description="with the drive: blows per second in steady running")
    running_speed_m_s: float | None
    irregularity: float | None = Field(description="(greatest - least)/mean speed of the crank")
    crank_speed_jump: float | None = Field(description="relative, at the blow")
    motor_power_w: float | None
    transfer: list[Sample]
    warnings: list[str]


def _degrees(angle: float | None) -> float | None:
    return None if angle is None else math.degrees(angle)


def _lengths(mechanism: Mechanism) -> dict[str, float]:
    found = mechanism.lengths
    return {name: getattr(found, name) / MILLI for name in ("base", "crank", "coupler", "rocker")}


def _ratios(mechanism: Mechanism) -> dict[str, float]:
    r = mechanism.bar.ratios
    return {"lambda0": float(r.base), "lambda2": float(r.coupler), "lambda3": float(r.rocker)}


def _window(found: Window | None) -> dict[str, Any] | None:
    return found and {
        "angle_deg": math.degrees(found.angle),
        "blocked": found.blocked,
        "short_stop_deg": math.degrees(found.short_stop),
    }


def _strike(strike: Strike | None) -> dict[str, Any]:
    names = ("u31_start", "u31_end", "kinematic_restitution", "restitution_mismatch")
    if strike is None:
        return dict.fromkeys((*names, "u31_max", "transmission_angle_deg"), None) | {"transfer": []}
    shown = np.degrees(strike.angles).tolist()
    return {
        **dict(zip(names, (strike.start, strike.end, strike.restitution, strike.mismatch), strict=True)),
        "u31_max": strike.greatest if math.isfinite(strike.greatest) else None,
        "transmission_angle_deg": math.degrees(strike.transmission_angle),
        "transfer": [{"phi_deg": p, "u31": u} for p, u in zip(shown, strike.transfer.tolist(), strict=True)],
    }


def result_of(
    check: linkage.LinkageCheck, scene: linkage.Scene, request: LinkageRequest, sized: bool = True
) -> dict[str, Any]:
    """A check in the names and units of the contract; what the request leaves open is null."""
    mechanism, strike, running = check.mechanism, check.strike, check.running
    peaks = (strike and request.impact_energy_j is not None and strike.peaks) or None
    seeks = getattr(request, "objective", None)
    timed = request.blow_frequency_hz is not None or seeks == "blow_frequency"
    box = check.box if sized else None
    return {
        "type": mechanism.bar.kind.name,
        "lengths_mm": _lengths(mechanism) if sized else None,
        "ratios": _ratios(mechanism),
        "closure": {
            "surplus_mm": mechanism.closure.surplus * mechanism.crank / MILLI if sized else 0.0,
            "relative": mechanism.closure.relative,
            "closes": mechanism.closure.closes,
        },
        "rotatable": check.rotatable,
        "confined_deg": _degrees(check.confined),
        **_strike(strike),
        "rocker_swing_deg": math.degrees(mechanism.bar.swing) if strike and check.rotatable else None,
        "blow_frequency_hz": scene.blow_frequency if timed else None,
        "impact_speed_m_s": strike.impact_speed if strike and timed and sized else None,
        "longest_link_mm": mechanism.crank * mechanism.bar.longest / MILLI if sized else None,
        "box_mm": box
        and {"width": box.width / MILLI, "height": box.height / MILLI, "angle_deg": math.degrees(box.angle)},
        "box_area_mm2": box and box.area / SQUARE_MILLI,
        "enclosing_radius_mm": scaled(check.enclosing_radius, MILLI) if sized else None,
        "peak_torque_nm": peaks and peaks.torque,
        "peak_torque_at_deg": peaks and math.degrees(peaks.torque_angle),
        "pin_force_n": peaks.force if peaks and sized else None,
        "pin_force_at_deg": peaks and math.degrees(peaks.force_angle),
        "coupler_peak_n": check.coupler_peak,
        "window": _window(check.window),
        "restitution_error": check.restitution_error if sized else None,
        "tolerance_window": _window(check.tolerance_window) if sized else None,
        "running_frequency_hz": running and running.blow_frequency,
        "running_speed_m_s": running and running.impact_speed,
        "irregularity": running and running.irregularity,
        "crank_speed_jump": running and running.jump,
        "motor_power_w": running and running.power,
        "warnings": list(check.warnings),
    }


def run_check(request: CheckRequest) -> Answer:
    """Evaluate the linkage."""
    try:
        scene, mechanism = request.mechanism()
        limits = request.limits.to_solver()
        outcome = linkage.check(
            scene,
            mechanism,
            limits,
            request.selection(),
            request.effect_tolerance,
            request.accuracy,
            linkage.demands_of(limits),
        )
    except InvalidInput as refusal:
        return Answer("refused", None, [], None, {}, refusal_problem(request, refusal))
    verdict = linkage.judge(outcome.value, scene, outcome.accuracy, limits, request.given())
    result = result_of(outcome.value, scene, request, request.sized)
    return envelope(outcome, result, verdict_json(verdict, WORDS, outcome.accuracy))


class AlternativeResult(Strict):
    """The best linkage of a type, or why the type has none."""

    type: str
    value: float | None = Field(description="of the objective, in the unit of the certificate")
    lengths_mm: Lengths | None
    ratios: Ratios | None
    reason: str


class FrontPointResult(Strict):
    """A linkage of the front: none is better in both quantities, up to the gap."""

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
    """What the objective costs in another quantity, by rising values of that quantity."""

    objective: str
    objective_unit: str
    against: str
    against_unit: str
    points: list[FrontPointResult]


class DesignResult(LinkageResult):
    """The linkage found, the limits that shape it, the best of every allowed type, and how it is known to be best."""

    objective: str
    value: float
    value_unit: str
    active_limits: list[str]
    alternatives: list[AlternativeResult]
    front: FrontResult | None
    certificate: CertificateResult | None


_UNITS = {
    "box_area": ("mm²", SQUARE_MILLI),
    "longest_link": ("mm", MILLI),
    "enclosing_radius": ("mm", MILLI),
    "peak_torque": ("N·m", 1.0),
    "pin_force": ("N", 1.0),
    "impact_speed": ("m/s", 1.0),
    "blow_frequency": ("Hz", 1.0),
}
"""Objectives in the units of the contract."""

_LIMITS = {
    "min_link": ("min_link_mm", MILLI),
    "longest_link": ("longest_link_mm", MILLI),
    "enclosing_radius": ("enclosing_radius_mm", MILLI),
    "width": ("width_mm", MILLI),
    "height": ("height_mm", MILLI),
    "max_pin_force": ("max_pin_force_n", 1.0),
    "impact_speed": ("impact_speed_m_s", 1.0),
}
"""Requirements whose name in the contract carries a unit."""


def run_design(request: DesignRequest) -> Answer:
    """Find the linkage, and the front where one is asked for."""
    return design_in_steps(request, to_nobody)


def design_in_steps(request: DesignRequest, report: Report) -> Answer:
    """The same; a front, whose every point is a design of its own, tells how far it is."""
    try:
        problem = request.problem()
        outcome = linkage.design(problem, request.selection(), request.effect_tolerance, request.accuracy)
        traded = _traded(request, problem, report) if outcome.value is not None else ()
    except InvalidInput as refusal:
        return Answer("refused", None, [], None, {}, refusal_problem(request, refusal))
    words, unit = _UNITS[request.objective]
    claim = of_linkage(outcome, request.objective, problem.objective.sign, request.types)
    certificate = with_claim(certificate_json(outcome.certificate, unit), claim)
    found = outcome.value
    if found is None:
        return envelope(outcome, {"diagnosis": diagnosis_json(outcome, _LIMITS), "certificate": certificate})
    result = {
        **result_of(found.check, found.scene, request),
        "objective": found.objective,
        "value": found.value / unit,
        "value_unit": words,
        "active_limits": [_LIMITS.get(name, (name, 1.0))[0] for name in found.active_limits],
        "alternatives": [
            {
                "type": other.kind.name,
                "value": scaled(other.value, unit),
                "lengths_mm": other.mechanism and _lengths(other.mechanism),
                "ratios": other.mechanism and _ratios(other.mechanism),
                "reason": other.reason,
            }
            for other in found.alternatives
        ],
        "front": _front(request, traded) if traded else None,
        "certificate": certificate,
    }
    verdict = linkage.judge(found.check, found.scene, outcome.accuracy, problem.limits, request.given())
    return envelope(outcome, result, verdict_json(verdict, WORDS, outcome.accuracy))


def _traded(request: DesignRequest, problem: linkage.LinkageProblem, report: Report) -> tuple[linkage.FrontPoint, ...]:
    if request.front.against == "none":
        return ()
    points = int(request.front.points)
    count = Count(points, report)
    count.begin("the front, point by point")
    return linkage.front(problem, request.front.against, points, solved=count.one)


def _front(request: DesignRequest, points: tuple[linkage.FrontPoint, ...]) -> dict[str, Any]:
    (words, unit), (other_words, other_unit) = _UNITS[request.objective], _UNITS[request.front.against]
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
                "lengths_mm": _lengths(point.check.mechanism),
                "box_area_mm2": point.check.box.area / SQUARE_MILLI,
                "longest_link_mm": point.check.mechanism.crank * point.check.mechanism.bar.longest / MILLI,
                "enclosing_radius_mm": point.check.enclosing_radius / MILLI,
                "peak_torque_nm": point.check.strike.peaks.torque if loaded else None,
                "pin_force_n": point.check.strike.peaks.force if loaded else None,
            }
            for point in points
        ],
    }


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
"""What an accuracy study judges. Not the box's sides or angle, nor the angles of peaks: where the area or the load is
flat in them they are uncertain by the square root of its own error."""

_FIGURES = {
    "box_area": "box_area_mm2",
    "longest_link": "longest_link_mm",
    "enclosing_radius": "enclosing_radius_mm",
    "peak_torque": "peak_torque_nm",
    "pin_force": "pin_force_n",
    "impact_speed": "impact_speed_m_s",
    "blow_frequency": "blow_frequency_hz",
}


def figure(mode: Mode, result: Mapping[str, Any]) -> tuple[str, float | None]:
    """What a design was after; of a check the longest link, where lengths are known; of a study none."""
    if mode is Mode.DESIGN:
        return _FIGURES[result["objective"]], result["value"]
    return "longest_link_mm", result.get("longest_link_mm")


IMPACT_LINKAGE = Kind(
    slug="impact-linkage",
    title="Impact linkage",
    summary="the crank-rocker that strikes once a turn: its type, its four lengths and how it lies in its box",
    jobs={
        Mode.DESIGN: Job(
            DesignRequest,
            DesignResult,
            run_design,
            reference=design_reference,
            in_steps=design_in_steps,
            tables=("transfer", "front"),
        ),
        Mode.CHECK: Job(CheckRequest, LinkageResult, run_check, reference=check_reference, tables=("transfer",)),
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
    denials=denials(WORDS),
)
