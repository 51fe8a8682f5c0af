"""Strips with the least violation of the requirements, if none is known that meets them all."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import chain

import numpy as np

from solvers.rod import rows
from solvers.rod.constraints import Limits
from solvers.rod.objectives import MASS
from solvers.rod.optimum.core.cycle import CoreCycle
from solvers.rod.optimum.core.local_optimum import dimensions_within
from solvers.rod.optimum.full_model.strip import logarithms
from solvers.rod.optimum.peaks import RequiredResults
from solvers.rod.optimum.search.context import Context
from solvers.rod.optimum.search.local_search import Iterate, LocalResult
from solvers.rod.optimum.sqp import feasibility_program, required_results, run_slsqp
from solvers.rod.problem import Bounds
from solvers.rod.scene import Dimensions

_SPREAD_FRACTIONS = np.array([[0.5, 0.5, 0.5], [0.75, 0.25, 0.25], [0.25, 0.75, 0.75]])
"""Further starts on the core, as fractions of the bounds' logarithms: Sobol's sequence."""
_ROUNDS, _ITERATIONS, _TOLERANCE = 4, 30, 1e-3
_SAME_EXCESS = 1e-2
"""Difference of the excesses below which two searches agree."""
POSSIBLY_FEASIBLE = 10.0
"""Multiple of a search's accuracy: an excess below that may vanish at a higher one."""


def least_violation(cycle: CoreCycle, limits: Limits, bounds: Bounds) -> tuple[float, Dimensions] | None:
    """The minimum over strips of the largest logarithmic excess over the core's limits, and its strip.

    Local searches, restricted to strips that do not buckle, from the stiffest strip and from strips spread over the
    bounds, until two of them agree. None if every strip tried buckles.
    """
    best: tuple[float, Dimensions] | None = None
    for start in chain([bounds.stiffest], _spread_strips(cycle, limits, bounds)):
        result = _local_minimum(cycle, limits, bounds, start)
        if result is None:
            continue
        if best is not None and abs(result[0] - best[0]) < _SAME_EXCESS:
            return min(result, best, key=lambda result: result[0])
        best = result if best is None else min(result, best, key=lambda result: result[0])
    return best


def _local_minimum(
    cycle: CoreCycle, limits: Limits, bounds: Bounds, start: Dimensions
) -> tuple[float, Dimensions] | None:
    """Result of one local search; peaks are located again at every iterate until it converges."""
    required, box, strip = required_results(MASS, limits), bounds.logarithms, start
    peaks, best = cycle.peaks(strip, required), None
    for _ in range(_ROUNDS):
        active, x = cycle.rows_near(peaks, required), logarithms(strip)
        p, values = feasibility_program(limits, active.layout), active.values(x)
        if values[rows.STABILITY] >= 0.0:
            break
        excess = p.cost(values)
        if best is None or excess < best[0]:
            best = excess, strip
        step = run_slsqp(active, p, box, x, _TOLERANCE, _ITERATIONS)
        if not step.cost < best[0] - _TOLERANCE:
            break
        strip = dimensions_within(bounds, step.x)
        peaks = cycle.peaks(strip, required).merged_with(peaks)
    return best


def least_violating(context: Context, start: Dimensions, clearly_infeasible: bool) -> LocalResult | None:
    """The feasible strip with the least cost of all local searches on the full model, or the least violating one.

    The search starts at ``start``. None if every strip tried buckles. If ``clearly_infeasible``, ``start`` is only
    checked. With resonances all but the last step is done at low accuracy.
    """
    if clearly_infeasible:
        iterate = checked_without_model(context, start)
        return None if iterate is None else LocalResult(iterate, math.inf)
    coarse = context.coarse or context.exploratory(start)
    if not coarse.results:
        coarse.search_from(start, context.sizes.bounds)
    best = coarse.best()
    if coarse is context or best is None or best.feasible:
        return best
    strip = best.at.dimensions
    error = max(POSSIBLY_FEASIBLE * coarse.model.accuracy, best.at.outcome.accuracy.estimated)
    if best.at.excess < error:
        return context.search_from(strip, context.sizes.bounds)
    iterate = checked_without_model(context, strip)
    return best if iterate is None else LocalResult(iterate, math.inf)


def checked_without_model(context: Context, strip: Dimensions) -> Iterate | None:
    """The iterate of a strip with its check, without the model of its rows; None if it buckles."""
    outcome = context.model.check(strip)
    return None if outcome.value.stresses is None else context.task.iterate(outcome)


def _spread_strips(cycle: CoreCycle, limits: Limits, bounds: Bounds) -> Iterator[Dimensions]:
    """Strips spread evenly over the bounds, with thicknesses at which they do not buckle on the core."""
    no_results = RequiredResults(False, False, False)
    low, high = bounds.logarithms.T
    for x in low + (high - low) * _SPREAD_FRACTIONS:
        strip = Dimensions(*np.exp(x).tolist())
        shortfall = cycle.rows(strip, no_results)[rows.STABILITY] - limits[rows.STABILITY]
        thicker = min(strip.h * math.exp(max(shortfall, 0.0) / 3.0) * 1.01, bounds.h[1])
        yield Dimensions(strip.b, thicker, strip.l)
