"""Certificate of an answer: proof for the core, bound for the full model, local optimality on the full model.

The core's optimum is proven by branch and bound. A strip admissible on the full model is admissible on the core with
every limit relaxed by the bound of the effects beyond the core. The core's lower bound under these relaxed limits,
reduced by the same relative change of the objective, is therefore a lower bound for the full model. It relies on the
influence of the effects at the strips where that is evaluated.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from solvers.outcome import ActiveConstraint, Certificate
from solvers.rod import rows
from solvers.rod.constraints import BY_NAME
from solvers.rod.objectives import Objective
from solvers.rod.optimum.proof.outer_approximation import MAX_BOXES, Proof, search
from solvers.rod.optimum.search.context import Context
from solvers.rod.optimum.search.optimum import Optimum
from solvers.rod.scene import Dimensions, Scene

CORE_METHOD = "branch and bound over (ln tau, ln l)"
FULL_METHOD = "trust-region SQP on the full model, from the proven optimum of its core"
_PROOF_RESTS_ON = "ranges of the closed-form beam over boxes of (tau, l); monotone in b, h, l by energy"
_MAX_INFLUENCE = 0.9
"""Influence above which no bound is given."""
_GAP, _MAX_EVALUATIONS, _EXTRAPOLATION = 3e-3, 8, 0.5
"""Gap in ln objective of the relaxed searches, their greatest number, and by how much of its rise the influence is
extrapolated for the next."""

Evidence = dict[str, float | int | str]
Influence = Callable[[Dimensions], float]


def cost_of_shifts(shifts: Mapping[int, float], active: tuple[ActiveConstraint, ...]) -> float:
    """Change of ln objective due to shifts of the limits, by the multipliers."""
    return sum(abs(a.sensitivity * shifts.get(BY_NAME[a.name].row, 0.0)) for a in active if a.name in BY_NAME)


def core_certificate(objective: Objective, value: float | None, proof: Proof, gap: float) -> Certificate:
    """Certificate of an answer within the core's physics; ``gap`` in ln objective."""
    bound = math.inf if value is None else value * math.exp(-objective.sign * gap)
    return Certificate(CORE_METHOD, bound, math.expm1(gap), _proof(proof))


def infeasible_certificate(proof: Proof, beyond: tuple[str, ...], searches: int, excess: float) -> Certificate | None:
    """Certificate of infeasibility: proven for the core, on the full model based on searches only."""
    if not beyond:
        if not math.isfinite(proof.log_bound):
            evidence: Evidence = {"boxes": proof.boxes, "rests_on": "every box of (tau, l) violates a requirement"}
            return Certificate(CORE_METHOD, math.inf, 0.0, evidence)
        return None
    if not math.isfinite(proof.log_bound):
        core = "proven: no strip meets the requirements"
    else:
        core = "undecided: the search ended before it met one" if proof.best is None else "strips meet them"
    evidence = {
        "core": core,
        "boxes": proof.boxes,
        "effects_beyond_the_core": ", ".join(beyond),
        "full_model": "searched, not proven: the least violation of local searches" if searches else "not searched",
        "local_searches": searches,
    }
    if math.isfinite(excess):
        evidence["least_violation"] = math.expm1(excess)
    method = "local searches for the least violation on the full model" if searches else CORE_METHOD
    return Certificate(method, math.inf, 0.0, evidence)


def full_certificate(
    context: Context, proof: Proof, relaxed: float | None, influence: float, beyond: tuple[str, ...], optimum: Optimum
) -> Certificate:
    """Certificate of an answer on the full model; ``relaxed`` is the result of ``relaxed_bound``, or None."""
    objective, scene = context.problem.objective, context.problem.scene
    evidence: Evidence = {"effects_beyond_the_core": ", ".join(beyond)}
    if proof.best is not None:
        evidence |= {
            "core_optimum": objective.value_at(proof.best.log_cost, scene),
            "core_bound": objective.value_at(proof.log_bound, scene),
            "core_gap": math.expm1(max(proof.best.log_cost - proof.log_bound, 0.0)),
        }
    else:
        evidence["core"] = "no strip meets the requirements on the core's physics"
    evidence |= _proof(proof)
    evidence["full_model_bound"] = (
        f"the core's under limits relaxed by the effects' influence, {influence:.2g} where it was evaluated"
        if relaxed is not None
        else "none: the effects' influence is too great to tell"
    )
    if optimum.conditions is not None:
        evidence["kkt_residual"] = optimum.conditions.kkt_residual
        evidence["free_directions"] = len(optimum.conditions.tangent)
    if optimum.second_order is not None and optimum.second_order.curvature is not None:
        evidence["least_curvature"] = optimum.second_order.curvature
    evidence |= {"local_searches": context.search_count, "local_optima": context.local_optima_count}
    if optimum.ratio_range is not None:
        low, high = optimum.ratio_range
        evidence["optimality"] = (
            f"local: the best of the valleys found between resonances, at frequency ratios from {low:.3g} to "
            f"{high:.3g}; another may be deeper, which accuracy.estimated does not count"
        )
    if math.isfinite(optimum.local.predicted_gain):
        evidence["gain_still_promised"] = optimum.local.predicted_gain
    bound, gap = _bound(objective, objective.read(optimum.local.at.outcome.value), relaxed, scene)
    return Certificate(FULL_METHOD, bound, gap, evidence)


def relaxed_bound(
    context: Context, proof: Proof, answer: Dimensions, influence: Influence
) -> tuple[float | None, float]:
    """Lower bound of ln objective on the full model, None if there is none, and the influence on which it relies.

    ``proof`` is that under the original limits; its best strip is admissible under the relaxed ones, too. ``influence``
    bounds the relative change of any result of a strip by the effects beyond the core. Its maximum over the answer and
    the optima of the relaxed searches is used.
    """
    objective, greatest = context.problem.objective, influence(answer)
    for _ in range(_MAX_EVALUATIONS):
        if not greatest < _MAX_INFLUENCE:
            return None, greatest
        width = -math.log1p(-greatest)
        relaxed_limits = {row: limit + width for row, limit in context.task.limits.items()}
        if relaxed_limits[rows.STABILITY] >= -1e-9:
            return None, greatest
        proof = search(context.cycle, objective, relaxed_limits, context.sizes, _GAP, MAX_BOXES, proof)
        lower = proof.log_bound - (0.0 if objective.is_geometric else width)
        at_optimum = influence(proof.best.dimensions) if proof.best is not None else 0.0
        if at_optimum <= greatest:
            return lower, greatest
        # Relaxed limits lead to strips with a larger influence: extrapolate by a fraction of the rise so far.
        greatest = at_optimum + _EXTRAPOLATION * (at_optimum - greatest)
    return None, greatest


def _bound(objective: Objective, value: float | None, relaxed: float | None, scene: Scene) -> tuple[float, float]:
    if value is None:
        return math.inf, 0.0
    if relaxed is None or not math.isfinite(relaxed):
        return (0.0 if objective.sign > 0 else math.inf), math.inf
    bound = objective.value_at(relaxed, scene)
    ratio = value / bound if objective.sign > 0 else bound / value
    return bound, max(ratio - 1.0, 0.0)


def _proof(proof: Proof) -> Evidence:
    return {
        "boxes": proof.boxes,
        "rounds": proof.rounds,
        "angles": len(proof.samples.angles),
        "rests_on": _PROOF_RESTS_ON,
    }
