"""Drawings of parts as SVG, with translated labels."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from markupsafe import Markup

from app.designs.drawing import Dimension, Drawing, worded
from app.designs.kind import Kind
from app.designs.pictures.drawing_svg import drawing_svg
from app.words.captions import PARTS
from app.words.languages import gettext
from app.words.units import System, system, told

_FIGURE = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\d.°])")


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
    spoken = in_words(drawing)
    return Drawn(Markup(drawing_svg(spoken)), spoken.caption)


def in_words(drawing: Drawing) -> Drawing:
    """The drawing in the current units and language."""
    return worded(_measured(drawing) if system() is System.INCH else drawing, gettext)


def _measured(drawing: Drawing) -> Drawing:
    return replace(
        drawing,
        caption=drawing.caption.replace("mm, to scale", "inches, to scale"),
        dimensions=tuple(_in_inches(each) for each in drawing.dimensions),
    )


def _in_inches(dimension: Dimension) -> Dimension:
    """The dimension with its figures in inches; the one that it measures from its own length, not from its text, which
    is rounded."""
    (x1, y1), (x2, y2) = dimension.start, dimension.end
    measured = {"x": abs(x2 - x1), "y": abs(y2 - y1)}.get(dimension.axis, math.hypot(x2 - x1, y2 - y1))

    def converted(figure: re.Match[str]) -> str:
        value = float(figure[0])
        return f"{told(measured if float(f'{measured:.5g}') == value else value, 'mm'):.5g}"

    return replace(dimension, words=_FIGURE.sub(converted, dimension.words))
