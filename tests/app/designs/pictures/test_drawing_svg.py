"""Texts of drawings keep off the part."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import combinations

import pytest

from app.designs.drawing import Dimension, Drawing, Line, worded
from app.designs.kind import Mode
from app.designs.pictures.drawing_svg import drawing_svg
from app.designs.registry import KINDS
from app.words.languages import gettext
from app.words.units import System, measuring

_TEXT = re.compile(
    r'<text x="([-\d.]+)" y="([-\d.]+)" text-anchor="(\w+)"[^>]*?(?:rotate\(([-\d.]+) [^>]*)?>([^<]+)</text>'
)


def part(height: float, at: float, level: int) -> Drawing:
    """A plate, 80 mm long, with a vertical dimension over the middle of its height."""
    outline = Line(((0.0, -10.0), (80.0, -10.0), (80.0, 10.0), (0.0, 10.0)), closed=True)
    size = Dimension((at, -0.5 * height), (at, 0.5 * height), "ø 6.12512345", "y", at, level)
    return Drawing("a plate", (outline,), (size,))


def text_of(svg: str, words: str) -> tuple[float, float, str, str]:
    """Place, anchor and turn of a text."""
    (found,) = [each for each in _TEXT.findall(svg) if each[4] == words]
    return float(found[0]), float(found[1]), found[2], found[3]


@pytest.mark.parametrize("height", [0.5, 4.0, 8.0])
@pytest.mark.parametrize(("at", "level"), [(80.0, 1), (0.0, -1)])
def test_a_long_text_beside_the_part_stands_along_its_line_on_the_far_side(height, at, level):
    svg = drawing_svg(part(height, at, level))
    line = {80.0: 430.0, 0.0: 0.0}[at] + 25.0 * level
    x, y, anchor, turn = text_of(svg, "ø 6.12512345")
    assert (turn, anchor, y) == ("-90.0", "middle", pytest.approx(0.5 * 20.0 * 430.0 / 80.0, abs=0.1))
    assert x > line + 10.0 if level > 0 else x < line


def test_a_long_text_within_the_part_is_beside_its_line_above_the_centre():
    x, y, anchor, turn = text_of(drawing_svg(part(8.0, 40.0, 0)), "ø 6.12512345")
    assert (x, anchor, turn) == (pytest.approx(220.0), "start", "") and y < 0.5 * 20.0 * 430.0 / 80.0
    narrow = text_of(drawing_svg(part(0.5, 40.0, 0)), "ø 6.12512345")
    assert narrow[1] < 0.5 * 20.0 * 430.0 / 80.0 - 14.0


def test_the_widths_of_a_strip_in_inches_stand_beside_it():
    kind = KINDS["flexible-rod"]
    with measuring(System.INCH):
        svg = drawing_svg(worded(kind.drawing(kind.example(Mode.DESIGN)), gettext))
    texts = _TEXT.findall(svg)
    assert {words[0] for *_, turn, words in texts if turn == "-90.0"} == {"ø", "b", "r"}
    places = sorted((float(x), 0.5 * 7.6 * len(words)) for x, _, _, _, words in texts if words.startswith("h"))
    (first, half), (second, other) = places
    assert first + half < second - other


@pytest.mark.parametrize("side", [1, -1])
def test_texts_of_vertical_dimensions_side_by_side_do_not_meet(side):
    inner = part(4.0, 80.0 if side > 0 else 0.0, side)
    (short,) = inner.dimensions
    long = replace(short, start=(short.at, -10.0), end=(short.at, 10.0), words="ø 20", level=2 * side)
    svg = drawing_svg(replace(inner, dimensions=(short, long)))
    # Turned, a text reaches from its place to the left.
    (first, *_), (second, *_) = text_of(svg, short.words), text_of(svg, long.words)
    assert abs(second - first) > 10.0


def test_a_dimension_in_inches_is_that_of_the_part_not_of_its_rounded_text():
    size = Dimension((0.0, -10.547177), (0.0, 10.547177), "ø 21.094", "y", 0.0, -1)
    outline = Line(((0.0, -10.0), (80.0, 10.0)))
    with measuring(System.INCH):
        (told,) = worded(Drawing("a plate", (outline,), (size,)), gettext).dimensions
    assert told.words == "ø 0.83049"


@pytest.mark.parametrize("small_end", [3.0, 14.0, 60.0])
def test_the_lengths_of_a_pins_seats_do_not_meet(small_end):
    kind = KINDS["pin-profile"]
    example = kind.example(Mode.CHECK)
    geometry = example["geometry"] | {"small_end_length_mm": small_end, "boss_length_mm": 0.5 * (78.0 - small_end)}
    svg = drawing_svg(kind.drawing(example | {"geometry": geometry}))
    heights = [float(y) for _, y, *_, words in _TEXT.findall(svg) if words.startswith(("boss", "small end", "gap"))]
    assert len(heights) == 3 and min(abs(a - b) for a, b in combinations(heights, 2)) > 14.0
