"""Chart of a run's effects: estimated influence, decision, and measured change."""

from __future__ import annotations

from typing import Any

from app.designs.pictures.chart import BLUE, GREEN, GREY, RED, Categories, Chart, Say, decades_around

_MIN_INFLUENCE, _MAX_INFLUENCE = 1e-9, 1e1
"""Range of the axis; a bar that reaches the right edge is larger or unknown."""
_LEFT = 24


def effect_bars(run: dict[str, Any], say: Say = str) -> str:
    """SVG with a bar per effect, as long as its influence: blue if it was computed, grey if not.

    In an accuracy study, a dot shows the measured change and a label the time.
    """
    effects = run["effects"]
    influences = [_drawn(effect["influence"]) for effect in effects]
    costs = {cost["name"]: cost for cost in (run["result"] or {}).get("effect_costs", [])}
    chart = Chart(
        say("Effects: estimated influence of each"),
        decades_around([*influences, 0.1 * _tolerance(run), 1.0]),
        Categories([""] * len(effects)),
        say("estimated relative change of the results (dot: measured)")
        if costs
        else say("estimated relative change of the results"),
        "",
        left=_LEFT,
    )
    tolerance = _tolerance(run)
    for number, (effect, influence) in enumerate(zip(effects, influences, strict=True)):
        name = say(effect["name"].replace("_", " "))
        chart.bar(influence, number, BLUE if effect["state"] == "active" else GREY, name)
        cost = costs.get(effect["name"])
        if cost and cost["change"] is not None:
            chart.mark(_drawn(cost["change"]), number, _price(cost), GREEN)
    chart.line([tolerance, tolerance], [-0.5, len(effects) - 0.5], RED, dashes="4 3")
    chart.words(tolerance, -0.5, say("tolerance"), RED)
    return chart.svg()


def _tolerance(run: dict[str, Any]) -> float:
    spec = run["spec"].get("spec", run["spec"])
    return float(spec["effect_tolerance"])


def _drawn(value: float | None) -> float:
    return _MAX_INFLUENCE if value is None else min(max(value, _MIN_INFLUENCE), _MAX_INFLUENCE)


def _price(cost: dict[str, Any]) -> str:
    return f"{(cost['time_with_s'] - cost['time_without_s']) * 1e3:+.3g} ms"
