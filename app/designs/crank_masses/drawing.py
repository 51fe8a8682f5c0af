"""Drawing of the rod's measurement: on a knife edge, or on two supports."""

from __future__ import annotations

from typing import Any

from app.designs.drawing import Circle, Dimension, Drawing, Layer, Line, Note, length, words_of


def drawing(request: dict[str, Any]) -> Drawing | None:
    """The set-up, to scale between the ends; the rod's width is only illustrative."""
    if request.get("method") == "estimate":
        bore = length(request, "bore_mm")
        if not bore:
            return None
        half = 0.5 * bore
        across = Dimension((-half, 0.0), (half, 0.0), words_of("ø", bore), "x", -half, -1, "bore_mm")
        axes = [
            Line(((-1.1 * half, 0.0), (1.1 * half, 0.0)), Layer.CENTER),
            Line(((0.0, -1.1 * half), (0.0, 1.1 * half)), Layer.CENTER),
        ]
        return Drawing("The bore, to scale", (Circle((0.0, 0.0), half), *axes), (across,), caption="mm, to scale.")
    swings = request.get("method") == "pendulum"
    field = "pivot_distance_mm" if swings else "length_mm"
    long = length(request, field)
    if not long:
        return None
    small, big = 0.08 * long, 0.14 * long
    shapes = [
        Circle((0.0, 0.0), small),
        Circle((long, 0.0), big),
        Circle((0.0, 0.0), 1.6 * small),
        Circle((long, 0.0), 1.45 * big),
        Line(((1.5 * small, 0.5 * small), (long - 1.4 * big, 0.7 * small))),
        Line(((1.5 * small, -0.5 * small), (long - 1.4 * big, -0.7 * small))),
        Line(((-2.2 * small, 0.0), (long + 1.7 * big, 0.0)), Layer.CENTER),
    ]
    dimension = Dimension((0.0, 0.0), (long, 0.0), words_of("", long), "x", -1.45 * big, -1, field)
    if swings:
        shapes += [_edge(small, 0.0, small), _edge(long - big, 0.0, small)]
        dimension = Dimension((small, 0.0), (long - big, 0.0), words_of("", long), "x", -1.45 * big, -1, field)
        words, caption = "small end", "Knife edges carry the rod, one end after the other; turned by 90° to lie here."
        return Drawing("The rod on its knife edges", tuple(shapes), (dimension,), _ends(words, long, big), caption)
    low = -1.45 * big
    shapes += [_support(0.0, low, small), _support(long, low, small)]
    caption = "The rod lies level on two supports under its pin centres, one of them a scale."
    return Drawing("The rod on two supports", tuple(shapes), (dimension,), _ends("small end", long, big), caption)


def _ends(small_words: str, long: float, big: float) -> tuple[Note, ...]:
    return (Note((0.0, 1.7 * big), small_words), Note((long, 1.7 * big), "big end"))


def _edge(x: float, y: float, size: float) -> Line:
    return Line(((x, y), (x - 0.5 * size, y - 0.25 * size), (x - 0.5 * size, y + 0.25 * size)), Layer.SECTION, True)


def _support(x: float, y: float, size: float) -> Line:
    return Line(((x, y), (x - 0.6 * size, y - size), (x + 0.6 * size, y - size)), Layer.SECTION, True)
