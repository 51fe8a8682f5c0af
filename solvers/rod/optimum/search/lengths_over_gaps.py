"""Lengths in other gaps between resonances, for thicknesses from a stock.

A path of continuous sizes (``gaps``) leads to thicknesses that are not available. Therefore rows of strips of many
lengths are checked over a few gaps to both sides: with the best strip's width and thickness, and with neighbouring
thicknesses around the core's best strip of each; a row is continued as long as the best of its strips lie in its last
gap. If a row has a minimum about as good as the best strip, sizes near it may be better.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from solvers.rod.optimum.core.local_optimum import polish
from solvers.rod.optimum.full_model.frequency_ratio import log_frequency_ratio, log_frequency_ratio_gradient
from solvers.rod.optimum.search.at_ratio import PENALTY
from solvers.rod.optimum.search.context import Context
from solvers.rod.optimum.search.local_search import Iterate
from solvers.rod.problem import Bounds
from solvers.rod.scene import Dimensions

_GAPS, _FURTHER_GAPS, _PER_GAP = 2, 6, 8
"""Number of gaps to each side at first, of further ones, and of lengths per gap unless their step is longer."""
_MAX_EXTRA_COST = 0.008
"""Excess in ln objective over the best strip above which minima are not promising."""
_MODEL_ERROR = 0.03
"""Error of the corrected core in ln of objective and limits, at another thickness."""
_MAX_MINIMA = 4
"""Maximum number of minima returned."""


def promising_lengths(context: Context, best: Iterate) -> list[Dimensions]:
    """Minima of rows of lengths near the best strip that are about as good, the best first."""
    out = []
    for centre in _centres(context, best):
        row = _row(context, centre, best)
        merits = [merit for merit, _ in row]
        for k, (merit, d) in enumerate(row):
            if merit == min(merits[max(k - 1, 0) : k + 2]) and merit < best.log_cost + _MAX_EXTRA_COST:
                out.append((merit, d))
    best_strip = best.dimensions
    return [d for _, d in sorted(out, key=lambda minimum: minimum[0])[:_MAX_MINIMA] if d != best_strip]


def _centres(context: Context, best: Iterate) -> Iterator[Dimensions]:
    """The best strip and, for each neighbouring thickness, the optimum of the corrected core."""
    check, sizes = best.outcome.value, context.sizes
    d, bounds = check.dimensions, context.sizes.bounds
    limits = context.corrected_core_limits(check, -_MODEL_ERROR)
    correction = context.objective_correction(check)
    for height in sizes.stock_near(d.h, 1):
        centre = d
        if height != d.h:
            slice_bounds = Bounds(bounds.b, (height, height), bounds.l)
            start = _available_strip(context, d, height, d.l)
            optimum = polish(context.cycle, context.problem.objective, limits, slice_bounds, start)
            if optimum is None or optimum.log_cost + correction > best.log_cost + _MODEL_ERROR:
                continue
            centre = _available_strip(context, optimum.dimensions, height, optimum.dimensions.l)
        yield centre


def _row(context: Context, centre: Dimensions, best: Iterate) -> list[tuple[float, Dimensions]]:
    """Merits and strips of a row of lengths around a strip, in the order of length."""
    cycle, step, (shortest, longest) = best.rows.base_cycle, context.sizes.step_l, context.sizes.bounds.l
    gap = centre.l * math.exp(-log_frequency_ratio(cycle)) / abs(log_frequency_ratio_gradient(cycle)[2])
    stride = gap / _PER_GAP
    if step is not None:
        stride = step * max(round(stride / step), 1)
    per_gap = math.ceil(gap / stride)
    row: dict[float, tuple[float, Dimensions]] = {}

    def check(numbers: range) -> None:
        for k in numbers:
            length = min(max(centre.l + k * stride, shortest), longest)
            d = _available_strip(context, centre, centre.h, length)
            if d.l not in row and shortest <= d.l <= longest:
                row[d.l] = _merit(context, d), d

    low, high = -_GAPS * per_gap, _GAPS * per_gap
    check(range(low, high + 1))
    # No length need be available within the bounds: a multiple of a step may exceed one by rounding.
    for _ in range(_FURTHER_GAPS if row else 0):
        ordered = sorted(row)
        place = ordered.index(min(row, key=lambda l: row[l][0]))
        if place < per_gap:
            check(range(low - per_gap, low))
            low -= per_gap
        elif place >= len(ordered) - per_gap:
            check(range(high + 1, high + per_gap + 1))
            high += per_gap
        if len(row) == len(ordered):
            break
    return [row[length] for length in sorted(row)]


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
    return context.task.cost(outcome.value) + PENALTY * context.task.excess(outcome.value)
