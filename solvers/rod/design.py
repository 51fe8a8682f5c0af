"""Finding the strip: the global optimum over width, thickness and free length, with the proof that it is one."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

from solvers.effects import AUTO, EffectSelection
from solvers.fatigue import FatigueCriterion, serensen
from solvers.outcome import Accuracy, ActiveConstraint, Certificate, EffectState, Outcome, Status
from solvers.rod.check import RodCheck, check
from solvers.rod.cycle.composition import BeamColumn, Composition
from solvers.rod.effect_bounds.over_box import choose_over_box
from solvers.rod.effects import ReciprocatingInertia
from solvers.rod.optimum.answer.infeasibility import diagnose
from solvers.rod.optimum.answer.sensitivities import active_constraints
from solvers.rod.optimum.full_model.found import BOXES, Found, limits_of
from solvers.rod.optimum.full_model.matching import on_full_model
from solvers.rod.optimum.full_model.scout import STRIPS
from solvers.rod.optimum.proof.outer_approximation import Proof, Sizes
from solvers.rod.optimum.sampled_cycle import ANGLES, survey
from solvers.rod.problem import Objective, RodProblem
from solvers.rod.scene import Dimensions

_LIMITED_BY = {
    "min_fatigue_safety": "fatigue",
    "min_stability_safety": "stability",
    "min_yield_safety": "stress",
    "max_contact_pressure": "pressure",
    "max_friction_power": "power",
}
"""The fields of ``Limits`` by the names of the constraints."""
_CORE = frozenset({"reciprocating_inertia", "beam_column", "friction"})


@dataclass(frozen=True)
class RodDesign:
    """The strip found, its check on the full model, and the constraints that shape it."""

    check: RodCheck
    objective: str
    active: tuple[ActiveConstraint, ...]


def design(
    problem: RodProblem,
    effects: EffectSelection = AUTO,
    effect_tolerance: float = 1e-2,
    accuracy: float = 1e-6,
    criterion: FatigueCriterion | None = None,
) -> Outcome[RodDesign]:
    """The best strip for a problem, or the diagnosis why there is none.

    Branch and bound over (ln tau, ln l), tau = 1/(b h^3), finds and proves the optimum of gas load, reciprocating
    inertia, beam-column and contact; scipy's SLSQP polishes it. Where the scene calls for effects beyond these, the
    limits are shifted by what the full model says at the strip found, and the search is done again until both agree.
    The answer satisfies every requirement on the full model.
    """
    started = time.perf_counter()
    criterion = criterion or serensen(problem.scene.material)
    bounds = problem.bounds
    lower = Dimensions(bounds.b[0], bounds.h[0], bounds.l[0])
    upper = Dimensions(bounds.b[1], bounds.h[1], min(bounds.l[1], problem.scene.mechanism.rod_length))
    choice = choose_over_box(
        problem.scene, lower, upper, effects, effect_tolerance,
        problem.requirements.demands() + problem.objective.demands(), problem.requirements.min_stability_safety,
    )  # fmt: skip
    active = frozenset(e.name for e in choice.manifest if e.state is EffectState.ACTIVE)
    settled = EffectSelection(active, frozenset(e.name for e in choice.manifest) - active)
    moving = (ReciprocatingInertia(),) if "reciprocating_inertia" in active else ()
    machine = survey(problem.scene, criterion, Composition(moving=moving, beam=BeamColumn()), lower)
    sizes = Sizes(bounds, problem.stock_h, problem.step_b, problem.step_l)
    limits = limits_of(problem)

    def evaluate(dimensions: Dimensions, to: float) -> Outcome[RodCheck]:
        return check(problem.scene, dimensions, settled, effect_tolerance, to, criterion)

    found, evidence = on_full_model(problem, machine, limits, sizes, evaluate, accuracy, not active <= _CORE)
    if found is None:
        return Outcome(
            Status.INFEASIBLE,
            None,
            choice.manifest,
            Accuracy(accuracy, accuracy, {"angles": ANGLES}),
            certificate=_infeasible(evidence, active),
            diagnosis=diagnose(machine, limits, sizes, problem.requirements),
            timing={"solve_s": time.perf_counter() - started},
        )
    result = found.outcome.value
    shaping = active_constraints(
        machine, problem.objective, found.limits, bounds, sizes.around(result.dimensions), found.best
    )
    certificate = _certificate(problem.objective, found, active, shaping, problem.scene.material.density)
    return Outcome(
        Status.SUCCEEDED,
        RodDesign(result, problem.objective.name, shaping),
        choice.manifest,
        Accuracy(accuracy, max(found.outcome.accuracy.estimated, certificate.gap), {"angles": ANGLES, "boxes": BOXES}),
        certificate=certificate,
        timing={"solve_s": time.perf_counter() - started},
    )


def _certificate(
    objective: Objective, found: Found, active: frozenset[str], shaping: tuple[ActiveConstraint, ...], density: float
) -> Certificate:
    proof, value = found.proof, objective.read(found.outcome.value)
    # What the limits could still be shifted by buys as much as the multipliers of the requirements say.
    owed = 0.0
    for constraint in shaping:
        if (name := _LIMITED_BY.get(constraint.name)) is not None:
            ratio = getattr(found.shifted, name) / getattr(found.limits, name)
            owed += abs(constraint.sensitivity * math.log(ratio))
    # The last strip found may be better than the search's own, but no bound comes nearer by that.
    own = found.best.log_cost if proof.best is None else max(found.best.log_cost, proof.best.log_cost)
    gap = max(own - proof.log_bound, 0.0) + owed + found.rough
    if not active - _CORE and value:
        # The search's own physics: where its value is not the check's, its bound may be as wrong.
        gap += abs(objective.log_cost(found.outcome.value, density) - found.best.log_cost)
    evidence: dict[str, float | int | str] = {
        "boxes": proof.boxes,
        "rounds": proof.rounds,
        "angles": proof.angles,
        "rests_on": "ranges of the closed-form beam over boxes of (tau, l); monotone in b, h, l by energy",
    }
    evidence |= _beyond(active, "equal to those at the answer")
    # A safety without a load to fail under is None: none is better.
    bound = math.inf if value is None else value * math.exp(-objective.sign * gap)
    return Certificate("branch and bound over (ln tau, ln l)", bound, math.expm1(gap), evidence)


def _beyond(active: frozenset[str], taken: str) -> dict[str, str]:
    """What the proof does not cover, and how it was reckoned with."""
    beyond = sorted(active - _CORE)
    if not beyond:
        return {}
    return {"beyond_the_proof": f"{', '.join(beyond)}: taken as constant factors on every limit, {taken}"}


def _infeasible(proof: Proof, active: frozenset[str]) -> Certificate | None:
    if math.isfinite(proof.log_bound):
        return None
    evidence = {"boxes": proof.boxes, "rests_on": "every box of (tau, l) violates a requirement"}
    if beyond := _beyond(active, "equal to those at the last strip looked at"):
        evidence |= beyond | {"scouted": f"{STRIPS} strips spread over all sizes, none of them admissible"}
    return Certificate("branch and bound over (ln tau, ln l)", math.inf, 0.0, evidence)
