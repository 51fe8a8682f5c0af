"""A part's drawing in a page: its words in the page's language, as SVG."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from markupsafe import Markup

from app.designs.drawing import Drawing
from app.designs.kind import Kind
from app.designs.pictures.drawing_svg import drawing_svg
from app.web.languages import gettext as _

SENTENCES = re.compile(r"(?<=\.) ")


def drawn(kind: Kind, spec: Mapping[str, Any]) -> tuple[Markup, str]:
    """The part as a request describes it, which may lack much, and the words below it; nothing where too little is
    known."""
    drawing = kind.drawing(dict(spec))
    if drawing is None:
        return Markup(), ""
    spoken = in_words(drawing)
    return Markup(drawing_svg(spoken)), spoken.caption


def in_words(drawing: Drawing) -> Drawing:
    """The drawing with its words in the language spoken; a dimension's symbol is a word if it has several letters."""
    return replace(
        drawing,
        title=_(drawing.title),
        caption=" ".join(map(_, SENTENCES.split(drawing.caption))),
        notes=tuple(replace(note, words=_(note.words)) for note in drawing.notes),
        dimensions=tuple(replace(each, words=_dimension(each.words)) for each in drawing.dimensions),
    )


def _dimension(words: str) -> str:
    symbol, _space, value = words.rpartition(" ")
    return f"{_(symbol)} {value}" if len(symbol) > 2 else words
