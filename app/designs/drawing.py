"""A drawing: lines, circles and dimensions in millimetres, the common source of pictures and CAD files.

x points right, y up. A kind's ``drawing.py`` defines content and geometry; the renderer defines the appearance.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

from app.designs.units import shown_as

Place = tuple[float, float]


class Layer(StrEnum):
    OUTLINE = "OUTLINE"
    """the part"""
    SECTION = "SECTION"
    """a section face"""
    HIDDEN = "HIDDEN"
    """limits or other positions of the part"""
    CENTER = "CENTER"
    """axes and paths"""
    CONTEXT = "CONTEXT"
    """surrounding parts"""


@dataclass(frozen=True)
class Line:
    """A polyline."""

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
    """A straight segment of an outline, up to its end point."""

    end: Place


@dataclass(frozen=True)
class Arc:
    """A circular arc up to its end point; ``bulge`` is the tangent of a quarter of the angle, positive to the left."""

    end: Place
    bulge: float


@dataclass(frozen=True)
class Bezier:
    """A cubic Bézier segment: two control points and its end point."""

    first: Place
    second: Place
    end: Place


Piece = Straight | Arc | Bezier


@dataclass(frozen=True)
class Outline:
    """Consecutive segments from a start point; closed outlines return to it."""

    start: Place
    pieces: tuple[Piece, ...]
    layer: Layer = Layer.OUTLINE
    closed: bool = True

    @property
    def places(self) -> tuple[Place, ...]:
        """Start and end points of all segments."""
        return (self.start, *(piece.end for piece in self.pieces))


Shape = Line | Circle | Outline


def middle_of(start: Place, arc: Arc) -> Place:
    """The midpoint of an arc."""
    (x1, y1), (x2, y2) = start, arc.end
    return 0.5 * (x1 + x2 + arc.bulge * (y2 - y1)), 0.5 * (y1 + y2 - arc.bulge * (x2 - x1))


def extent(shape: Shape) -> tuple[Place, ...]:
    """Points that span the shape's bounding box; exact for arcs up to half a turn."""
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
    """Text centred at a point."""

    at: Place
    words: str


@dataclass(frozen=True)
class Dimension:
    """A dimension with its text.

    ``axis``: "x" or "y" for the distance along an axis, with the dimension line ``level`` renderer steps away from the
    coordinate ``at`` (positive: up or right); "free" for the distance between the points. ``path``: dotted path of the
    request's field, empty for a derived dimension.
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
    """A drawing to scale with its caption."""

    title: str
    shapes: tuple[Shape, ...]
    dimensions: tuple[Dimension, ...] = ()
    notes: tuple[Note, ...] = ()
    caption: str = ""


_SENTENCES = re.compile(r"(?<=\.) ")


def sentences_of(caption: str) -> list[str]:
    """Sentences of a caption, which are translated separately."""
    return _SENTENCES.split(caption)


_FIGURE = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\d.°])")


def worded(drawing: Drawing, say: Callable[[str], str]) -> Drawing:
    """The drawing in the units shown and translated with ``say``; a dimension's symbol of several letters is
    translated, too."""
    caption, size = drawing.caption, shown_as("mm")[1]
    if size != 1.0:
        caption = caption.replace("mm, to scale", "inches, to scale")

    def dimension(each: Dimension) -> Dimension:
        symbol, _space, value = each.words.rpartition(" ")
        words = f"{say(symbol)} {value}" if len(symbol) > 2 else each.words
        return replace(each, words=words if size == 1.0 else _in_other_units(each, words, size))

    return replace(
        drawing,
        title=say(drawing.title),
        caption=" ".join(map(say, sentences_of(caption))),
        notes=tuple(replace(note, words=say(note.words)) for note in drawing.notes),
        dimensions=tuple(map(dimension, drawing.dimensions)),
    )


def _in_other_units(dimension: Dimension, words: str, size: float) -> str:
    """The dimension's words with its figures in a unit of ``size`` [mm]; the one that it measures from its own length,
    not from its text, which is rounded."""
    (x1, y1), (x2, y2) = dimension.start, dimension.end
    measured = {"x": abs(x2 - x1), "y": abs(y2 - y1)}.get(dimension.axis, math.hypot(x2 - x1, y2 - y1))

    def converted(figure: re.Match[str]) -> str:
        value = float(figure[0])
        return f"{(measured if float(f'{measured:.5g}') == value else value) / size:.5g}"

    return _FIGURE.sub(converted, words)


def rectangle(left: float, bottom: float, right: float, top: float, layer: Layer = Layer.OUTLINE) -> Line:
    """A rectangle."""
    return Line(((left, bottom), (right, bottom), (right, top), (left, top)), layer, closed=True)


def words_of(symbol: str, value: float) -> str:
    """The text of a dimension: symbol and value."""
    return f"{symbol} {value:.5g}".strip()


def given(request: Mapping[str, Any], path: str) -> Any:
    """The value at a dotted path of a possibly incomplete request; None if missing."""
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
    """The number at a path if it can be drawn and is not negative."""
    value = signed(request, path)
    return value if value is not None and value >= 0.0 else None


def signed(request: Mapping[str, Any], path: str) -> float | None:
    """The number at a path if it is 0 or of a size that can be drawn."""
    value = given(request, path)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    return float(value) if value == 0 or 1e-7 <= abs(value) <= 1e7 else None
