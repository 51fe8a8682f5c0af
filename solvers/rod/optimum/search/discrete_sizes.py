"""The optimum on the full model with discrete sizes: multiples of steps, or thicknesses from a stock.

The core's branch and bound covers discrete sizes exhaustively. Its limits are shifted by the difference between full
model and core at the strip found, and it is repeated until it returns a strip that the full model has evaluated. This
assumes the same difference for all strips. The neighbouring sizes of the best strip are therefore enumerated: those
that the core, corrected at that strip, predicts to be better or nearly feasible within its error are searched on the
full model (with the continuous sizes free, if any), the most promising first, and again around every better strip. With
resonances, other gaps between them are searched: along paths of continuous sizes if the thickness is continuous
(``gaps``), otherwise along rows of lengths (``lengths_over_gaps``). A slice is the set of strips with the same discrete
sizes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from solvers.rod.constraints import Limits
from solvers.rod.optimum.core.local_optimum import dimensions_within, polish
from solvers.rod.optimum.full_model.frequency_ratio import log_frequency_ratio_gradient
from solvers.rod.optimum.full_model.strip import logarithms
from solvers.rod.optimum.proof.outer_approximation import search
from solvers.rod.optimum.search.context import Context
from solvers.rod.optimum.search.gaps import Gaps
from solvers.rod.optimum.search.lengths_over_gaps import promising_lengths
from solvers.rod.optimum.search.local_search import Iterate, LocalResult
from solvers.rod.optimum.search.optimum import Optimum
from solvers.rod.optimum.search.other_gaps import refined_best, search_other_gaps
from solvers.rod.scene import Dimensions

_SHIFTS, _GAP, _MAX_BOXES = 5, 1e-3, 2000
"""Number of the core's searches under corrected limits; their gap in ln objective, and number of boxes."""
_MAX_NEIGHBOURS = 200
"""Maximum number of slices searched on the full model around one strip."""
_MODEL_ERROR_RATE = 0.3
"""Error of the corrected core in logarithms, per unit of distance in logarithms."""
_TOLERANCE = 1e-6
"""Tolerance of the corrected core's predictions in ln objective."""
_MAX_SLICES, _MAX_ROWS = 4, 6
"""Maximum number of slices searched in other gaps, and of rows of lengths."""
_MIN_DISTANCE = 0.02
"""Distance in ln b, ln h, ln l from all other points at which a slice is searched again."""
_NEIGHBOUR_STEPS = 2
"""Number of steps to each side that count as neighbouring sizes."""


def discrete_optimum(context: Context, starts: Sequence[Dimensions]) -> Optimum | None:
    """The best strip of available sizes; its iterate is infeasible if no feasible strip is found."""
    exploratory = context.exploratory(starts[0])
    # The search for a first feasible strip may have ended at sizes that are not available.
    exploratory.results = [r for r in exploratory.results if context.available(r.at.dimensions)]
    optimum = _optimum(exploratory, starts)
    if exploratory is context or optimum is None:
        return optimum
    local = refined_best(context, exploratory.results, context.sizes.around)
    return None if local is None else replace(optimum, local=local)


def _optimum(context: Context, starts: Sequence[Dimensions]) -> Optimum | None:
    tried: set[tuple[float, ...]] = set()
    earlier = context.earlier if context.earlier is not None and context.search_again() else None
    if earlier is None:
        _search_from_core(context, starts, tried)
    else:
        tried.update(_slice_key(context, end.at.dimensions) for end in earlier.ends)
    _improve_repeatedly(context, tried)
    best = context.best()
    if best is None:
        return None
    if not best.feasible:
        return Optimum(best)
    gain, ratio_range = 0.0, None
    if earlier is not None and earlier.complete:
        gain, ratio_range = earlier.optimum.remaining_gain, earlier.optimum.ratio_range
    elif context.model.has_resonances:
        context.confirm_effects(best)
        (_search_other_slices if context.sizes.stock_h is None else _search_lengths)(context, tried)
        strip = context.best().at.dimensions
        gain, ratio_range = search_other_gaps(context, context.sizes.around(strip))
    return Optimum(context.best(), remaining_gain=gain, ratio_range=ratio_range)


def _search_from_core(context: Context, starts: Sequence[Dimensions], tried: set[tuple[float, ...]]) -> None:
    """Search the slices of all starts, and from the first one those to which the corrected core leads."""
    strip, *others = starts
    for other in others:
        _search_slice(context, other, tried)
    for _ in range(_SHIFTS):
        result = _search_slice(context, strip, tried)
        if result is None:
            break
        limits = context.corrected_core_limits(result.at.outcome.value)
        best = search(context.cycle, context.problem.objective, limits, context.sizes, _GAP, _MAX_BOXES).best
        if best is None or _slice_key(context, best.dimensions) in tried:
            break
        strip = best.dimensions


def _search_other_slices(context: Context, tried: set[tuple[float, ...]]) -> None:
    """Search slices on paths over gaps other than the best strip's, and the neighbours of better strips."""
    gaps = Gaps(context.task, context.sizes.bounds, min_distance=0.0)
    for _ in range(_MAX_SLICES):
        best = context.best()
        start = gaps.next_start(best.at, lambda d: _is_new_slice(context, d, tried))
        if start is None:
            break
        if _search_slice(context, start, tried) is context.best():
            _improve_repeatedly(context, tried)


def _is_new_slice(context: Context, d: Dimensions, tried: set[tuple[float, ...]]) -> bool:
    """Whether the slice of a strip has not been searched, or only from points far from it."""
    x = logarithms(dimensions_within(context.sizes.around(d), logarithms(d)))
    points = [*context.start_points, *(result.at.x for result in context.results)]
    return _slice_key(context, d) not in tried or all(np.max(np.abs(x - other)) > _MIN_DISTANCE for other in points)


def _search_lengths(context: Context, tried: set[tuple[float, ...]]) -> None:
    """Search sizes near lengths in other gaps that are about as good as the best strip; repeat from a better strip of
    another width or thickness."""
    searched: set[tuple[float, float]] = set()
    for _ in range(_MAX_ROWS):
        best = context.best()
        d = best.at.dimensions
        if (d.b, d.h) in searched:
            return
        searched.add((d.b, d.h))
        for strip in promising_lengths(context, best.at):
            best, result = context.best(), _search_slice(context, strip, tried)
            if context.best() is not best or (result is not None and _search_neighbours(context, best, result, tried)):
                _improve_repeatedly(context, tried)


def _improve_repeatedly(context: Context, tried: set[tuple[float, ...]]) -> None:
    """Move to better neighbouring sizes until there are none."""
    best = context.best()
    while best is not None and _search_neighbours(context, best, best, tried):
        best = context.best()


def _slice_key(context: Context, d: Dimensions) -> tuple[float, ...]:
    """The discrete sizes of a strip's slice."""
    nearest = context.sizes.around(d)
    limits = (nearest.b, nearest.h, nearest.l)
    return tuple(round(math.log(low), 9) if low == high else 0.0 for low, high in limits)


def _search_slice(context: Context, strip: Dimensions, tried: set[tuple[float, ...]]) -> LocalResult | None:
    """Result of a local search over the continuous sizes in the slice of a strip."""
    tried.add(_slice_key(context, strip))
    incumbent = context.incumbent if context.model.has_resonances else math.inf
    return context.search_from(strip, context.sizes.around(strip), incumbent=incumbent)


def _search_neighbours(context: Context, best: LocalResult, centre: LocalResult, tried: set[tuple[float, ...]]) -> bool:
    """Search the neighbouring sizes of ``centre``, in the order of the corrected core's predictions, until one is
    better than ``best``; returns whether one is."""
    check = centre.at.outcome.value
    limits = context.corrected_core_limits(check)
    incumbent = best.at.log_cost if best.feasible else math.inf
    shift = context.objective_correction(check)
    promising = []
    for strip in _neighbours(context, check.dimensions):
        if _slice_key(context, strip) in tried:
            continue
        predicted = _predicted_cost(context, strip, check.dimensions, limits, shift)
        if predicted is not None and predicted[0] < incumbent:
            promising.append(predicted)
    promising.sort(key=lambda candidate: candidate[0])
    for _, strip in promising[:_MAX_NEIGHBOURS]:
        _search_slice(context, _at_same_frequency_ratio(context, strip, centre.at), tried)
        if context.best() is not best:
            return True
    return False


def _at_same_frequency_ratio(context: Context, strip: Dimensions, other: Iterate) -> Dimensions:
    """The strip of a slice with the frequency ratio of another strip, to first order, because the core contains no
    resonances; the strip itself without resonances or continuous sizes."""
    slice_bounds = context.sizes.around(strip)
    free = [high > low for low, high in (slice_bounds.b, slice_bounds.h, slice_bounds.l)]
    if not context.model.has_resonances or not any(free):
        return strip
    x, slope = logarithms(strip), log_frequency_ratio_gradient(other.rows.base_cycle)
    direction = np.where(free, slope, 0.0)
    return dimensions_within(slice_bounds, x - direction * float(slope @ (x - other.x)) / float(direction @ direction))


def _predicted_cost(
    context: Context, strip: Dimensions, centre: Dimensions, limits: Limits, cost_shift: float
) -> tuple[float, Dimensions] | None:
    """Lower estimate of ln objective in a strip's slice by the corrected core, and its strip; None if infeasible."""
    error = _MODEL_ERROR_RATE * float(np.max(np.abs(logarithms(strip) - logarithms(centre))))
    relaxed = {row: limit + error for row, limit in limits.items()}
    result = polish(context.cycle, context.problem.objective, relaxed, context.sizes.around(strip), strip, _TOLERANCE)
    if result is None:
        return None
    shift = 0.0 if context.problem.objective.is_geometric else error
    return result.log_cost - shift + cost_shift, result.dimensions


def _neighbours(context: Context, d: Dimensions) -> Iterator[Dimensions]:
    """Strips with sizes a few steps away from a strip's, within the bounds."""
    sizes, b = context.sizes, context.sizes.bounds
    lengths = _steps(d.l, sizes.step_l, b.l)
    for height in sizes.stock_near(d.h, _NEIGHBOUR_STEPS):
        # Of the same width, or of the same bending stiffness.
        stiff = min(max(d.b * (d.h / height) ** 3, b.b[0]), b.b[1])
        widths = {*_steps(d.b, sizes.step_b, b.b), *_steps(stiff, sizes.step_b, b.b)}
        for width, length in product(sorted(widths), lengths):
            yield Dimensions(width, height, length)


def _steps(size: float, step: float | None, limits: tuple[float, float]) -> list[float]:
    if step is None:
        return [size]
    nearest = round(size / step)
    sizes = [n * step for n in range(nearest - _NEIGHBOUR_STEPS, nearest + _NEIGHBOUR_STEPS + 1)]
    low, high = limits
    return [min(max(s, low), high) for s in sizes if low * (1 - 1e-12) <= s <= high * (1 + 1e-12)]
