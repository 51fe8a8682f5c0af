"""What shaped an answer, in sentences: sensitivities of a design's objective to what was asked of it."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any, NamedTuple

from app.designs.units import split_unit
from app.words.languages import gettext as _

_MAXIMISED = ("fatigue_safety", "stability_safety", "impact_speed", "blow_frequency")
SIZES = {"b": "width", "h": "thickness", "l": "free length"}
_LITTLE = 5e-4
"""A sensitivity that moves the objective by less than a two-thousandth of the change is not told in figures."""


def sentences(run: Mapping[str, Any], worths: Mapping[str, float] | None = None) -> list[dict[str, str]]:
    """For every active constraint of a found design its name, and what one per cent of it is worth where that is
    known: from the run, or from ``worths``, sensitivities by the name of the criterion."""
    result = run["result"] or {}
    objective = str(result.get("objective", "mass"))
    told = [
        {"name": _allowed(item["name"]), "worth": _worth(_short(item["name"]), item["sensitivity"], objective)}
        for item in result.get("active_constraints") or ()
    ]
    used_up = _("fully used; a looser limit would give a better design")
    for name, criterion in _spent(run).items():
        worth = used_up
        if criterion is not None and name in (worths or {}):
            worth = _worth(_limit(criterion), worths[name], objective)
        told.append({"name": _(criterion["label"]) if criterion else _allowed(name), "worth": worth})
    return told


_FIELDS = {
    "equivalent_stress_max_mpa": "material.allowable_stress_mpa",
    "shear_stress_max_mpa": "material.allowable_shear_mpa",
}
"""Criteria that are judged by another field than the limit of their name."""
_MOST_LOOSENED = 4
_PER_CENT = 0.01


class Loosened(NamedTuple):
    """A limit that shaped a design: the factor by which it is looser in the request beside it."""

    factor: float
    spec: dict[str, Any]


def loosened(run: Mapping[str, Any]) -> dict[str, Loosened]:
    """What to design again so as to know what one per cent of a limit is worth, by the name of its criterion."""
    found = {}
    for name, criterion in list(_spent(run).items())[:_MOST_LOOSENED]:
        spec, place = copy.deepcopy(run["spec"]), _FIELDS.get(name, f"limits.{name}").split(".")
        holder = spec.get(place[0])
        if criterion is None or not criterion["required"] or criterion["sense"] not in ("at_least", "at_most"):
            continue
        factor = 1.0 - _PER_CENT if criterion["sense"] == "at_least" else 1.0 + _PER_CENT
        if len(place) == 2 and isinstance(holder, dict) and place[1] in holder:
            holder[place[1]] = criterion["required"] * factor
            found[name] = Loosened(factor, spec)
    return found


def _spent(run: Mapping[str, Any]) -> dict[str, Mapping[str, Any] | None]:
    """The limits that leave a found design nothing to spare, where its solver has no sensitivities: those that it
    names, else those without a margin; each with its criterion."""
    result, verdict = run["result"] or {}, run["verdict"]
    if run["mode"] != "design" or not verdict or "active_constraints" in result:
        return {}
    criteria = {item["name"]: item for item in verdict["criteria"]}
    if "active_limits" in result:
        return {name: criteria.get(name) for name in result["active_limits"]}
    return {n: item for n, item in criteria.items() if item["margin"] is not None and item["margin"] < _LITTLE}


def _allowed(name: str) -> str:
    """A constraint in words: an end of a size's bounds, a limit, or what else there is."""
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
    """A criterion as what its limit allows or requires."""
    said = _("%(what)s required") if criterion["sense"] == "at_least" else _("%(what)s allowed")
    return said % {"what": _(criterion["label"])}


def _short(name: str) -> str:
    """The same without its article."""
    size, _sep, _end = name.rpartition("_")
    return _(SIZES[size]) if size in SIZES else _allowed(name).removeprefix("the ")


def _worth(what: str, sensitivity: float, objective: str) -> str:
    """The change of the bound that makes the design better, and by how much."""
    best = {"objective": _(objective.replace("_", " "))}
    if abs(sensitivity) < _LITTLE:
        return _("changes the %(objective)s hardly at all") % best
    grows = objective in _MAXIMISED
    if grows:
        more = _("1 %% more %(what)s gains %(share)s %% %(objective)s")
        less = _("1 %% less %(what)s gains %(share)s %% %(objective)s")
    else:
        more = _("1 %% more %(what)s saves %(share)s %% %(objective)s")
        less = _("1 %% less %(what)s saves %(share)s %% %(objective)s")
    gains = sensitivity if grows else -sensitivity
    return (more if gains > 0 else less) % {**best, "what": what, "share": f"{abs(sensitivity):.2g}"}
