"""Lengths in other gaps between resonances, for thicknesses from a stock.

A path of continuous sizes (``gaps``) leads to thicknesses that are not available. Therefore rows of strips of many
lengths are checked over a few gaps to both sides: with the best strip's width and thickness, and with neighbouring
thicknesses around the core's best strip of each. If a row has a minimum about as good as the best strip, sizes near it
may be better.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from solvers.rod.optimum.core.optimum import polish
from solvers.rod.optimum.full_model.corrections import log_frequency_ratio, log_frequency_ratio_gradient
from solvers.rod.optimum.search.at_ratio import PENALTY
from solvers.rod.optimum.search.full_optimum import Context
from solvers.rod.optimum.search.local_search import Iterate, max_excess
from solvers.rod.problem import Bounds
from solvers.rod.scene import Dimensions

_GAPS, _PER_GAP = 2, 8
"""Number of gaps to each side, and of lengths per gap unless the step of lengths is longer."""
_MAX_EXTRA_COST = 0.008
"""Excess in ln objective over the best strip above which minima are not promising."""
_MODEL_ERROR = 0.03
"""Error of the corrected core in ln of objective and limits, at another thickness."""
_MAX_MINIMA = 4
"""Maximum number of minima returned."""


def promising_lengths(context: Context, best: Iterate) -> list[Dimensions]:
    """Minima of rows of lengths near the best strip that are about as good, the best first."""
    out = []
    for row in _rows_of_lengths(context, best):
        merits = [_merit(context, d) for d in row]
        for k, (merit, d) in enumerate(zip(merits, row, strict=True)):
            if merit == min(merits[max(k - 1, 0) : k + 2]) and merit < best.log_cost + _MAX_EXTRA_COST:
                out.append((merit, d))
    best_strip = best.outcome.value.dimensions
    return [d for _, d in sorted(out, key=lambda minimum: minimum[0])[:_MAX_MINIMA] if d != best_strip]


def _rows_of_lengths(context: Context, best: Iterate) -> Iterator[list[Dimensions]]:
    """Rows of strips with lengths around the best one's and, for each neighbouring thickness, around the optimum of the
    corrected core."""
    check, cycle, sizes = best.outcome.value, best.memory.active.base_cycle, context.sizes
    d, bounds = check.dimensions, context.bounds
    limits = context.corrected_core_limits(d, check, -_MODEL_ERROR)
    correction = context.objective_correction(d)
    gap = math.exp(-log_frequency_ratio(cycle)) / abs(log_frequency_ratio_gradient(cycle)[2])
    for height in sizes.stock_near(d.h, 1):
        centre = d
        if height != d.h:
            slice_bounds = Bounds(bounds.b, (height, height), bounds.l)
            start = _available_strip(context, d, height, d.l)
            optimum = polish(context.cycle, context.problem.objective, limits, slice_bounds, start)
            if optimum is None or optimum.log_cost + correction > best.log_cost + _MODEL_ERROR:
                continue
            centre = _available_strip(context, optimum.dimensions, height, optimum.dimensions.l)
        stride = gap * centre.l / _PER_GAP
        if sizes.step_l is not None:
            stride = sizes.step_l * max(round(stride / sizes.step_l), 1)
        count, (low, high) = math.ceil(_GAPS * gap * centre.l / stride), bounds.l
        strips = [_available_strip(context, centre, height, centre.l + k * stride) for k in range(-count, count + 1)]
        yield sorted({d for d in strips if low <= d.l <= high}, key=lambda d: d.l)


def _available_strip(context: Context, d: Dimensions, height: float, length: float) -> Dimensions:
    """The strip of available sizes closest to a width, a thickness and a length."""
    available = context.sizes.around(Dimensions(d.b, height, length))
    requested = ((d.b, available.b), (height, available.h), (length, available.l))
    return Dimensions(*(min(max(size, low), high) for size, (low, high) in requested))


def _merit(context: Context, d: Dimensions) -> float:
    """The ln objective of a strip's check, with a penalty for its excess over the limits."""
    outcome = context.model.check(d)
    if outcome.value.stresses is None:
        return math.inf
    return context.cost(outcome) + PENALTY * max_excess(context.task, outcome.value, context.model.scene)
