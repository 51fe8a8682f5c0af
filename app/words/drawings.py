"""Drawings of parts as SVG, with translated labels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from markupsafe import Markup

from app.designs.drawing import Drawing, worded
from app.designs.kind import Kind
from app.designs.pictures.drawing_svg import drawing_svg
from app.words.captions import PARTS
from app.words.languages import gettext


class Drawn(NamedTuple):
    """A drawing as SVG and its caption; both empty if nothing can be drawn."""

    svg: Markup
    caption: str


def drawn(kind: Kind, spec: Mapping[str, Any]) -> Drawn:
    """Draw the part described by a request, which may be incomplete."""
    return _drawn(kind.drawing(dict(spec)))


def part_of(kind: Kind, run: dict[str, Any]) -> Drawn:
    """Draw the part of a run as in its exports; as requested if the run has no part."""
    if kind.part is None or not run["result"] or not kind.has_part(run):
        return drawn(kind, run["spec"])
    return _drawn(replace(kind.part(run, None).drawing, caption=PARTS.get(kind.slug, "")))


def _drawn(drawing: Drawing | None) -> Drawn:
    if drawing is None:
        return Drawn(Markup(), "")
    spoken = worded(drawing, gettext)
    return Drawn(Markup(drawing_svg(spoken)), spoken.caption)
