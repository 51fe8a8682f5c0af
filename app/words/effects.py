"""Effects of a run for display, and its request with one effect switched."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.designs.kind import Kind
from app.words.languages import gettext as _

_UNKNOWN = 1e9


def effect_rows(kind: Kind, run: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Every effect of the run, with its summary and its influence as text."""
    adds = {effect.name: effect.summary for effect in kind.known_effects}
    return [
        {**effect, "adds": _(adds.get(effect["name"], "")), "may_change": _may_change(effect)}
        for effect in run["effects"]
    ]


def _may_change(effect: Mapping[str, Any]) -> str:
    influence = effect["influence"]
    if influence >= _UNKNOWN:
        return _("unknown: it may be large")
    if influence == 0:
        return _("nothing")
    return _("up to about %(x)s") % {
        "x": f"{100 * influence:.2g} %" if influence < 0.995 else f"{100 * influence:.0f} %"
    }


def switched(run: Mapping[str, Any], name: str, on: bool) -> dict[str, Any]:
    """The run's spec with one effect included or excluded; earlier settings are kept, other effects stay automatic."""
    settled = run["spec"]["effects"]
    if isinstance(settled, str):
        every = [effect["name"] for effect in run["effects"]] if settled == "all" else []
        settled = {"include": every, "exclude": []}
    kept = {way: [other for other in settled[way] if other != name] for way in ("include", "exclude")}
    kept["include" if on else "exclude"].append(name)
    return {**run["spec"], "effects": kept}
