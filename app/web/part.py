"""The part that a run is about, drawn to scale: in its machine, and by itself as the files to take away show it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

from markupsafe import Markup

from app.designs.kind import Kind
from app.designs.pictures.drawing_svg import drawing_svg
from app.web.captions import PARTS
from app.web.drawings import drawn, in_words

_FOUND = ("dimensions", "profile", "type", "lengths_mm")
"""Results of a design that a check of the same part is asked with."""
_SOUGHT = ("bounds", "stock_h_mm", "step_mm")
"""What a design asks of dimensions that it has found."""


def checked_as(run: dict[str, Any]) -> dict[str, Any]:
    """What a check of the part that a design found is asked with, beside what the design was asked."""
    result = run["result"] or {}
    found = {name: result[name] for name in ("dimensions", "lengths_mm") if result.get(name) is not None}
    if "lengths_mm" in found:
        # The lengths tell the type and its ratio.
        found |= {"type": None, "ratios": None}
    points = result.get("corners") or result.get("profile")
    if points:
        size = "outer_diameter_mm" if run["spec"].get("variable") == "outer" else "bore_mm"
        found["profile"] = [{"x_mm": point["x_mm"], size: point[size]} for point in points]
        found |= {"bore_mm": None} if size == "bore_mm" else {}
    return found


def part_of(kind: Kind, run: dict[str, Any]) -> tuple[Markup, str]:
    """The drawing as SVG and its caption; both empty where there is nothing to draw."""
    result = run["result"] or {}
    found = {name: result[name] for name in _FOUND if result.get(name) is not None}
    if "profile" in found and not all("x_mm" in point for point in found["profile"]):
        return Markup(), ""
    # What was to be found is known now.
    given = {name: value for name, value in run["spec"].items() if not found or name not in _SOUGHT}
    return drawn(kind, {**given, **found})


class MadePart(NamedTuple):
    """A part by itself as SVG, and its caption."""

    svg: Markup
    caption: str


def made_part(kind: Kind, run: dict[str, Any]) -> MadePart | None:
    """The part as drawings, solids and parameters have it; None where the run tells of none."""
    if kind.part is None or run["result"] is None or not kind.has_part(run):
        return None
    drawing = replace(kind.part(run, None).drawing, caption=PARTS.get(kind.slug, ""))
    spoken = in_words(drawing)
    return MadePart(Markup(drawing_svg(spoken)), spoken.caption)
