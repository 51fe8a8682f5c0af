"""Results of pins and bushings, in millimetres, grams and megapascals."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from app.designs.claims import Claim, with_claim
from app.designs.schema import CertificateResult, ShortfallResult, Strict, certificate_json, diagnosis_json, scaled
from app.designs.units import MEGA, MICRO, MILLI, by_solver_name
from solvers import pin
from solvers.outcome import Outcome

Array = NDArray[np.float64]


class Section(Strict):
    """A cross-section of the pin."""

    x_mm: float
    bore_mm: float
    outer_diameter_mm: float
    moment_nmm: float
    shear_n: float
    equivalent_stress_mpa: float | None = Field(description="null: a loaded section has no wall")


class RingStressesResult(Strict):
    """Hoop stresses in the middle of the pin: at the side and under the load, at the outer and inner fibre."""

    outer_side: float
    inner_side: float
    outer_top: float
    inner_top: float


class PressuresResult(Strict):
    small_end: float
    boss_mean: float
    boss_peak: float


class PinResult(Strict):
    """Results of a pin; null if a result does not exist (effect not computed, no wall)."""

    mass_g: float
    solid_mass_g: float | None = Field(description="mass of the same pin without a bore; null for a bushing")
    constant_bore_mass_g: float | None = Field(
        description="the best pin of one bore (bushing: of one outer diameter) under the same limits"
    )
    min_bore_mm: float
    bore_mid_mm: float
    outer_max_mm: float
    outer_mid_mm: float
    least_wall_mm: float
    max_moment_nmm: float
    max_shear_n: float
    equivalent_stress_max_mpa: float | None
    worst_section_mm: float
    shear_stress_max_mpa: float | None = Field(description="null without an allowable shear")
    strength_utilisation: float | None
    deflection_um: float | None
    ovalization_um: float | None = Field(description="deflection in the middle of the pin")
    ovalization_max_um: float | None = Field(description="ovalization where the bore is widest; null: there is no wall")
    ovalization_stress_max_mpa: float | None = Field(
        description="maximum hoop stress of the ring, where the wall is thinnest; null: there is no wall"
    )
    ring_model: str | None
    ring_stresses_mpa: RingStressesResult | None
    contact_pressures_mpa: PressuresResult | None
    force_limit_n: float | None = Field(description="maximum force that a solid pin carries; null for a bushing")
    profile: list[Section]
    warnings: list[str]


def _sections(x: Array, bore: Array, outer: Array, moment: Array, shear: Array, stress: Array) -> list[dict[str, Any]]:
    return [
        {
            "x_mm": float(place) / MILLI,
            "bore_mm": float(d) / MILLI,
            "outer_diameter_mm": float(D) / MILLI,
            "moment_nmm": float(bent) / MILLI,
            "shear_n": float(sheared) + 0.0,  # never -0
            "equivalent_stress_mpa": float(equivalent) / MEGA if np.isfinite(equivalent) else None,
        }
        for place, d, D, bent, sheared, equivalent in zip(x, bore, outer, moment, shear, stress, strict=True)
    ]


def pin_json(check: pin.PinCheck) -> dict[str, Any]:
    """A check as JSON, without its profile."""
    ring, pressures = check.ring, check.pressures
    sides = ("outer_side", "inner_side", "outer_top", "inner_top")
    return {
        "mass_g": check.mass / MILLI,
        "solid_mass_g": scaled(check.solid_mass, MILLI),
        "constant_bore_mass_g": scaled(check.constant_mass, MILLI),
        "min_bore_mm": check.min_bore / MILLI,
        "bore_mid_mm": check.bore_mid / MILLI,
        "outer_max_mm": check.max_outer / MILLI,
        "outer_mid_mm": check.outer_mid / MILLI,
        "least_wall_mm": check.least_wall / MILLI,
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
        "ring_stresses_mpa": ring and {name: getattr(ring.stresses, name) / MEGA for name in sides},
        "contact_pressures_mpa": pressures
        and {name: getattr(pressures, name) / MEGA for name in ("small_end", "boss_mean", "boss_peak")},
        "force_limit_n": check.force_limit,
        "warnings": list(check.warnings),
    }


def profile_json(check: pin.PinCheck) -> dict[str, Any]:
    """The profile, which batches omit."""
    along = check.along
    return {"profile": _sections(along.x, along.bore, along.outer, along.moment, along.shear, along.equivalent)}


class PinCertificate(CertificateResult):
    """Certificate of a pin's optimality within its form."""

    lower_bound_g: float = Field(
        description="lower bound on the mass of all shapes of this family that satisfy the limits"
    )


class Corner(Strict):
    x_mm: float
    bore_mm: float
    outer_diameter_mm: float


class Piece(Strict):
    """A diameter over an interval: the cubic polynomial with these end values and slopes."""

    x_from_mm: float
    x_to_mm: float
    diameter_from_mm: float
    diameter_to_mm: float
    slope_from: float = Field(description="change of the diameter per unit length")
    slope_to: float


class DesignResult(PinResult):
    """The optimal pin, the masses of other forms, and the certificate."""

    form: str
    free_mass_g: float = Field(
        description="the lightest shape of any family under the same limits, except the slope limit"
    )
    corners: list[Corner] | None = Field(description="points of a piecewise linear shape")
    contour: list[Piece] | None = Field(
        description="otherwise: bore diameter, or outer diameter of a bushing, piece by piece"
    )
    certificate: PinCertificate | None


class InfeasibleResult(Strict):
    """Why no pin of this outer diameter is feasible, and what would be."""

    diagnosis: list[ShortfallResult]
    warnings: list[str] = Field(default=[], description="warnings about the diagnosis")
    force_limit_n: float | None
    infeasible_from_mm: float | None
    infeasible_to_mm: float | None
    least_outer_diameter_mm: float | None = Field(description="with all else equal; null: no diameter suffices")
    certificate: CertificateResult | None = None


LIMITS = by_solver_name("force_n", "max_deflection_um", "max_ovalization_um", "max_ring_stress_mpa")
"""API names of requirements with a unit suffix."""


def design_json(
    outcome: Outcome, check: dict[str, Any], corners: list[dict[str, float]] | None, claim: Claim
) -> dict[str, Any]:
    """A design as JSON; ``check``, ``corners`` and ``claim`` are computed by the caller."""
    certificate = with_claim(certificate_json(outcome.certificate, MILLI), claim)
    return {
        **check,
        "form": outcome.value.form,
        "free_mass_g": outcome.value.free_mass / MILLI,
        "corners": corners,
        "contour": outcome.value.contour
        and [
            {
                "x_from_mm": p.start / MILLI,
                "x_to_mm": p.end / MILLI,
                "diameter_from_mm": p.first / MILLI,
                "diameter_to_mm": p.last / MILLI,
                "slope_from": p.slope_first,
                "slope_to": p.slope_last,
            }
            for p in outcome.value.contour
        ],
        "certificate": certificate and {**certificate, "lower_bound_g": certificate["bound"]},
    }


def infeasible_json(outcome: Outcome, why: pin.Diagnosis | None, claim: Claim) -> dict[str, Any]:
    """The diagnosis as JSON; a bushing has no ``why`` beyond its shortfalls."""
    weak = why and why.weak
    return {
        "diagnosis": diagnosis_json(outcome, LIMITS),
        "warnings": [],
        "force_limit_n": why and why.force_limit,
        "infeasible_from_mm": weak and weak.begin / MILLI,
        "infeasible_to_mm": weak and weak.end / MILLI,
        "least_outer_diameter_mm": (why and why.least_outer_diameter / MILLI) or None,
        "certificate": {"method": "the solid section", "bound": None, "gap": 0.0, "evidence": {}, **claim},
    }
