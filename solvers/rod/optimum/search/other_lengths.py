"""Starts at other lengths: strips of the core that are nearly as good as its optimum.

The core's objective is often flat along a ridge on which the length changes, while vibration on the full model depends
on the length strongly. The paths between resonances (``gaps``) reach a fifth of the length; beyond that the core tells
where else to start.
"""

from __future__ import annotations

import math
from dataclasses import replace

from solvers.rod.optimum.core.local_optimum import Polished
from solvers.rod.optimum.proof.outer_approximation import search
from solvers.rod.optimum.search.context import Context
from solvers.rod.optimum.search.local_search import Iterate
from solvers.rod.scene import Dimensions

_RANGE = 0.2
"""Width in ln l of each range of lengths, about as far as a path over gaps leads."""
_MAX_EXTRA_COST = 5e-3
"""Excess in ln objective over the core's optimum near the best strip above which a strip is no start."""
_GAP, _MAX_BOXES = 3e-3, 300
"""Gap in ln objective and maximum number of boxes of the core's searches."""


def optima_at_other_lengths(context: Context, best: Iterate) -> list[Dimensions]:
    """The core's optima of the ranges of length to both sides of the best strip's, one after the other as long as they
    cost at most ``_MAX_EXTRA_COST`` more in ln objective.

    The core's limits are corrected by the full model's at the best strip.
    """
    d, found = best.dimensions, []
    limits = context.corrected_core_limits(best.outcome.value)

    def optimum(middle: float) -> Polished | None:
        low, high = (
            min(max(l, context.sizes.bounds.l[0]), context.sizes.bounds.l[1])
            for l in (middle * math.exp(-0.5 * _RANGE), middle * math.exp(0.5 * _RANGE))
        )
        if high <= low:
            return None
        sizes = replace(context.sizes, bounds=replace(context.sizes.bounds, l=(low, high)))
        return search(context.cycle, context.problem.objective, limits, sizes, _GAP, _MAX_BOXES).best

    reference = optimum(d.l)
    if reference is None:
        return found
    for direction in (-1.0, 1.0):
        middle = d.l
        while (point := optimum(middle := middle * math.exp(direction * _RANGE))) is not None:
            if point.log_cost > reference.log_cost + _MAX_EXTRA_COST:
                break
            found.append(point.dimensions)
    return found
