"""The optimum of continuous sizes on the full model: starting points of the local searches, and selection among their
results.

The core's global optimum is the first start. With resonances its optima at other lengths (``other_lengths``) and the
gaps between resonances (``other_gaps``) are searched as well. Without, if the active limits leave directions free, the
curvature of the Lagrangian along them is evaluated (``optimality``); a Newton step with a predicted gain, or steps to
both sides along negative curvature, give further starts. Discrete sizes: see ``discrete_sizes``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from solvers.rod.optimum.full_model.strip import dimensions_of
from solvers.rod.optimum.search.context import Context
from solvers.rod.optimum.search.optimality import CURVATURE_STEP, first_order_conditions, second_order
from solvers.rod.optimum.search.optimum import Optimum
from solvers.rod.optimum.search.other_gaps import refined_best, search_other_gaps
from solvers.rod.optimum.search.other_lengths import optima_at_other_lengths
from solvers.rod.scene import Dimensions

_COARSE_ITERATIONS = 6
"""Maximum iterations of the first searches with resonances, which others follow."""
_NEWTON_STEPS = 4


def continuous_optimum(context: Context, starts: Sequence[Dimensions]) -> Optimum | None:
    """The best strip of continuous sizes; its iterate is infeasible if no feasible strip is found."""
    exploratory = context.exploratory(starts[0])
    earlier = context.earlier
    if earlier is not None and earlier.complete and exploratory.search_again():
        return _refined(context, exploratory, earlier.optimum.remaining_gain, earlier.optimum.ratio_range)
    max_iterations = _COARSE_ITERATIONS if exploratory.model.has_resonances else None
    costly = context.model.is_excited_by_corners
    for start in starts:
        best = exploratory.best()
        if best is not None and best.feasible and start == context.sizes.bounds.stiffest and costly:
            # It is only there to find a feasible strip, and under a noisy load a search from it is long.
            continue
        exploratory.search_from(start, context.sizes.bounds, max_iterations=max_iterations)
    local = exploratory.best()
    if local is None or not local.feasible:
        return None if local is None else Optimum(local)
    if exploratory is not context:
        context.confirm_effects(local)
        return _optimum_over_gaps(context, exploratory)
    for _ in range(_NEWTON_STEPS):
        local = context.best()
        conditions = first_order_conditions(context, local.at)
        second = second_order(local.at, conditions, context.sizes.bounds)
        if second.predicted_gain <= context.task.min_gain:
            break
        for step in second.steps:
            start = dimensions_of(local.at.x + step, context.model.scene)
            context.search_from(start, context.sizes.bounds, CURVATURE_STEP)
        if local.at.log_cost - context.best().at.log_cost <= context.task.min_gain:
            # Searches from the predicted points refute the prediction.
            second = replace(second, predicted_gain=0.0)
            break
    return Optimum(context.best(), conditions, second)


def _optimum_over_gaps(context: Context, exploratory: Context) -> Optimum | None:
    """The best of the local optima between resonances: all of them at low accuracy, the best ones refined."""
    for start in optima_at_other_lengths(exploratory, exploratory.best().at):
        exploratory.search_from(start, context.sizes.bounds, max_iterations=_COARSE_ITERATIONS)
    gain, ratio_range = search_other_gaps(exploratory, context.sizes.bounds, exploratory.results)
    return _refined(context, exploratory, gain, ratio_range)


def _refined(
    context: Context, exploratory: Context, gain: float, ratio_range: tuple[float, float] | None
) -> Optimum | None:
    """The best result of the rough searches at full accuracy; ``gain`` may remain outside of the gaps searched."""
    best = refined_best(context, exploratory.results, lambda _: context.sizes.bounds)
    return None if best is None else Optimum(best, remaining_gain=gain, ratio_range=ratio_range)
