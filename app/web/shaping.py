"""What shaped an answer, in sentences: sensitivities of a design's objective to what was asked of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.designs.units import split_unit

_MAXIMISED = ("fatigue_safety", "stability_safety", "impact_speed", "blow_frequency")
_SIZES = {"b": "width", "h": "thickness", "l": "free length"}
_ENDS = {"lower": "least", "upper": "greatest", "size": "next"}
_LITTLE = 5e-4
"""A sensitivity that moves the objective by less than a two-thousandth of the change is not told in figures."""


def sentences(result: Mapping[str, Any]) -> list[dict[str, str]]:
    """For every active constraint its name, and what one per cent of it is worth."""
    objective = str(result.get("objective", "mass"))
    told = [
        {"name": _named(item["name"]), "worth": _worth(item["name"], item["sensitivity"], objective)}
        for item in result.get("active_constraints") or ()
    ]
    limits = result.get("active_limits") or ()
    return told + [{"name": split_unit(name)[0], "worth": "used up: more of it gives a better one"} for name in limits]


def _named(name: str) -> str:
    size, _, end = name.rpartition("_")
    if size in _SIZES and end in _ENDS:
        return f"the {_ENDS[end]} {_SIZES[size]} allowed"
    words = split_unit(name)[0]
    for begin in ("min ", "max "):
        if words.startswith(begin):
            return f"the {words.removeprefix(begin)} {'required' if begin == 'min ' else 'allowed'}"
    return words


def _worth(name: str, sensitivity: float, objective: str) -> str:
    """The change of the bound that makes the design better, and by how much."""
    if abs(sensitivity) < _LITTLE:
        return f"changes the {_plain(objective)} hardly at all"
    gains = sensitivity if objective in _MAXIMISED else -sensitivity
    verb = "gains" if objective in _MAXIMISED else "saves"
    size, _, end = name.rpartition("_")
    change = "1 % more" if gains > 0 else "1 % less"
    what = _SIZES[size] if size in _SIZES and end in _ENDS else _named(name).removeprefix("the ")
    return f"{change} {what} {verb} {abs(sensitivity):.2g} % {_plain(objective)}"


def _plain(objective: str) -> str:
    return objective.replace("_", " ")
