"""Reference solutions of checks and designs of a pin, from ``solvers.references.pin``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from app.designs.independent import Found, active, exact, reference
from app.designs.kind import Answer
from app.designs.pin_profile.request import CheckRequest, DesignRequest, PinRequest
from solvers.accuracy import Exact, Reference
from solvers.pin.check import halves_alike

_NAMES = {
    "mass": "mass_g",
    "solid_mass": "solid_mass_g",
    "constant_bore_mass": "constant_bore_mass_g",
    "max_moment": "max_moment_nmm",
    "force_limit": "force_limit_n",
    "deflection": "deflection_um",
    "small_end_pressure": "contact_pressures_mpa.small_end",
    "boss_peak_pressure": "contact_pressures_mpa.boss_peak",
}
_MADE = "the textbook's forces, stresses in bore ratios, Cowper's coefficient"

Watch = Callable[[], None]


def check_reference(request: CheckRequest, answer: Answer) -> Reference | None:
    """Main results of a check, without the deflection of an asymmetric bore; none for bushings."""
    if request.seeks_outside:
        return None
    scene = request.scene()
    whole = request.given().along(scene.geometry.length)
    points = list(zip(whole.x, whole.bore, strict=True))
    alike = halves_alike(scene, whole)

    def bore(case: dict[str, Any], watch: Watch) -> Found:
        # imported here because only studies need arbitrary precision
        from solvers.references.pin import given_bore

        found = given_bore(case, points, "shear_deflection" in active(answer), watch)
        return found if alike else {"mass": found["mass"]}

    return _reference(request, answer, bore)


def design_reference(request: DesignRequest, answer: Answer) -> Reference | None:
    """Main results of a design: mass and deflection of a free bore shaped only by strength and minimum wall; for
    others, the results independent of the bore. None for bushings."""
    if request.seeks_outside:
        return None

    def bore(case: dict[str, Any], watch: Watch) -> Found:
        from solvers.references.pin import free_bore

        if request.form.kind != "free" or not _plain(request):
            return {}
        return free_bore(case, "shear_deflection" in active(answer), watch)

    return _reference(request, answer, bore)


def _plain(request: PinRequest) -> bool:
    """Whether only strength and minimum wall shape the bore."""
    limits = request.limits
    others = limits.max_deflection_um, limits.max_ovalization_um, limits.max_slope, limits.max_ring_stress_mpa
    return all(limit is None for limit in others)


def _reference(request: PinRequest, answer: Answer, bore: Callable[[dict[str, Any], Watch], Found]) -> Reference:
    scene = request.scene()
    case = {
        **{name: getattr(scene.geometry, name) for name in _GEOMETRY},
        **{name: getattr(scene.material, name) for name in _MATERIAL},
        "force": scene.force,
        "criterion": request.criterion,
        "min_wall": request.limits.to_solver().min_wall,
    }

    def results(watch: Watch) -> dict[str, Exact]:
        from solvers.references.pin import common

        found = {**common(case, watch), **bore(case, watch)}
        if not _plain(request):
            del found["constant_bore_mass"]
        if "contact_pressure" not in active(answer):
            del found["small_end_pressure"], found["boss_peak_pressure"]
        return exact(found, _NAMES)

    return reference(_MADE, results)


_GEOMETRY = ("outer_diameter", "boss_length", "small_end_length", "gap")
_MATERIAL = ("allowable_stress", "allowable_shear", "elastic_modulus", "poisson", "density")
