"""A part's drawing as SVG, its words in the language spoken."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from markupsafe import Markup

from app.designs.drawing import Drawing
from app.designs.kind import Kind
from app.designs.pictures.drawing_svg import drawing_svg
from app.words.captions import PARTS
from app.words.languages import gettext as _
from app.words.units import System, system, told

SENTENCES = re.compile(r"(?<=\.) ")
_FIGURE = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\d.°])")


class Drawn(NamedTuple):
    """A drawing as SVG and the words below it; both empty where nothing can be drawn."""

    svg: Markup
    caption: str


def drawn(kind: Kind, spec: Mapping[str, Any]) -> Drawn:
    """The part as a request describes it, which may lack much."""
    return _drawn(kind.drawing(dict(spec)))


def part_of(kind: Kind, run: dict[str, Any]) -> Drawn:
    """The part of a run, as the files to take away have it; as it was asked for where the run tells of none."""
    if kind.part is None or not run["result"] or not kind.has_part(run):
        return drawn(kind, run["spec"])
    return _drawn(replace(kind.part(run, None).drawing, caption=PARTS.get(kind.slug, "")))


def _drawn(drawing: Drawing | None) -> Drawn:
    if drawing is None:
        return Drawn(Markup(), "")
    spoken = in_words(drawing)
    return Drawn(Markup(drawing_svg(spoken)), spoken.caption)


def in_words(drawing: Drawing) -> Drawing:
    """The drawing with its words in the language spoken; a dimension's symbol is a word if it has several letters."""
    return replace(
        drawing,
        title=_(drawing.title),
        caption=" ".join(_(_scale(each)) for each in SENTENCES.split(drawing.caption)),
        notes=tuple(replace(note, words=_(note.words)) for note in drawing.notes),
        dimensions=tuple(replace(each, words=_dimension(each.words)) for each in drawing.dimensions),
    )


def _scale(sentence: str) -> str:
    return sentence.replace("mm, to scale", "inches, to scale") if system() is System.INCH else sentence


def _dimension(words: str) -> str:
    words = _FIGURE.sub(lambda figure: f"{told(float(figure[0]), 'mm'):.5g}", words)
    symbol, _space, value = words.rpartition(" ")
    return f"{_(symbol)} {value}" if len(symbol) > 2 else words
