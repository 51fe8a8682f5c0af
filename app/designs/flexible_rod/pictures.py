"""The paper's Fig. 2 with the design on it: critical parameter over free length."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from app.designs.pictures.chart import BLUE, RED, Chart, Linear, Say
from solvers.rod.strip.buckling import critical_parameter

MIN_RATIO, MAX_PARAMETER = 0.1, 16.0
_BUCKLES_AT, _LINE = 11.0, 1.2
"""Height of the word in the region of buckling, and of a line of text."""


def stability_map(run: dict[str, Any], say: Say = str) -> str:
    """SVG of u = L sqrt(P/EI) over l/L: the boundary, and the run's strip under its greatest compression."""
    result, spec = run["result"], run["spec"]
    ratio = result["dimensions"]["l_mm"] / spec["mechanism"]["rod_length_mm"]
    ratios = np.linspace(MIN_RATIO, 1.0, 181)
    boundary = [critical_parameter(ratio) for ratio in ratios]
    chart = Chart(
        say("Stability map: the strip and its buckling boundary"),
        Linear(MIN_RATIO, 1.0),
        Linear(0.0, MAX_PARAMETER),
        say("free length / rod length"),
        "L √(P/EI)",
    )
    chart.area([*ratios, 1.0, MIN_RATIO], [*boundary, MAX_PARAMETER, MAX_PARAMETER])
    chart.line(ratios, boundary, RED)
    safety, words_at = result["stability_safety"], _BUCKLES_AT
    if safety is not None and ratio >= MIN_RATIO:
        # P is proportional to u^2, so the strip is at u_cr/sqrt(n).
        critical = critical_parameter(min(ratio, 1.0))
        parameter = critical / math.sqrt(safety)
        chart.line([ratio, ratio], [parameter, critical], BLUE, dashes="4 3")
        chart.mark(ratio, parameter, f"n = {safety:.3g}", BLUE)
        if abs(parameter - words_at) < _LINE:
            words_at += 2.0 * _LINE
    chart.words(0.62, words_at, say("buckles"), RED)
    return chart.svg()
