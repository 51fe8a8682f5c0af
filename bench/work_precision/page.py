"""docs/accuracy.md and its diagrams from measured curves: one section per kind, each with the date of its run."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence

from app.designs.pictures.chart import BLUE, GREEN, GREY, RED, Chart, decades_around
from bench.work_precision.curves import MIN_ERROR, Curve, Point

_COLORS = (BLUE, RED, GREEN, "#9a6700", "#7b3fa0", GREY)
_TARGETS = (1e-3, 1e-6, 1e-9)


def diagram(title: str, curves: Sequence[Curve]) -> str:
    """SVG of the median error against the median time of every method, both logarithmic."""
    points = [p for curve in curves for p in curve.points if _answered(p)]
    drawn = [(c, color, dashes) for c, color, dashes in _styled(curves) if any(map(_answered, c.points))]
    legend = {(curve.part or curve.name): color for curve, color, _ in drawn}
    chart = Chart(
        title,
        decades_around([p.time * 1e3 for p in points]),
        decades_around([max(p.error, MIN_ERROR) for p in points]),
        "time per case, median, ms",
        "greatest relative error, median",
        legend=list(legend.items()),
    )
    for curve, color, dashes in drawn:
        found = [p for p in curve.points if _answered(p)]
        xs, ys = [p.time * 1e3 for p in found], [max(p.error, MIN_ERROR) for p in found]
        chart.line(xs, ys, color, dashes)
        for x, y in zip(xs, ys, strict=True):
            chart.mark(x, y, "", color)
    return chart.svg()


def _styled(curves: Sequence[Curve]) -> Iterator[tuple[Curve, str, str]]:
    """A colour per part of a page, with peers dashed; without parts, per curve."""
    parts = list(dict.fromkeys(curve.part or curve.name for curve in curves))
    for curve in curves:
        own = curve is next(c for c in curves if (c.part or c.name) == (curve.part or curve.name))
        yield curve, _COLORS[parts.index(curve.part or curve.name) % len(_COLORS)], "" if own else "6 4"


def _answered(point: Point) -> bool:
    return math.isfinite(point.error)


def table(curves: Sequence[Curve]) -> Iterator[str]:
    """Markdown rows of every setting, then what each method takes to reach an error, part by part."""
    parts = list(dict.fromkeys(curve.part for curve in curves))
    first = "| part | method" if any(parts) else "| method"
    yield f"{first} | setting | time, median | goal | error, median | error, worst | cases | without answer |"
    yield "|---" * (first.count("|") + 7) + "|"
    for curve in curves:
        of = f"{curve.part} | {curve.name}" if curve.part else curve.name
        for p in curve.points:
            goal = "" if p.goal is None else shown_time(p.goal)
            yield (
                f"| {of} | {p.setting} | {shown_time(p.time)} | {goal} | {_shown(p.error)} | {_shown(p.worst)} | "
                f"{p.cases} | {p.failures} |"
            )
    for part in parts:
        yield ""
        yield from _reached(part, [curve for curve in curves if curve.part == part])


def _reached(part: str, curves: Sequence[Curve]) -> Iterator[str]:
    """The cheapest setting of each method that reaches an error, relative to the first method."""
    of = f"{part}: to" if part else "to"
    yield f"| {of} reach a median error of | " + " | ".join(curve.name for curve in curves) + " |"
    yield "|---" * (len(curves) + 1) + "|"
    for target in _TARGETS:
        best = [curve.cheapest(target) for curve in curves]
        ours = best[0]
        cells = []
        for found in best:
            if found is None:
                cells.append("not reached")
            elif ours is None or found is ours:
                cells.append(shown_time(found.time))
            else:
                cells.append(f"{shown_time(found.time)} ({found.time / ours.time:.3g} times)")
        yield f"| {target:g} | " + " | ".join(cells) + " |"


def written(page: str, head: str, order: Sequence[str], sections: Mapping[str, str]) -> str:
    """Replace these sections by title; the others are unchanged."""
    old = re.findall(r"^## (.+?)\n(.*?)(?=^## |\Z)", page, re.MULTILINE | re.DOTALL)
    known = {title: f"## {title}\n{body}" for title, body in old} | sections
    return "\n".join([head, *(known[title].rstrip() + "\n" for title in order if title in known)])


def shown_time(seconds: float) -> str:
    """A time with a suitable unit."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def _shown(error: float) -> str:
    return f"{error:.0e}" if math.isfinite(error) else "none"
