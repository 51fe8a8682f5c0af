"""docs/accuracy.md and its diagrams, from measured curves."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from app.designs.pictures.chart import BLUE, GREEN, GREY, RED, Chart, decades_around
from bench.work_precision.curves import LEAST_ERROR, Curve, Point

_COLORS = (BLUE, RED, GREEN, "#9a6700", "#7b3fa0", GREY)
_TARGETS = (1e-3, 1e-6, 1e-9)


def diagram(title: str, curves: Sequence[Curve]) -> str:
    """SVG of the median error against the median time of every method, both logarithmic."""
    points = [p for curve in curves for p in curve.points if _answered(p)]
    answering = [(c, color) for c, color in zip(curves, _COLORS, strict=False) if any(map(_answered, c.points))]
    chart = Chart(
        title,
        decades_around([p.time * 1e3 for p in points]),
        decades_around([max(p.error, LEAST_ERROR) for p in points]),
        "time per case, median, ms",
        "greatest relative error, median",
        legend=[(curve.name, color) for curve, color in answering],
    )
    for curve, color in answering:
        found = [p for p in curve.points if _answered(p)]
        xs, ys = [p.time * 1e3 for p in found], [max(p.error, LEAST_ERROR) for p in found]
        chart.line(xs, ys, color)
        for x, y in zip(xs, ys, strict=True):
            chart.mark(x, y, "", color)
    return chart.svg()


def _answered(point: Point) -> bool:
    return math.isfinite(point.error)


def table(curves: Sequence[Curve]) -> Iterator[str]:
    """Markdown rows of every setting, then what each method takes to reach an error."""
    yield "| method | setting | time, median | error, median | error, worst | cases | without answer |"
    yield "|---|---|---|---|---|---|---|"
    for curve in curves:
        for p in curve.points:
            yield (
                f"| {curve.name} | {p.setting} | {shown_time(p.time)} | {_shown(p.error)} | {_shown(p.worst)} | "
                f"{p.cases} | {p.failures} |"
            )
    yield ""
    yield "| to reach a median error of | " + " | ".join(curve.name for curve in curves) + " |"
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


def shown_time(seconds: float) -> str:
    """With a unit that fits."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def _shown(error: float) -> str:
    return f"{error:.0e}" if math.isfinite(error) else "none"
