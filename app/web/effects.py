"""The request of a run with one of its effects switched."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def switched(run: Mapping[str, Any], name: str, on: bool) -> dict[str, Any]:
    """The run's spec with one effect settled anew; what was settled stays so, all others follow their bounds."""
    settled = run["spec"]["effects"]
    if isinstance(settled, str):
        every = [effect["name"] for effect in run["effects"]] if settled == "all" else []
        settled = {"include": every, "exclude": []}
    kept = {way: [other for other in settled[way] if other != name] for way in ("include", "exclude")}
    kept["include" if on else "exclude"].append(name)
    return {**run["spec"], "effects": kept}
