"""The picture of an accuracy study: error against time, both logarithmic."""

from __future__ import annotations

from itertools import groupby
from typing import Any

from app.designs.pictures.chart import BLUE, GREEN, GREY, RED, Chart, decades_around

LEAST_ERROR = 1e-17
"""Where an error of zero is drawn: below the rounding of any result."""


def work_precision(run: dict[str, Any]) -> str:
    """SVG of the levels from loose to tight: the one that will do in green, the closest proof with its gap, and a hole
    where a level failed. An error that is lost in what the reference may be off is drawn at that, marked ≤."""
    result = run["result"]
    levels = sorted(result["levels"], key=lambda level: -level["accuracy"])
    there = [level for level in levels if level["error"] is not None]
    wanted = run["accuracy"]["requested"]
    chosen, proven = (result[name] and result[name]["accuracy"] for name in ("recommended", "certified"))
    across = decades_around([_time(level) for level in there] or [1.0])
    chart = Chart(
        "What accuracy costs: error against time",
        across,
        decades_around([*map(_error, there), wanted]),
        "time, median of the runs, ms",
        "greatest relative error",
    )
    chart.line([across.low, across.high], [wanted, wanted], GREY, dashes="4 3")
    chart.words(across.low * 1.05, wanted, "asked for")
    for failed, run_of_levels in groupby(levels, lambda level: level["error"] is None):
        if not failed:
            stretch = list(run_of_levels)
            chart.line([_time(level) for level in stretch], [_error(level) for level in stretch])
    for level in there:
        name = f"{level['accuracy']:.0e}"
        if level["accuracy"] == proven:
            name += f", proven to {level['proven_gap']:.0e}"
        if level["at_most"]:
            name = f"≤ {name}"
        color = GREEN if level["accuracy"] == chosen else RED if level["accuracy"] == proven else BLUE
        chart.mark(_time(level), _error(level), name, color)
    return chart.svg()


def _time(level: dict[str, Any]) -> float:
    return level["time_median_s"] * 1e3


def _error(level: dict[str, Any]) -> float:
    return max(level["error"], LEAST_ERROR)
