"""What shaped an answer, in sentences: sensitivities of a design's objective to what was asked of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.designs.units import split_unit
from app.words.languages import gettext as _

_MAXIMISED = ("fatigue_safety", "stability_safety", "impact_speed", "blow_frequency")
SIZES = {"b": "width", "h": "thickness", "l": "free length"}
_LITTLE = 5e-4
"""A sensitivity that moves the objective by less than a two-thousandth of the change is not told in figures."""


def sentences(run: Mapping[str, Any]) -> list[dict[str, str]]:
    """For every active constraint of a found design its name, and what one per cent of it is worth where that is
    known."""
    result = run["result"] or {}
    objective = str(result.get("objective", "mass"))
    told = [
        {"name": _allowed(item["name"]), "worth": _worth(item["name"], item["sensitivity"], objective)}
        for item in result.get("active_constraints") or ()
    ]
    limits = result.get("active_limits") or ()
    used_up = _("just met; a looser one would give a better design")
    criteria = run["verdict"]["criteria"] if run["verdict"] else ()
    labels = {item["name"]: _(item["label"]) for item in criteria}
    told += [{"name": labels.get(name) or _allowed(name), "worth": used_up} for name in limits]
    if told or run["mode"] != "design" or not run["verdict"] or "active_limits" in result:
        return told
    # Where the solver names none, those that leave nothing to spare.
    spent = (item for item in criteria if item["margin"] is not None and item["margin"] < _LITTLE)
    return [{"name": _(item["label"]), "worth": used_up} for item in spent]


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


def _short(name: str) -> str:
    """The same without its article."""
    size, _sep, _end = name.rpartition("_")
    return _(SIZES[size]) if size in SIZES else _allowed(name).removeprefix("the ")


def _worth(name: str, sensitivity: float, objective: str) -> str:
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
    return (more if gains > 0 else less) % {**best, "what": _short(name), "share": f"{abs(sensitivity):.2g}"}
