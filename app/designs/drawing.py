"""A part as lines, circles and dimensions in millimetres: what pictures and CAD files are made from alike.

x runs to the right, y up. A kind's ``drawing.py`` says what there is and where; how it looks is the renderer's.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

Place = tuple[float, float]


class Layer(StrEnum):
    OUTLINE = "OUTLINE"
    """The part."""
    SECTION = "SECTION"
    """A cut face of the part."""
    HIDDEN = "HIDDEN"
    """What the part may become, or where it also stands."""
    CENTER = "CENTER"
    """Axes and paths."""
    CONTEXT = "CONTEXT"
    """What lies around the part."""


@dataclass(frozen=True)
class Line:
    """A line through points."""

    points: tuple[Place, ...]
    layer: Layer = Layer.OUTLINE
    closed: bool = False


@dataclass(frozen=True)
class Circle:
    center: Place
    radius: float
    layer: Layer = Layer.OUTLINE


@dataclass(frozen=True)
class Straight:
    """A piece of an outline: straight on to its end."""

    end: Place


@dataclass(frozen=True)
class Arc:
    """An arc of a circle on to its end; ``bulge`` is the tangent of a quarter of the angle, positive to the left."""

    end: Place
    bulge: float


@dataclass(frozen=True)
class Bezier:
    """A cubic by its two control points and its end."""

    first: Place
    second: Place
    end: Place


Piece = Straight | Arc | Bezier


@dataclass(frozen=True)
class Outline:
    """Pieces one after the other from a start, which closed ones come back to by themselves."""

    start: Place
    pieces: tuple[Piece, ...]
    layer: Layer = Layer.OUTLINE
    closed: bool = True

    @property
    def places(self) -> tuple[Place, ...]:
        """Where pieces begin and end."""
        return (self.start, *(piece.end for piece in self.pieces))


Shape = Line | Circle | Outline


def middle_of(start: Place, arc: Arc) -> Place:
    """The point half way along an arc."""
    (x1, y1), (x2, y2) = start, arc.end
    return 0.5 * (x1 + x2 + arc.bulge * (y2 - y1)), 0.5 * (y1 + y2 - arc.bulge * (x2 - x1))


def extent(shape: Shape) -> tuple[Place, ...]:
    """Points whose box holds the shape; arcs of more than a half turn are for circles."""
    if isinstance(shape, Circle):
        (x, y), r = shape.center, shape.radius
        return ((x - r, y - r), (x + r, y + r))
    if isinstance(shape, Line):
        return shape.points
    found = [shape.start]
    for piece in shape.pieces:
        if isinstance(piece, Arc):
            found.append(middle_of(found[-1], piece))
        elif isinstance(piece, Bezier):
            found += [piece.first, piece.second]
        found.append(piece.end)
    return tuple(found)


@dataclass(frozen=True)
class Note:
    """Words in the middle of a place."""

    at: Place
    words: str


@dataclass(frozen=True)
class Dimension:
    """A distance with its words.

    ``axis``: "x" or "y" for the distance along that axis, its line ``level`` steps of the renderer away from the
    coordinate ``at`` (up or right where positive); "free" for a distance along the points themselves. ``path``: the
    request's field that it shows, as a dotted path; empty for what only follows from others.
    """

    start: Place
    end: Place
    words: str
    axis: str
    at: float = 0.0
    level: int = 0
    path: str = ""


@dataclass(frozen=True)
class Drawing:
    """A part to scale, and what is to be said below it."""

    title: str
    shapes: tuple[Shape, ...]
    dimensions: tuple[Dimension, ...] = ()
    notes: tuple[Note, ...] = ()
    caption: str = ""


_SENTENCES = re.compile(r"(?<=\.) ")


def sentences_of(caption: str) -> list[str]:
    """The sentences of a caption, each of which is worded by itself."""
    return _SENTENCES.split(caption)


def worded(drawing: Drawing, say: Callable[[str], str]) -> Drawing:
    """The drawing with its words as ``say`` puts them; a dimension's symbol is a word if it has several letters."""

    def dimension(words: str) -> str:
        symbol, _space, value = words.rpartition(" ")
        return f"{say(symbol)} {value}" if len(symbol) > 2 else words

    return replace(
        drawing,
        title=say(drawing.title),
        caption=" ".join(map(say, sentences_of(drawing.caption))),
        notes=tuple(replace(note, words=say(note.words)) for note in drawing.notes),
        dimensions=tuple(replace(each, words=dimension(each.words)) for each in drawing.dimensions),
    )


def rectangle(left: float, bottom: float, right: float, top: float, layer: Layer = Layer.OUTLINE) -> Line:
    """A rectangle by its sides."""
    return Line(((left, bottom), (right, bottom), (right, top), (left, top)), layer, closed=True)


def words_of(symbol: str, value: float) -> str:
    """A symbol and its value as a dimension shows them."""
    return f"{symbol} {value:.5g}".strip()


def given(request: Mapping[str, Any], path: str) -> Any:
    """What a request, which may lack much, has at a dotted path; None for nothing."""
    here: Any = request
    for step in path.split("."):
        if isinstance(here, Mapping):
            here = here.get(step)
        elif isinstance(here, Sequence) and not isinstance(here, str) and step.isdigit() and int(step) < len(here):
            here = here[int(step)]
        else:
            return None
    return here


def length(request: Mapping[str, Any], path: str) -> float | None:
    """The number at a path if it is one that can be drawn: finite, and not negative."""
    value = signed(request, path)
    return value if value is not None and value >= 0.0 else None


def signed(request: Mapping[str, Any], path: str) -> float | None:
    """The number at a path if it is a finite one."""
    value = given(request, path)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        return None
    return float(value) if abs(value) <= 1e7 else None
