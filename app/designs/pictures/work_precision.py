"""The picture of an accuracy study: error against time, both logarithmic."""

from __future__ import annotations

from typing import Any

from app.designs.pictures.chart import BLUE, GREEN, GREY, Chart, decades_around

LEAST_ERROR = 1e-17
"""Where an error of zero is drawn: below the rounding of any result."""


def work_precision(run: dict[str, Any]) -> str:
    """SVG of the levels that gave an answer, the cheapest sufficient one marked; failed levels are left out."""
    levels = [level for level in run["result"]["levels"] if level["error"] is not None]
    wanted, chosen = run["accuracy"]["requested"], run["result"]["recommended"]
    times = [level["time_median_s"] * 1e3 for level in levels]
    errors = [max(level["error"], LEAST_ERROR) for level in levels]
    chart = Chart(
        "What accuracy costs: error against time",
        decades_around(times or [1.0]),
        decades_around([*errors, wanted]),
        "time, median of the runs, ms",
        "greatest relative error",
    )
    across = decades_around(times or [1.0])
    chart.line([across.low, across.high], [wanted, wanted], GREY, dashes="4 3")
    chart.words(across.low * 1.05, wanted, "asked for")
    order = sorted(range(len(levels)), key=lambda i: -levels[i]["accuracy"])
    chart.line([times[i] for i in order], [errors[i] for i in order])
    for level, time, error in zip(levels, times, errors, strict=True):
        best = chosen is not None and level["accuracy"] == chosen["accuracy"]
        chart.mark(time, error, f"{level['accuracy']:.0e}", GREEN if best else BLUE)
    return chart.svg()
