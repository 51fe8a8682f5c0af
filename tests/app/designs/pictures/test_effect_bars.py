"""The bars of a run's effects."""

from __future__ import annotations

import re
from xml.etree import ElementTree

from app.designs.pictures.chart import BLUE, GREY
from app.designs.pictures.effect_bars import effect_bars

BAR = re.compile(r'<rect [^>]*width="([\d.]+)"[^>]*fill="(#\w+)"')

EFFECTS = [
    {"name": "beam_column", "state": "active", "influence": None, "why": ""},
    {"name": "large_displacement", "state": "active", "influence": 0.1, "why": ""},
    {"name": "shear", "state": "skipped", "influence": 1e-3, "why": ""},
    {"name": "rod_inertia", "state": "skipped", "influence": 0.0, "why": ""},
]


def run(costs: list[dict] | None = None) -> dict:
    return {"effects": EFFECTS, "spec": {"effect_tolerance": 1e-2}, "result": costs and {"effect_costs": costs}}


def test_bars_are_as_long_as_the_bounds_are_great():
    svg = effect_bars(run())
    ElementTree.fromstring(svg)
    widths, colors = zip(*BAR.findall(svg), strict=True)
    lengths = [float(width) for width in widths]
    assert lengths == sorted(lengths, reverse=True)
    assert lengths[-1] == 0.0
    assert colors == (BLUE, BLUE, GREY, GREY)
    assert "<circle" not in svg


def test_measured_changes_stand_on_the_bars():
    cost = {"name": "large_displacement", "change": 0.05, "time_with_s": 0.010, "time_without_s": 0.0078}
    missing = {"name": "shear", "change": None, "time_with_s": None, "time_without_s": None}
    svg = effect_bars(run([cost, missing]))
    assert svg.count("<circle") == 1
    assert "+2.2 ms" in svg
