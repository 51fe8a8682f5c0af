"""Sentences on the active constraints of a design and the sensitivity of its objective to them."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any, NamedTuple

from app.designs.units import split_unit
from app.words.languages import gettext as _

_MAXIMISED = ("fatigue_safety", "stability_safety", "impact_speed", "blow_frequency")
SIZES = {"b": "width", "h": "thickness", "l": "free length"}
_NEGLIGIBLE = 5e-4
"""Relative sensitivity below which no figure is stated; also the margin below which a limit counts as active."""


def sentences(run: Mapping[str, Any], worths: Mapping[str, float] | None = None) -> list[dict[str, str]]:
    """Name of every active constraint of a design, and the effect of changing it by one per cent where known.

    Sensitivities d ln(objective) / d ln(limit) come from the run, or from ``worths`` by criterion name.
    """
    result = run["result"] or {}
    objective = str(result.get("objective", "mass"))
    told = [
        {"name": _allowed(item["name"]), "worth": _worth(item["sensitivity"], objective)}
        for item in result.get("active_constraints") or ()
    ]
    used_up = _("fully used; a looser limit would give a better design")
    for name, criterion in _active_limits(run).items():
        if criterion is not None and name in (worths or {}):
            told.append({"name": _limit(criterion), "worth": _worth(worths[name], objective)})
        else:
            told.append({"name": _(criterion["label"]) if criterion else _allowed(name), "worth": used_up})
    return told


_FIELDS = {
    "equivalent_stress_max_mpa": "material.allowable_stress_mpa",
    "shear_stress_max_mpa": "material.allowable_shear_mpa",
}
"""Request fields of the criteria whose limit is not ``limits.<name>``."""
_MAX_LOOSENED = 4
_RELAXATION = 0.01


class Loosened(NamedTuple):
    """A request with one active limit relaxed by ``factor``."""

    factor: float
    spec: dict[str, Any]


def loosened(run: Mapping[str, Any]) -> dict[str, Loosened]:
    """Requests, by criterion name, with one active limit relaxed by 1 %, for sensitivities by finite differences."""
    found = {}
    for name, criterion in list(_active_limits(run).items())[:_MAX_LOOSENED]:
        spec, path = copy.deepcopy(run["spec"]), _FIELDS.get(name, f"limits.{name}").split(".")
        holder = spec.get(path[0])
        if criterion is None or not criterion["required"] or criterion["sense"] not in ("at_least", "at_most"):
            continue
        factor = 1.0 - _RELAXATION if criterion["sense"] == "at_least" else 1.0 + _RELAXATION
        if len(path) == 2 and isinstance(holder, dict) and path[1] in holder:
            holder[path[1]] = criterion["required"] * factor
            found[name] = Loosened(factor, spec)
    return found


def _active_limits(run: Mapping[str, Any]) -> dict[str, Mapping[str, Any] | None]:
    """Active limits, with their criteria, of a design whose solver reports no sensitivities.

    They are those named by the solver, else those met with a margin below ``_NEGLIGIBLE``: one that is not met, such as
    the ring's stress, was no limit of the design.
    """
    result, verdict = run["result"] or {}, run["verdict"]
    if run["mode"] != "design" or not verdict or "active_constraints" in result:
        return {}
    criteria = {item["name"]: item for item in verdict["criteria"]}
    if "active_limits" in result:
        return {name: criteria.get(name) for name in result["active_limits"]}
    met = {n: item for n, item in criteria.items() if item["holds"] and item["margin"] is not None}
    return {n: item for n, item in met.items() if item["margin"] < _NEGLIGIBLE}


def _allowed(name: str) -> str:
    """Label of a constraint: a bound of a size, a limit, or another field."""
    size, _sep, end = name.rpartition("_")
    if size in SIZES:
        words = {"size": _(SIZES[size])}
        if end == "lower":
            return _("the least %(size)s allowed") % words
        return (_("the greatest %(size)s allowed") if end == "upper" else _("the next %(size)s allowed")) % words
    words = split_unit(name)[0]
    if words.startswith("min "):
        return _("the %(what)s required") % {"what": _(words.removeprefix("min "))}
    if words.startswith("max "):
        return _("the %(what)s allowed") % {"what": _(words.removeprefix("max "))}
    return _(words)


def _limit(criterion: Mapping[str, Any]) -> str:
    """Label of a criterion's limit."""
    said = _("%(what)s required") if criterion["sense"] == "at_least" else _("%(what)s allowed")
    return said % {"what": _(criterion["label"])}


def _worth(sensitivity: float, objective: str) -> str:
    """The improving change of a bound and its gain; ``sensitivity`` = d ln(objective) / d ln(bound)."""
    best = {"objective": _(objective.replace("_", " "))}
    if abs(sensitivity) < _NEGLIGIBLE:
        return _("changes the %(objective)s hardly at all") % best
    grows = objective in _MAXIMISED
    if grows:
        more = _("1 %% more gains %(share)s %% %(objective)s")
        less = _("1 %% less gains %(share)s %% %(objective)s")
    else:
        more = _("1 %% more saves %(share)s %% %(objective)s")
        less = _("1 %% less saves %(share)s %% %(objective)s")
    gains = sensitivity if grows else -sensitivity
    return (more if gains > 0 else less) % {**best, "share": f"{abs(sensitivity):.2g}"}
