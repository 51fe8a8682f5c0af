"""Plot of a design's feasible region over free length and thickness, at the width found."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.designs.flexible_rod.cycle_pictures import request_of, settled
from app.designs.flexible_rod.request import Requirements
from app.designs.pictures.chart import BLUE, GREEN, GREY, RED, Chart, Linear, Say, noted
from app.designs.pictures.contours import inside, level_lines
from app.designs.units import MILLI, quantity, si
from solvers import rod
from solvers.errors import InvalidInput
from solvers.fatigue import CRITERIA
from solvers.rod.constraints import Constraint

_POINTS_PER_SIDE = 7
"""Number of grid points on either side of the design."""
_STABILITY_SLOPE = 0.6
"""Approximate d ln h/d ln l at constant critical force."""
_ZERO_MARGIN = 1e-3
"""Logarithmic margin treated as zero: the design lies on the limit."""
_ACCURACY = 1e-2
_PLOT_RANGE = (0.7, 1.4)
"""Plot range relative to the design."""
_MAX_MARGIN = 2.0
"""Logarithmic margins are clamped to this; values far from the limit do not affect the contour."""

_LINES = {
    "min_stability_safety": (noted("buckling"), RED),
    "min_fatigue_safety": (noted("fatigue"), BLUE),
    "min_yield_safety": (noted("yield"), "#8a5a00"),
    "max_contact_pressure": (noted("contact pressure"), GREY),
    "max_friction_power": (noted("friction power"), GREY),
}
"""Name and color of each requirement's limit."""
Array = NDArray[np.float64]


def is_design(run: dict[str, Any]) -> bool:
    """Whether the run has bounds and requirements."""
    return run["mode"] == "design"


def _axis(bounds: list[float], found: float) -> Array:
    """Grid points between the bounds, denser near the design, where the region may have a corner."""
    low, high = max(bounds[0], _PLOT_RANGE[0] * found), min(bounds[1], _PLOT_RANGE[1] * found)
    if high - low < 1e-9 * found:
        low, high = 0.9 * found, 1.1 * found
    share = np.linspace(0.0, 1.0, _POINTS_PER_SIDE + 1) ** 2
    return np.unique(np.concatenate([found - (found - low) * share, found + (high - found) * share]))


def _margin(check: rod.RodCheck, limit: Constraint, required: float, scene: rod.Scene) -> float:
    """Logarithm of the ratio to the requirement; NaN if the strip buckles."""
    if check.stresses is None and limit.name != "min_stability_safety":
        return math.nan
    margin = limit.log_limit(required, scene) - limit.result.log_cost(check, scene)
    return min(max(margin, -_MAX_MARGIN), _MAX_MARGIN)


def feasible_region(run: dict[str, Any], say: Say = str) -> str:
    """SVG of the feasible region, each requirement's limit, and the design."""
    spec, dimensions = run["spec"], run["result"]["dimensions"]
    asked = rod.Requirements(**si(Requirements.model_validate(spec["requirements"]))).requested()
    request = request_of(run)
    scene, width = request.scene(), dimensions["b_mm"] * MILLI
    criterion = CRITERIA[request.fatigue_criterion](scene.material)
    effects = settled(run)
    (shortest, longest), whole = spec["bounds"]["l_mm"], spec["mechanism"]["rod_length_mm"]
    lengths = _axis([shortest, min(longest, whole)], dimensions["l_mm"])
    lengths = lengths[lengths <= whole]
    low, high = spec["bounds"]["h_mm"]
    # The grid follows the line of equal stability, along which the region often ends in a narrow corner.
    levels = _axis([low, high], dimensions["h_mm"])
    thicknesses = np.clip(
        np.outer(levels, (lengths / dimensions["l_mm"]) ** _STABILITY_SLOPE), min(low, levels[0]), max(high, levels[-1])
    )
    lines = [_LINES[limit.name] for limit, _ in asked]
    margins = np.full((len(asked), *thicknesses.shape), np.nan)
    for i in range(levels.size):
        for j, length in enumerate(lengths):
            try:
                strip = rod.Dimensions(width, thicknesses[i, j] * MILLI, length * MILLI)
                check = rod.check(scene, strip, effects, request.effect_tolerance, _ACCURACY, criterion).value
            except InvalidInput:
                continue
            for k, (limit, required) in enumerate(asked):
                margins[k, i, j] = _margin(check, limit, required, scene)
    x, y = Linear(lengths[0], lengths[-1]), Linear(levels[0], levels[-1])
    title = say("Feasible region at b = {}").format(quantity(dimensions["b_mm"], "mm", 4))
    legend = [(say("{}: exactly what is required").format(say(words)), color) for words, color in lines]
    legend.append((say("every requirement holds"), GREEN))
    by_mass = run["result"]["objective"] == "mass"
    if by_mass:
        legend.append((say("dotted: of the same mass"), GREY))
    chart = Chart(title, x, y, say("free length l, mm"), say("thickness h, mm"), legend=legend)
    across = np.broadcast_to(lengths, thicknesses.shape)
    allowed = np.where(np.isnan(margins), -_MAX_MARGIN, margins + _ZERO_MARGIN).min(axis=0)
    for polygon in inside(across, thicknesses, allowed):
        chart.area(*polygon, color=GREEN)
    for k, (_, color) in enumerate(lines):
        for line in level_lines(across, thicknesses, margins[k]):
            chart.line(*line, color=color)
    if by_mass:
        equal = dimensions["h_mm"] * dimensions["l_mm"] / lengths
        there = (equal >= levels[0]) & (equal <= levels[-1])
        if there.sum() > 1:
            chart.line(lengths[there].tolist(), equal[there].tolist(), GREY, dashes="3 4")
    chart.mark(dimensions["l_mm"], dimensions["h_mm"], say("the design"), GREEN)
    return chart.svg()
