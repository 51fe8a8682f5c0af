"""Limits that cost much: the last search once more, with checks that are as much finer.

Where a limit moves by e, ln objective at the optimum changes by its multiplier times e. So what a check leaves unknown
of a result, and the distance that a search keeps from the limit, count so many times. Multipliers are about 1 mostly;
close to what is attainable, where two limits leave little room, they are hundreds.
"""

from __future__ import annotations

from dataclasses import replace

from solvers.rod.constraints import BY_NAME
from solvers.rod.optimum.search.full_optimum import Context, Optimum, conditions_at
from solvers.rod.optimum.search.local_search import local_search
from solvers.rod.problem import Bounds

_SHARE = 0.3
"""Of the accuracy: what the errors of the finer checks may be worth."""
_RADIUS = 1e-4
"""The first radius of the search, in ln b, ln h, ln l: the strip is known to far less."""


def error_of(context: Context, optimum: Optimum) -> float:
    """Estimated error of the best strip's objective, in its logarithm.

    The sum of the error of its check, the gain that is not worth a step, what may be left in other gaps or along
    limits, and what the distance from limits and the error of the check are worth there.
    """
    local, second = optimum.local, optimum.second_order
    check = local.best.outcome.accuracy.estimated
    left = max(local.gain, context.task.enough) + optimum.left + (0.0 if second is None else second.gain)
    return check + left + _cost_of_limits(optimum) * (context.task.guard + check)


def with_finer_checks(context: Context, optimum: Optimum, within: Bounds) -> tuple[Context, Optimum]:
    """The optimum led on within bounds with checks so fine that their errors matter no longer, and the context of that
    search; both as they are where the accuracy is met, or where no check has it."""
    best, accuracy = optimum.local.best, context.model.accuracy
    finer = _SHARE / max(_cost_of_limits(optimum), _SHARE)
    if finer == 1.0 or error_of(context, optimum) <= accuracy or best.outcome.accuracy.estimated > accuracy:
        return context, optimum
    task = replace(context.task, guard=finer * context.task.guard)
    model = context.model.at_accuracy(finer * accuracy)
    if model.rings:
        model = model.finer(None if model.textured else context.rough.model)
    sharper = replace(context, model=model, task=task, rough=None)
    local = local_search(sharper.model, task, within, best.x, _RADIUS)
    if local is None or local.found is None:
        return context, optimum
    conditions = conditions_at(sharper, local.best, context.bounds, within)
    return sharper, replace(optimum, local=local, conditions=conditions)


def _cost_of_limits(optimum: Optimum) -> float:
    """The change of ln objective where all active limits move by as much, per unit of ln limit."""
    active = () if optimum.conditions is None else optimum.conditions.active
    return sum(abs(a.sensitivity) for a in active if a.name in BY_NAME)
