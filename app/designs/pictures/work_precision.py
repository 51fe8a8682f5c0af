"""Work-precision diagram of an accuracy study: error against time, both logarithmic."""

from __future__ import annotations

from itertools import groupby
from typing import Any

from app.designs.pictures.chart import BLUE, GREEN, GREY, RED, Chart, Say, Scale, decades_around, factors_around
from app.designs.units import power

MIN_ERROR = 1e-17
"""Position of a zero error, below the rounding error of any result."""

_NAME_WIDE, _NAME_HIGH = 0.35, 0.05
"""Size of a label relative to the chart."""


def work_precision(run: dict[str, Any], say: Say = str) -> str:
    """SVG of the levels from loose to tight: the recommended one green, the tightest proof with its gap, failed levels
    as gaps in the line. An error below the reference's uncertainty is drawn at that, marked ≤."""
    result = run["result"]
    levels = sorted(result["levels"], key=lambda level: -level["accuracy"])
    there = [level for level in levels if level["error"] is not None]
    wanted = run["accuracy"]["requested"]
    chosen, proven = (result[name] and result[name]["accuracy"] for name in ("recommended", "certified"))
    across = factors_around([_time(level) for level in there] or [1.0])
    down = decades_around([*map(_error, there), wanted])
    chart = Chart(
        say("Error against computing time"),
        across,
        down,
        say("time, median of the runs, ms"),
        say("greatest relative error"),
    )
    chart.line([across.low, across.high], [wanted, wanted], GREY, dashes="4 3")
    chart.words(across.low * 1.05, wanted, say("asked for"))
    for failed, run_of_levels in groupby(levels, lambda level: level["error"] is None):
        if not failed:
            stretch = list(run_of_levels)
            chart.line([_time(level) for level in stretch], [_error(level) for level in stretch])
    names = {group[-1]["accuracy"]: _name(group, proven, say) for group in _groups(there, across, down)}
    for level in there:
        color = GREEN if level["accuracy"] == chosen else RED if level["accuracy"] == proven else BLUE
        chart.mark(_time(level), _error(level), names.get(level["accuracy"], ""), color)
    return chart.svg()


def _groups(levels: list[dict[str, Any]], across: Scale, down: Scale) -> list[list[dict[str, Any]]]:
    """Groups of levels whose labels would overlap, the slowest of each last."""
    groups: list[list[dict[str, Any]]] = []
    for level in sorted(levels, key=_time):
        for group in groups:
            first = group[0]
            beside = abs(across.place(_time(level)) - across.place(_time(first))) < _NAME_WIDE
            if beside and abs(down.place(_error(level)) - down.place(_error(first))) < _NAME_HIGH:
                group.append(level)
                break
        else:
            groups.append([level])
    return groups


def _name(levels: list[dict[str, Any]], proven: float | None, say: Say) -> str:
    """Label of a group: its accuracies and tightest proof."""
    asked = [level["accuracy"] for level in levels]
    name = power(max(asked)) if len(asked) == 1 else f"{power(max(asked))} … {power(min(asked))}"
    if all(level["at_most"] for level in levels):
        name = f"≤ {name}"
    gaps = [level["proven_gap"] for level in levels if level["accuracy"] == proven]
    return say("{}, {} proven to {}").format(name, power(proven), power(gaps[0])) if gaps else name


def _time(level: dict[str, Any]) -> float:
    return level["time_median_s"] * 1e3


def _error(level: dict[str, Any]) -> float:
    return max(level["error"], MIN_ERROR)
