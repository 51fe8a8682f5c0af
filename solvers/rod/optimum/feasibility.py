"""Strips that violate the requirements least, where none is known that meets them all."""

from __future__ import annotations

import math

import numpy as np

from solvers.rod import rows
from solvers.rod.constraints import Limits
from solvers.rod.optimum.core_cycle import CoreCycle
from solvers.rod.optimum.full_model import logarithms
from solvers.rod.optimum.full_optimum import Context
from solvers.rod.optimum.local_search import Iterate, Local, excess_of
from solvers.rod.optimum.proof.outer_approximation import Sizes, search
from solvers.rod.problem import OBJECTIVES
from solvers.rod.scene import Dimensions

SPREAD = 3
"""Starts beside the core's least violating strip."""
_FIRST, _GREATEST = 0.02, 5.0
_CLOSE = 0.1
_GAP, _BOXES = 1e-2, 500
_HOPELESS = 0.1
"""Beyond this excess, in logarithms, no further starts are tried."""


def least_violation(cycle: CoreCycle, limits: Limits, sizes: Sizes) -> tuple[float, Dimensions] | None:
    """About the least excess by which the core can miss every limit at once, in logarithms, and a strip that does.

    Limits are let out together until there is a strip, then drawn in by bisection to about ``_CLOSE`` of the excess;
    stability never beyond buckling. None where every strip buckles.
    """

    def within(excess: float) -> Dimensions | None:
        most = {rows.STABILITY: -1e-6}
        relaxed = {row: min(limit + excess, most.get(row, math.inf)) for row, limit in limits.items()}
        best = search(cycle, OBJECTIVES["mass"], relaxed, sizes, _GAP, _BOXES).best
        return None if best is None else best.dimensions

    low, high = 0.0, _FIRST
    while (strip := within(high)) is None:
        if high > _GREATEST:
            return None
        low, high = high, 3.0 * high
    while high - low > _CLOSE * high + 1e-3:
        middle = 0.5 * (low + high)
        closer = within(middle)
        if closer is None:
            low = middle
        else:
            high, strip = middle, closer
    return high, strip


def least_violating(context: Context, start: Dimensions, hopeless: bool = False) -> Local | None:
    """The end of local searches for an admissible strip on the full model, from ``start`` and from spread strips.

    The best admissible one, or the least violating; None where every strip tried buckles. Where it is ``hopeless``,
    ``start`` is checked and nothing else.
    """
    if hopeless:
        at = checked_only(context, start)
        return None if at is None else Local(at, math.inf, 0)
    context.search_from(start, context.bounds)
    best = context.best()
    if best is not None and (best.found is not None or best.best.excess > _HOPELESS):
        return best
    for strip in _spread(context):
        context.search_from(strip, context.bounds)
        best = context.best()
        if best is not None and best.found is not None:
            break
    return best


def checked_only(context: Context, strip: Dimensions) -> Iterate | None:
    """A strip with its check and no model around it; None if it buckles."""
    outcome, task, scene = context.model.check(strip), context.task, context.model.scene
    if outcome.value.stresses is None:
        return None
    cost = task.objective.log_cost(outcome.value, scene.material.density)
    return Iterate(logarithms(strip), outcome, cost, excess_of(task, outcome.value, scene), None, task.limits)


def _spread(context: Context) -> list[Dimensions]:
    """Strips spread evenly over the bounds (I. M. Sobol's sequence), the thickness such that they stand on the core."""
    from scipy.stats.qmc import Sobol

    b = context.bounds
    low, high = np.log([b.b, b.h, b.l]).T
    out = []
    for x in low + (high - low) * Sobol(3, scramble=False).random(8)[1:]:
        strip = Dimensions(*np.exp(x).tolist())
        core = context.cycle.following(context.cycle.peaks(strip, context.model.wanted), context.model.wanted)
        missing = core.values(logarithms(strip))[rows.STABILITY] - context.task.limits[rows.STABILITY]
        thicker = min(strip.h * math.exp(max(missing, 0.0) / 3.0) * 1.01, b.h[1])
        out.append(Dimensions(strip.b, thicker, strip.l))
    return out[:SPREAD]
