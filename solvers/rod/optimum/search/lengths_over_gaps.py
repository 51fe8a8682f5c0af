"""Lengths over gaps between resonances where the thickness comes from a stock.

A path of sizes chosen at will (``gaps``) leads to thicknesses that are not to be had. So strips of many lengths are
checked in rows, over a few gaps to both sides: of the best strip's width and thickness, and of those next to it in
stock, around the best strip that the core has of them. Where a row has a minimum about as good as the best strip, sizes
close by may be better than that.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from solvers.rod.optimum.core.optimum import polish
from solvers.rod.optimum.full_model.corrections import frequency_slopes, log_frequency_ratio
from solvers.rod.optimum.search.at_ratio import PENALTY
from solvers.rod.optimum.search.full_optimum import Context
from solvers.rod.optimum.search.local_search import Iterate, excess_of
from solvers.rod.problem import Bounds
from solvers.rod.scene import Dimensions

_GAPS, _PER_GAP = 2, 8
"""So many gaps are looked into to each side, at so many lengths each, unless steps are longer."""
_DEARER = 0.008
"""In ln objective: minima that are dearer by more than the best strip are not promising."""
_DOUBT = 0.03
"""In ln of objective and limits: what the corrected core may be wrong by, at another thickness."""
_MOST = 4
"""Minima that are looked into."""


def promising_lengths(context: Context, best: Iterate) -> list[Dimensions]:
    """Where rows of lengths near the best strip have their minima, if they are about as good, the best first."""
    out = []
    for row in _rows(context, best):
        merits = [_merit(context, d) for d in row]
        for k, (merit, d) in enumerate(zip(merits, row, strict=True)):
            if merit == min(merits[max(k - 1, 0) : k + 2]) and merit < best.log_cost + _DEARER:
                out.append((merit, d))
    known = best.outcome.value.dimensions
    return [d for _, d in sorted(out, key=lambda one: one[0])[:_MOST] if d != known]


def _rows(context: Context, best: Iterate) -> Iterator[list[Dimensions]]:
    """Strips of lengths around the best one's and, of each thickness near its own, around the best by the core as the
    full model corrects it."""
    check, cycle, sizes = best.outcome.value, best.memory.active.home_cycle, context.sizes
    d, bounds, limits = check.dimensions, context.bounds, context.core_limits_at(check.dimensions, check, -_DOUBT)
    beyond = context.beyond_core(d)
    gap = math.exp(-log_frequency_ratio(cycle)) / abs(frequency_slopes(cycle)[2])
    for height in sizes.stock_near(d.h, 1):
        middle = d
        if height != d.h:
            alone = Bounds(bounds.b, (height, height), bounds.l)
            found = polish(context.cycle.coarse, context.problem.objective, limits, alone, _at(context, d, height, d.l))
            if found is None or found.log_cost + beyond > best.log_cost + _DOUBT:
                continue
            middle = _at(context, found.dimensions, height, found.dimensions.l)
        stride = gap * middle.l / _PER_GAP
        if sizes.step_l is not None:
            stride = sizes.step_l * max(round(stride / sizes.step_l), 1)
        count, (low, high) = math.ceil(_GAPS * gap * middle.l / stride), bounds.l
        some = [_at(context, middle, height, middle.l + k * stride) for k in range(-count, count + 1)]
        yield sorted({d for d in some if low <= d.l <= high}, key=lambda d: d.l)


def _at(context: Context, d: Dimensions, height: float, length: float) -> Dimensions:
    """A strip's width with a thickness and a length, as far as these are to be had."""
    near = context.sizes.around(Dimensions(d.b, height, length))
    wished = ((d.b, near.b), (height, near.h), (length, near.l))
    return Dimensions(*(min(max(size, low), high) for size, (low, high) in wished))


def _merit(context: Context, d: Dimensions) -> float:
    """The ln objective of a strip's check, with a penalty for what it misses limits by."""
    outcome = context.model.check(d)
    if outcome.value.stresses is None:
        return math.inf
    return context.cost(outcome) + PENALTY * excess_of(context.task, outcome.value, context.model.scene)
