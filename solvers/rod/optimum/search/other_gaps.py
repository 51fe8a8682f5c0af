"""The search of other gaps between resonances, and the refinement of its results.

Gaps are searched at low accuracy; the best results are refined at full accuracy.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from solvers.rod.optimum.full_model.frequency_ratio import log_frequency_ratio
from solvers.rod.optimum.full_model.strip import logarithms
from solvers.rod.optimum.search.context import Context
from solvers.rod.optimum.search.feasibility import checked_without_model
from solvers.rod.optimum.search.gaps import MAX_EXTRA_COST, Gaps
from solvers.rod.optimum.search.local_search import TOTAL_GAIN_RATIO, LocalResult, is_among
from solvers.rod.optimum.search.optimum import Optimum
from solvers.rod.problem import Bounds
from solvers.rod.scene import Dimensions

_MAX_GAP_SEARCHES, _MAX_GAP_FAILURES, _GAP_RADIUS = 16, 6, 0.01
"""Maximum numbers of searches in other gaps, in all and in succession without improvement; their first radius, in ln b,
ln h, ln l."""
_TIE = 5e-3
"""Difference in ln objective within which a result in another gap starts a search path of its own."""
_FINE_RADIUS = 2e-3
"""First radius of searches at full accuracy, in ln b, ln h, ln l."""
_MAX_CANDIDATES = 3
"""Maximum number of coarse results that are refined at full accuracy."""


def search_other_gaps(
    context: Context, bounds: Bounds, origins: Sequence[LocalResult] = ()
) -> tuple[float, tuple[float, float] | None]:
    """Search other gaps between resonances than the best strip's, until several searches in succession bring no
    improvement, or none that may bring more than the negligible gain; those next to further ``origins`` that are about
    as good, too. Returns the estimated gain in ln objective that remains, and the minimum and maximum frequency ratio
    searched."""
    gaps, gain, failed = Gaps(context.task, bounds), 0.0, 0
    for origin in sorted((o.at for o in origins if o.feasible), key=lambda at: at.log_cost):
        if origin.log_cost < context.best().at.log_cost + MAX_EXTRA_COST:
            gaps.exclude(origin)
            gaps.add_path(origin)
    is_untried = lambda d: not is_among(logarithms(d), context.results)  # noqa: E731
    for _ in range(_MAX_GAP_SEARCHES):
        best = context.best()
        finished = best is None or not best.feasible or failed == _MAX_GAP_FAILURES
        start = None if finished else gaps.next_start(best.at, is_untried)
        if start is None:
            return 0.0 if finished else gaps.remaining_gain(best.at), gaps.range
        result = context.search_from(start, bounds, _GAP_RADIUS, incumbent=best.at.log_cost)
        if result is not None:
            gaps.exclude(result.at)
            is_tie = result.feasible and result.at.log_cost < best.at.log_cost + _TIE
            if is_tie and not is_among(logarithms(start), [result]):
                gaps.add_path(result.at)
        gain = best.at.log_cost - context.best().at.log_cost
        failed = 0 if gain > context.task.min_gain else failed + 1
    return gain, gaps.range


def refined_best(
    context: Context, results: list[LocalResult], bounds_of: Callable[[Dimensions], Bounds]
) -> LocalResult | None:
    """The best result after refining coarse ones at full accuracy within bounds: the best and those that are worse by
    less than their errors and possible further gains."""
    candidates = _refinement_candidates(results, 1.0 if context.model.is_excited_by_corners else TOTAL_GAIN_RATIO)
    finer = context.finer(candidates[0].at.dimensions)
    for strip in [result.at.dimensions for result in candidates]:
        finer.search_from(strip, bounds_of(strip), _FINE_RADIUS, incumbent=finer.incumbent)
    return finer.best()


def optimum_near(context: Context, strip: Dimensions) -> Optimum | None:
    """The result of searches at full accuracy from a known strip alone, within its slice of discrete sizes."""
    coarse, iterate = context.exploratory(strip), checked_without_model(context, strip)
    if iterate is None:
        return None
    best = refined_best(context, [LocalResult(iterate, math.inf)], context.sizes.around)
    if best is None:
        return None
    coarse.results.append(best)
    ratio = math.exp(log_frequency_ratio(best.at.rows.base_cycle))
    return Optimum(best, ratio_range=(ratio, ratio))


def _refinement_candidates(results: list[LocalResult], total_gain_ratio: float) -> list[LocalResult]:
    """The best result, and those of other strips that may be as good if they gain ``total_gain_ratio`` times the
    predicted gain."""

    def uncertainty(result: LocalResult) -> float:
        return result.at.outcome.accuracy.estimated + total_gain_ratio * result.predicted_gain

    first, *others = sorted(results, key=lambda result: (result.at.excess, result.at.log_cost))
    if not first.feasible:
        return [first]
    best_upper, out = first.at.log_cost + first.at.outcome.accuracy.estimated, [first]
    for result in others:
        may_be_best = result.feasible and result.at.log_cost - uncertainty(result) < best_upper
        if may_be_best and not is_among(result.at.x, out):
            out.append(result)
    return out[:_MAX_CANDIDATES]
