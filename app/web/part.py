"""The part that a run is about, drawn to scale."""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from app.designs.kind import Kind
from app.web.drawings import drawn

_FOUND = ("dimensions", "profile", "type", "lengths_mm")
"""Results of a design that a check of the same part is asked with."""
_SOUGHT = ("bounds", "stock_h_mm", "step_mm")
"""What a design asks of dimensions that it has found."""


def part_of(kind: Kind, run: dict[str, Any]) -> tuple[Markup, str]:
    """The drawing as SVG and its caption; both empty where there is nothing to draw."""
    result = run["result"] or {}
    found = {name: result[name] for name in _FOUND if result.get(name) is not None}
    if "profile" in found and not all("x_mm" in point for point in found["profile"]):
        return Markup(), ""
    # What was to be found is known now.
    given = {name: value for name, value in run["spec"].items() if not found or name not in _SOUGHT}
    return drawn(kind, {**given, **found})
