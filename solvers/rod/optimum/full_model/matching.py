"""The strip that the full model wants, found by a search that knows only gas load, inertia, beam-column and contact.

The search's limits are shifted by what the full model says at the strip found, and the search is done again until both
agree. What the effects beyond the search's physics change, they change by a little more or less at the next strip: in
the end the search's results are tilted as well (``solvers.rod.optimum.full_model.tilt``), and the strip moves to where
the full model's own slopes balance.
"""

from __future__ import annotations

import math
from dataclasses import replace

from solvers.rod.optimum.full_model.found import (
    AGREED,
    BOXES,
    GUARD,
    SAFE,
    Evaluate,
    Found,
    apart,
    cost,
    limits_of,
    meets,
    own_cost,
    shifted_limits,
)
from solvers.rod.optimum.full_model.scout import scout
from solvers.rod.optimum.full_model.settling import settled
from solvers.rod.optimum.machine import Machine
from solvers.rod.optimum.proof.outer_approximation import Proof, Sizes, search
from solvers.rod.optimum.sqp import Limits, Polished, matters, polish
from solvers.rod.problem import RodProblem

_CORRECTIONS = 6
_COARSE = (1e-2, 1e-2, 1e-4)
"""Accuracies of the first looks at the full model."""
_STEEPEST = 0.5


def on_full_model(
    problem: RodProblem,
    machine: Machine,
    limits: Limits,
    sizes: Sizes,
    evaluate: Evaluate,
    accuracy: float,
    beyond_core: bool,
) -> tuple[Found | None, Proof]:
    """Search, look at the full model, shift the limits by the difference, and again until both agree.

    Where the full model is more than the search's own physics, the first looks are coarse ones: the strip still moves.
    From the second look on the shift is that of a secant, since the difference itself changes with the strip.
    """
    objective = problem.objective
    coarse = [a for a in _COARSE if a > accuracy] if beyond_core else []
    guard = GUARD * accuracy if beyond_core else 0.0
    enough = AGREED * accuracy if beyond_core else 0.1 * accuracy
    proof = search(machine, objective, limits, sizes, accuracy, BOXES)
    best, found, before = proof.best, None, None
    for look in range(_CORRECTIONS + len(coarse)):
        if best is None:
            break
        final = look >= len(coarse)
        outcome = evaluate(best.dimensions, min(accuracy, 1e-6) if final else coarse[look])
        if outcome.value.stresses is None:
            limits, before, change = replace(limits, stability=1.1 * limits.stability), None, math.inf
        else:
            shifted = shifted_limits(problem, best, outcome.value, guard)
            change = apart(shifted, limits)
            if final and meets(outcome.value, problem.requirements):
                better = found is None or cost(objective, outcome.value) < cost(objective, found.outcome.value)
                found = Found(best, outcome, limits, proof, shifted) if better else found
                if change <= enough or not better:
                    break
            limits, before = _secant(before, (limits, shifted)), (limits, shifted)
        if change > 0.05 * accuracy or sizes.discrete:
            # The optimum itself may move elsewhere, and its bound with it.
            proof = search(machine, objective, limits, sizes, accuracy, BOXES)
            best = proof.best
        else:
            best = polish(machine, objective, limits, sizes.around(best.dimensions), best.dimensions)
    if beyond_core:
        found = found or _scouted(problem, machine, sizes, evaluate, accuracy)
        found = found and settled(problem, machine, sizes, found, evaluate, accuracy)
    return found, proof


def _scouted(problem: RodProblem, machine: Machine, sizes: Sizes, evaluate: Evaluate, accuracy: float) -> Found | None:
    """An admissible strip that no search led to."""
    objective = problem.objective
    strip = scout(lambda d: evaluate(d, _COARSE[0]).value, sizes, problem.requirements, objective)
    if strip is None:
        return None
    outcome = evaluate(strip, min(accuracy, 1e-6))
    if outcome.value.stresses is None or not meets(outcome.value, problem.requirements):
        return None
    focus, angles = machine.focus_at(strip.b, strip.h, strip.l, matters(objective, limits_of(problem)))
    best = Polished(strip, 0.0, focus, angles)
    best = replace(best, log_cost=own_cost(objective, best))
    limits = shifted_limits(problem, best, outcome.value, -GUARD * accuracy)
    return Found(best, outcome, limits, search(machine, objective, limits, sizes, accuracy, BOXES), limits)


def _secant(before: tuple[Limits, Limits] | None, now: tuple[Limits, Limits]) -> Limits:
    """Where shifted limits will be equal to the limits that they come from, by one look or by two."""
    if before is None:
        return now[1]
    values = {}
    for name in Limits.__dataclass_fields__:
        points = [getattr(limits, name) for limits in (*before, *now)]
        values[name] = points[3]
        if None in points:
            continue
        x0, g0, x1, g1 = map(math.log, points)
        # Neighbouring floats may have the same logarithm.
        if x0 != x1:
            slope = min(max((g1 - g0) / (x1 - x0), -_STEEPEST), _STEEPEST)
            values[name] = math.exp(x1 + (g1 - x1) / (1.0 - slope))
    return Limits(**values | {"stability": max(values["stability"], SAFE)})
