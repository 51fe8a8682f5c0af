"""Reference solutions of checks and designs of a flexible rod, from ``solvers.references.rod``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from app.designs.flexible_rod.request import CheckRequest, DesignRequest
from app.designs.independent import active, exact, reference
from app.designs.kind import Answer
from app.designs.units import MILLI, by_solver_name
from solvers import rod
from solvers.accuracy import Exact, Reference

_NAMES = by_solver_name(
    "fatigue_safety", "stability_safety", "yield_safety", "critical_force_n", "axial_force_min_n", "axial_force_max_n",
    "stress_amplitude_mpa", "side_force_max_n", "clamp_moment_max_nmm", "contact_pressure_max_mpa", "friction_power_w",
    "natural_frequency_hz", "mass_g",
)  # fmt: skip
_ALL = frozenset(_NAMES)
_FRICTION = {"contact_pressure_max", "friction_power"}
_OF_THE_FORCE = {"axial_force_min", "axial_force_max", "natural_frequency", "mass"}
_STABILITY = {"critical_force", "stability_safety"}
_UNAFFECTED = {
    "reciprocating_inertia": _ALL,
    "beam_column": _ALL,
    "friction": _ALL,
    "rod_inertia": _OF_THE_FORCE | _STABILITY,
    "large_displacement": _OF_THE_FORCE | _STABILITY,
    "shear": _OF_THE_FORCE,
    "friction_feedback": {"critical_force", "mass"},
}
"""Results that remain valid in the reference model when an effect is active: all if it models the effect, otherwise
those the effect does not change. An unlisted effect may change any."""
_LOADS = {rod.SchmidtLoad: "schmidt", rod.TableLoad: "table", rod.ConstantLoad: "constant"}


def check_reference(request: CheckRequest, answer: Answer) -> Reference | None:
    """Main results of a check that the reference model covers."""
    strip = request.strip()
    return _reference(request, (strip.b, strip.h, strip.l), answer, "")


def design_reference(request: DesignRequest, answer: Answer) -> Reference | None:
    """Main results of a design, at the dimensions of its own tightest answer."""
    found = answer.result["dimensions"]
    sizes = tuple(found[f"{name}_mm"] * MILLI for name in "bhl")
    return _reference(request, sizes, answer, ", at the dimensions of the tightest solution")


def _reference(
    request: CheckRequest | DesignRequest, sizes: tuple[float, float, float], answer: Answer, where: str
) -> Reference | None:
    scene = request.scene()
    if type(scene.load) not in _LOADS:
        return None
    effects = active(answer)
    known = _known(effects)
    if not known:
        return None
    case = {
        "mechanism": asdict(scene.mechanism),
        "piston": asdict(scene.piston),
        "material": {n: v for n, v in vars(scene.material).items() if isinstance(v, (int, float))},
        "dimensions": dict(zip("bhl", sizes, strict=True)),
        "load": _load(scene.load),
        "effects": effects,
        "straight": "beam_column" not in effects,
    }

    def results(watch: Callable[[], None]) -> dict[str, Exact]:
        # imported here because only studies need arbitrary precision
        from solvers.references.rod_check import check

        found = check(case, request.fatigue_criterion, watch, known)
        return exact(found, {own: _NAMES[own] for own in known})

    return reference(f"the strip from the two conditions at its head{where}", results)


def _known(effects: frozenset[str]) -> list[str]:
    """Results covered by the reference model with these effects."""
    covered = _ALL.intersection(*(_UNAFFECTED.get(name, frozenset()) for name in effects))
    if "friction" not in effects:
        covered -= _FRICTION
    return [name for name in _NAMES if name in covered]


def _load(load: Any) -> dict[str, Any]:
    covered = asdict(load)
    if "values" in covered:
        covered["pressure"] = covered.pop("values")
    return {"kind": _LOADS[type(load)], **covered}
