"""Results of linkage checks, in millimetres, degrees and newtons."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from pydantic import Field

from app.designs.impact_linkage.request import LinkageRequest
from app.designs.schema import Strict, scaled
from app.designs.units import MILLI
from solvers import linkage
from solvers.linkage.mechanism.closure import Window
from solvers.linkage.mechanism.lengths import Mechanism

SQUARE_MILLI = MILLI**2


class Lengths(Strict):
    base: float
    crank: float
    coupler: float
    rocker: float


class Ratios(Strict):
    """Link lengths relative to the crank."""

    lambda0: float
    lambda2: float
    lambda3: float


class SweptBox(Strict):
    """The smallest box around the swept area of links and joints; ``angle_deg`` from the base line to its width."""

    width: float
    height: float
    angle_deg: float


class Sample(Strict):
    phi_deg: float
    u31: float


class ClosureResult(Strict):
    """Closure of the lengths; the surplus is 0 for a change-point mechanism."""

    surplus_mm: float
    relative: float = Field(description="closure surplus relative to the longest link")
    closes: bool


class WindowResult(Strict):
    """Effect of a closure error on the blow."""

    angle_deg: float = Field(description="half-width of the range of crank angles concerned")
    blocked: bool = Field(description="true: the crank cannot enter; false: the rocker turns back early")
    short_stop_deg: float


class LinkageResult(Strict):
    """Results of a linkage; null if a result does not exist (no blow, effect not computed, missing input)."""

    type: str
    lengths_mm: Lengths | None
    ratios: Ratios
    closure: ClosureResult
    rotatable: bool
    confined_deg: float | None = Field(
        description="a crank that cannot make a full turn stays within ± this angle of the blow"
    )
    u31_start: float | None = Field(description="magnitude of the transfer function just after the blow")
    u31_end: float | None = Field(description="magnitude of the transfer function just before the blow")
    u31_max: float | None = Field(description="maximum magnitude of the transfer function over the cycle")
    kinematic_restitution: float | None
    restitution_mismatch: float | None = Field(description="maximum |R - R_k| over the requested range")
    rocker_swing_deg: float | None
    transmission_angle_deg: float | None = Field(
        description="transmission angle between coupler and rocker in mid-cycle"
    )
    blow_frequency_hz: float | None
    impact_speed_m_s: float | None
    longest_link_mm: float | None
    box_mm: SweptBox | None
    box_area_mm2: float | None
    enclosing_radius_mm: float | None
    peak_torque_nm: float | None = Field(description="maximum torque at the crank, from the rocker's inertia alone")
    peak_torque_at_deg: float | None
    pin_force_n: float | None = Field(description="maximum force along the coupler, from the rocker's inertia alone")
    pin_force_at_deg: float | None
    coupler_peak_n: float | None = Field(
        description="maximum force after a blow with mismatched restitution, from the coupler's elasticity"
    )
    window: WindowResult | None = Field(description="effect of the closure error on the blow; null: the lengths close")
    restitution_error: float | None = Field(
        description="relative error of the restitution if the lengths are off by their tolerance"
    )
    tolerance_window: WindowResult | None
    running_frequency_hz: float | None = Field(description="blows per second in steady state; needs the drive")
    running_speed_m_s: float | None
    irregularity: float | None = Field(
        description="coefficient of speed fluctuation of the crank, (maximum - minimum)/mean speed"
    )
    crank_speed_jump: float | None = Field(description="relative jump of the crank's speed at the blow")
    motor_power_w: float | None
    transfer: list[Sample]
    warnings: list[str]


def _degrees(angle: float | None) -> float | None:
    return None if angle is None else math.degrees(angle)


def lengths_json(mechanism: Mechanism) -> dict[str, float]:
    base, crank, coupler, rocker = mechanism.links
    return {"base": base / MILLI, "crank": crank / MILLI, "coupler": coupler / MILLI, "rocker": rocker / MILLI}


def ratios_json(mechanism: Mechanism) -> dict[str, float]:
    r = mechanism.bar.ratios
    return {"lambda0": float(r.base), "lambda2": float(r.coupler), "lambda3": float(r.rocker)}


def _window(found: Window | None) -> dict[str, Any] | None:
    return found and {
        "angle_deg": math.degrees(found.angle),
        "blocked": found.blocked,
        "short_stop_deg": math.degrees(found.short_stop),
    }


_STRIKE = (
    "u31_start", "u31_end", "kinematic_restitution", "restitution_mismatch", "u31_max", "transmission_angle_deg",
)  # fmt: skip


def _strike(check: linkage.LinkageCheck) -> dict[str, Any]:
    bar, strike = check.mechanism.bar, check.strike
    if strike is None:
        return dict.fromkeys(_STRIKE)
    return {
        "u31_start": bar.u31_start,
        "u31_end": bar.u31_end,
        "kinematic_restitution": bar.restitution,
        "restitution_mismatch": strike.mismatch,
        "u31_max": strike.peaks and strike.peaks.u31,
        "transmission_angle_deg": math.degrees(bar.middle_transmission_angle),
    }


def transfer_json(check: linkage.LinkageCheck) -> list[dict[str, float]]:
    """u31 over the cycle; empty if there is no blow."""
    if check.strike is None:
        return []
    shown = np.degrees(check.angles).tolist()
    return [{"phi_deg": p, "u31": u} for p, u in zip(shown, check.transfer.tolist(), strict=True)]


def result_of(
    check: linkage.LinkageCheck, scene: linkage.Scene, request: LinkageRequest, sized: bool = True
) -> dict[str, Any]:
    """A check as JSON; results that the request leaves undetermined are null."""
    mechanism, strike, running = check.mechanism, check.strike, check.running
    peaks = (strike and request.impact_energy_j is not None and strike.peaks) or None
    box = check.box if sized else None
    return {
        "type": mechanism.bar.kind.name,
        "lengths_mm": lengths_json(mechanism) if sized else None,
        "ratios": ratios_json(mechanism),
        "closure": {
            "surplus_mm": mechanism.closure.surplus * mechanism.crank / MILLI if sized else 0.0,
            "relative": mechanism.closure.relative,
            "closes": mechanism.closure.closes,
        },
        "rotatable": mechanism.rotatable,
        "confined_deg": _degrees(mechanism.confined),
        **_strike(check),
        "rocker_swing_deg": math.degrees(mechanism.bar.swing) if strike and mechanism.rotatable else None,
        "blow_frequency_hz": scene.blow_frequency if request.timed else None,
        "impact_speed_m_s": strike.impact_speed if strike and request.timed and sized else None,
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
