"""Charts: valid SVG, elements positioned by scale, escaped text."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import pytest

from app.designs.pictures.chart import (
    BOTTOM,
    HEIGHT,
    LEFT,
    RIGHT,
    TOP,
    WIDTH,
    Chart,
    Linear,
    Logarithmic,
    around,
    decades_around,
)
from app.words.units import System, measuring

DOT = re.compile(r'<circle cx="([\d.]+)" cy="([\d.]+)"')


def dot(chart: Chart) -> tuple[float, float]:
    x, y = DOT.search(chart.svg()).groups()
    return float(x), float(y)


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (10.0, 1.0), (5.0, 0.5), (2.5, 0.25)])
def test_a_mark_stands_where_the_scales_say(x, y):
    chart = Chart("t", Linear(0, 10), Linear(0, 1), "x", "y")
    chart.mark(x, y)
    across, up = dot(chart)
    assert across == pytest.approx(LEFT + x / 10 * (WIDTH - LEFT - RIGHT), abs=0.06)
    assert up == pytest.approx(HEIGHT - BOTTOM - y * (HEIGHT - TOP - BOTTOM), abs=0.06)


@pytest.mark.parametrize("length", [5, 20, 38, 50])
@pytest.mark.parametrize("x", [0.0, 2.0, 4.0, 5.0, 6.0, 8.0, 10.0])
def test_a_label_stays_within_its_picture(x, length):
    chart = Chart("t", Linear(0, 10), Linear(0, 1), "x", "y")
    chart.mark(x, 0.5, "m" * length)
    chart.words(x, 0.2, "m" * length)
    labels = re.findall(r'<text x="([\d.]+)" y="[\d.]+" text-anchor="(start|end)"[^>]*>m+<', chart.svg())
    assert len(labels) == 2
    for at, side in labels:
        begin = float(at) - (7.2 * length if side == "end" else 0.0)
        assert begin >= 0.0 and begin + 7.2 * length <= WIDTH


def test_decades_are_equally_long():
    scale = Logarithmic(1e-8, 1e4)
    assert scale.place(1e-2) == pytest.approx(0.5)
    assert scale.place(0.0) == 0.0
    assert [words for _, words in Logarithmic(1e-2, 1e1).ticks()] == ["1e-2", "1e-1", "1e0", "1e1"]


@pytest.mark.parametrize(
    ("scale", "ticks"),
    [
        (Linear(0.1, 1.0), ["0.2", "0.4", "0.6", "0.8", "1.0"]),
        (Linear(0.0, 16.0), ["0", "5", "10", "15"]),
        (Linear(-0.003, 0.004), ["-0.002", "0.000", "0.002", "0.004"]),
    ],
)
def test_ticks_are_round_numbers(scale, ticks):
    assert [words for _, words in scale.ticks()] == ticks


@pytest.mark.parametrize("values", [[0.0], [3.0, 3.0], [-1.0, 4.0], [1e-300], [1e9, 2e9]])
def test_scales_around_values_hold_them(values):
    scale = around(values)
    assert scale.low < scale.high
    assert all(scale.low <= v <= scale.high for v in values)
    positive = [v for v in values if v > 0]
    if positive:
        decades = decades_around(positive)
        assert all(decades.low <= v * (1 + 1e-9) and v <= decades.high * (1 + 1e-9) for v in positive)
        assert decades.low < decades.high


def test_a_legend_names_every_color_below_the_axes_and_the_picture_is_as_high_as_it_takes():
    named = [("first way", "#111111"), ("second way", "#222222"), ("third way", "#333333")]
    chart = Chart("t", Linear(0, 10), Linear(0, 1), "x", "y", legend=named)
    root = ElementTree.fromstring(chart.svg())
    height = float(root.attrib["viewBox"].split()[3])
    shown = [(e.text, e.attrib["fill"], float(e.attrib["y"])) for e in root if e.text and "way" in e.text]
    assert [(name, color) for name, color, _ in shown] == named
    rows = [HEIGHT, *(y for _, _, y in shown), height]
    assert rows == sorted(set(rows))


def test_words_are_escaped_and_the_svg_is_well_formed():
    chart = Chart("a < b & c", around([1.0, 2.0]), around([0.0]), "<x>", "y & z")
    chart.line([1.0, 2.0], [0.0, 0.0], dashes="4 3")
    chart.area([1.0, 2.0, 2.0], [0.0, 0.0, 1.0])
    chart.mark(1.5, 0.0, "<script>")
    chart.words(1.0, 0.0, '"quoted"')
    root = ElementTree.fromstring(chart.svg())
    assert root.tag.endswith("svg")
    assert "<script>" not in chart.svg()


@pytest.mark.parametrize(("scale", "middle"), [(Linear(0.0, 50.8), 25.4), (Logarithmic(2.54, 254.0), 25.4)])
def test_an_axis_of_a_metric_unit_is_in_the_unit_shown(scale, middle):
    chart = Chart("", scale, Linear(0.0, 1.0), "length, mm", "share")
    with measuring(System.INCH):
        inches = Chart("", scale, Linear(0.0, 1.0), "length, mm", "share")
    for each in (chart, inches):
        each.mark(middle, 0.5)
    assert dot(inches) == dot(chart)
    assert "length, in<" in inches.svg() and "length, mm<" in chart.svg()
    tick = re.search(r'<text x="([\d.]+)" y="326" [^>]*>(?:1|1\.0|1e0)<', inches.svg())
    assert float(tick[1]) == dot(chart)[0]


@pytest.mark.parametrize("most", [1.0, 9e3, 1.5e5, 2e7])
def test_labels_of_ticks_keep_off_the_label_of_the_axis(most):
    svg = Chart("", Linear(0.0, 1.0), Linear(-most, most), "x", "y").svg()
    ticks = re.findall(r'<text x="([\d.]+)" y="[\d.]+" text-anchor="end"[^>]*>([^<]+)<', svg)
    assert len(ticks) > 2
    assert all(float(end) - 8 * len(words) >= 22 for end, words in ticks)
