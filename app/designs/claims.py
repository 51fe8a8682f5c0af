"""The wording of certificates for all kinds of design: what is proven, for which physics, form and range, by which
argument, and what is only estimated. Only this module words claims; the reasons are in decision 12.

A claim is derived from an outcome, so that it names the active effects and the requested limits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from solvers.outcome import Certificate, EffectState, Outcome

Claim = dict[str, str | list[str]]

NOT_IN_THE_GAP = (
    "the numerical error of this design's results, quadrature and the places between stations included: it is the "
    "estimated accuracy, and no part of the gap"
)


def with_claim(certificate: dict[str, Any] | None, claim: Claim) -> dict[str, Any] | None:
    """A certificate as JSON, with its claim added."""
    return None if certificate is None else {**certificate, **claim}


def _ran(outcome: Outcome[Any]) -> list[str]:
    return [e.name for e in outcome.effects if e.state is EffectState.ACTIVE]


# Pins and bushings ----------------------------------------------------------------------------------------------------

_PIN_FORMS = {
    "free": "any bore, halves alike or not",
    "drillable": "any bore that does not widen toward the middle",
    "constant": "one bore all along",
    "stepped": "the requested number of steps from each end, not widening toward the middle; halves alike",
    "double_cone": "a cone from each end to the middle, narrowing or widening; halves alike",
    "cone_cylinder": "a cone from each end, narrowing or widening, that runs into a cylinder; halves alike",
}
_BUSHING_FORMS = {
    "free": "any outside",
    "drillable": "any outside that does not narrow toward the middle",
    "constant": "one outer diameter all along",
    "stepped": "the requested number of steps from each end, not narrowing toward the middle; halves alike",
}
_PIN_RANGES = {
    "constant": "every size",
    "stepped": "every place and size of the steps",
    "double_cone": "every pair of diameters",
    "cone_cylinder": "every pair of diameters, and cones from a thousandth of the half on (shorter ones are cylinders)",
}


FIXED = (_PIN_FORMS, _BUSHING_FORMS, _PIN_RANGES)
"""Texts of claims without inserted values, for translation."""


def of_pin(outcome: Outcome[Any], form: str, outside: bool, limited: Sequence[str]) -> Claim:
    """The claim for the lightest pin or bushing of a form; ``limited``: names of the requested limits."""
    part, ran = ("bushing" if outside else "pin"), _ran(outcome)
    physics = ["strength of the beam's sections by the chosen criterion"]
    if "max_deflection_um" in limited:
        physics.append("deflection by bending" + (" and shear" if "shear_deflection" in ran else ""))
    ring = {"max_ovalization_um": "ovalization", "max_ring_stress_mpa": "hoop stress"}
    physics += [
        f"{name_of_stress} of the ring where the wall is thinnest"
        for name, name_of_stress in ring.items()
        if name in limited
    ]
    if outcome.value is None:
        return {
            "proven": f"no {part} meets strength and limits: even the solid one, the strongest and stiffest, does not",
            "physics": "the check's own: " + "; ".join(physics),
            "form": "any",
            "range": "every wall up to the solid section",
            "estimated": [],
        }
    stations = outcome.accuracy.settings.get("stations")
    at = f"every wall from the least that holds to the solid section, at each of the answer's {stations} stations"
    return {
        "proven": f"no {part} of this form that keeps strength and limits is lighter than the bound",
        "physics": "the check's own: " + "; ".join(physics),
        "form": (_BUSHING_FORMS if outside else _PIN_FORMS)[form],
        "range": _PIN_RANGES.get(form, at),
        "estimated": [NOT_IN_THE_GAP],
    }


# Linkages -------------------------------------------------------------------------------------------------------------


def of_linkage(outcome: Outcome[Any], objective: str, sign: int, types: Sequence[str]) -> Claim:
    """The claim for the best linkage; ``sign`` is +1 if the objective is minimised."""
    searched = str(outcome.certificate.evidence["searched"])
    allowed = ", ".join(name.replace("_", " ") for name in types)
    named = objective.replace("_", " ")
    proven = f"no such linkage that keeps the limits has a lower {named} than the bound"
    if sign < 0:
        proven = f"no such linkage that keeps the limits has a greater {named} than the bound"
    if outcome.value is None:
        proven = "no such linkage keeps the limits"
    beside = [name for name in _ran(outcome) if name != "envelope"]
    return {
        "proven": proven,
        "physics": "the check's own: rigid links without play, loads of the rocker's inertia at constant crank speed",
        "form": f"change-point linkages ({allowed}) that have the restitution asked for, its middle if it is a range",
        "range": searched,
        "estimated": [f"nothing of the bound; it does not include {', '.join(beside).replace('_', ' ')}"]
        if beside
        else [],
    }


# Rods -----------------------------------------------------------------------------------------------------------------


def of_rod(outcome: Outcome[Any], objective: str) -> Claim:
    """The claim for the best strip, or that there is none; the outcome must have a certificate."""
    certificate = outcome.certificate
    ran = ", ".join(_ran(outcome)).replace("_", " ") or "gas load alone"
    common = {
        "form": "strips of rectangular section",
        "range": "all within the bounds, on the stock and steps asked for",
    }
    beyond = str(certificate.evidence.get("effects_beyond_the_core", "")).replace("_", " ")
    if not beyond:
        return {
            "proven": _of_core(outcome, objective),
            "physics": f"the check's own: {ran}",
            **common,
            "estimated": [NOT_IN_THE_GAP],
        }
    return {
        "proven": _of_part(certificate),
        "physics": f"the core's, without {beyond}",
        **common,
        "estimated": [f"the physics with {beyond}: " + _of_full(certificate), NOT_IN_THE_GAP],
    }


def _of_core(outcome: Outcome[Any], objective: str) -> str:
    if outcome.value is None:
        return "no strip meets the requirements"
    return f"no strip that meets the requirements has a better {objective.replace('_', ' ')} than the bound"


def _of_part(certificate: Certificate) -> str:
    evidence = certificate.evidence
    if "core_bound" in evidence:
        return "no strip that meets the requirements by this physics is better than the core's bound"
    return str(evidence.get("core", "nothing")).removeprefix("proven: ")


def _of_full(certificate: Certificate) -> str:
    if "full_model_bound" not in certificate.evidence:
        if certificate.evidence.get("local_searches"):
            return "local searches found no strip that meets the requirements"
        return "not searched"
    local = "the answer is a local optimum, which local searches did not beat"
    if math.isinf(certificate.gap):
        return f"{local}; no bound is known"
    return (
        f"{local}; the bound is the basic model's, relaxed by what these effects change where their influence was "
        "evaluated"
    )
