"""Limits with large Lagrange multipliers: the last search is repeated with correspondingly finer checks.

If a limit changes by e, ln objective at the optimum changes by its multiplier times e. The error of a result and the
margin that a search keeps from the limit are amplified in the same way. Multipliers are mostly about 1; near the
boundary of feasibility, where two limits leave little room, they reach hundreds.
"""

from __future__ import annotations

from dataclasses import replace

from solvers.rod.constraints import BY_NAME
from solvers.rod.optimum.search.context import Context
from solvers.rod.optimum.search.local_search import local_search
from solvers.rod.optimum.search.optimality import first_order_conditions
from solvers.rod.optimum.search.optimum import Optimum

_ERROR_SHARE = 0.3
"""Share of the accuracy that the amplified errors of the finer checks may take."""
_RADIUS = 1e-4
"""First trust-region radius of the search, in ln b, ln h, ln l."""


def objective_error(context: Context, optimum: Optimum) -> float:
    """Estimated error of the best strip's ln objective.

    The sum of the error of its check, the gain not worth a step or refuted by one, the gain that may remain in other
    gaps or along limits, and the margin and the error of the check times the multipliers of the limits.
    """
    result, second = optimum.local, optimum.second_order
    check = result.at.outcome.accuracy.estimated
    # Where checks miss the accuracy, slopes may be rough: what a rejected step promised may lie in another direction.
    refuted = result.refuted_gain if check > context.model.accuracy else 0.0
    gain = max(result.predicted_gain, refuted, context.task.min_gain) + optimum.remaining_gain
    gain += 0.0 if second is None else second.predicted_gain
    return check + gain + _sum_of_multipliers(optimum) * (context.task.margin + check)


def refine_checks(context: Context, optimum: Optimum) -> tuple[Context, Optimum]:
    """The optimum searched again with checks so fine that their amplified errors are negligible, and the context of
    that search; both unchanged if the accuracy is met, or if no check attains it."""
    best, accuracy = optimum.local.at, context.model.accuracy
    factor = _ERROR_SHARE / max(_sum_of_multipliers(optimum), _ERROR_SHARE)
    if factor == 1.0 or objective_error(context, optimum) <= accuracy or best.outcome.accuracy.estimated > accuracy:
        return context, optimum
    task = replace(context.task, margin=factor * context.task.margin)
    model = context.model.at_accuracy(factor * accuracy)
    if model.has_resonances:
        model = model.finer(None if model.is_excited_by_corners else context.coarse.model)
    refined = replace(context, model=model, task=task)
    result = local_search(model, task, context.sizes.around(best.dimensions), best.x, _RADIUS)
    if result is None or not result.feasible:
        return context, optimum
    conditions = first_order_conditions(refined, result.at)
    return refined, replace(optimum, local=result, conditions=conditions)


def _sum_of_multipliers(optimum: Optimum) -> float:
    """Change of ln objective per unit of ln limit if all active limits move equally."""
    active = () if optimum.conditions is None else optimum.conditions.active
    return sum(abs(a.sensitivity) for a in active if a.name in BY_NAME)
