"""Finding the strip: the global optimum over width, thickness and free length, with the proof that it is one."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from solvers.effects import AUTO, EffectSelection
from solvers.errors import InvalidInput
from solvers.fatigue import FatigueCriterion, serensen
from solvers.outcome import Accuracy, ActiveConstraint, Certificate, EffectState, Outcome, Status
from solvers.rod import rows
from solvers.rod.certificate import Proof, Sizes, search
from solvers.rod.check import RodCheck, check
from solvers.rod.cycle import BeamColumn, Composition
from solvers.rod.diagnosis import diagnose
from solvers.rod.effects import ReciprocatingInertia
from solvers.rod.effects_over_box import choose_over_box
from solvers.rod.focus import FIXED_ROWS, rows_at
from solvers.rod.machine import Machine
from solvers.rod.multipliers import active_constraints
from solvers.rod.polish import Limits, Polished, polish
from solvers.rod.problem import OBJECTIVES, Objective, Requirements, RodProblem
from solvers.rod.scene import Dimensions
from solvers.rod.survey import ANGLES, survey

BOXES = 20_000
_CORRECTIONS = 6
_COARSE = (1e-2, 1e-2, 1e-4)
"""Accuracies of the first looks at the full model."""
_GUARD = 0.1
_AGREED = 0.25
"""Shares of the accuracy: how far to the safe side limits are shifted, and how far apart shifts may be in the end."""
_STEEPEST = 0.5
_SAFE = 1.0 + 1e-9
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
    limits = _limits(problem)

    def evaluate(dimensions: Dimensions, to: float) -> Outcome[RodCheck]:
        return check(problem.scene, dimensions, settled, effect_tolerance, to, criterion)

    found, evidence = _on_full_model(problem, machine, limits, sizes, evaluate, accuracy, not active <= _CORE)
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


@dataclass(frozen=True)
class _Found:
    """A strip that meets every requirement on the full model, and the search that it comes from.

    ``shifted`` is where the full model would shift the limits once more.
    """

    best: Polished
    outcome: Outcome[RodCheck]
    limits: Limits
    proof: Proof
    shifted: Limits


def _limits(problem: RodProblem) -> Limits:
    r = problem.requirements
    stress = None if r.min_yield_safety is None else problem.scene.material.yield_strength / r.min_yield_safety
    return Limits(
        r.min_fatigue_safety, max(r.min_stability_safety, _SAFE), stress, r.max_contact_pressure, r.max_friction_power
    )


def _on_full_model(
    problem: RodProblem,
    machine: Machine,
    limits: Limits,
    sizes: Sizes,
    evaluate: Callable[[Dimensions, float], Outcome[RodCheck]],
    accuracy: float,
    beyond_core: bool,
) -> tuple[_Found | None, Proof]:
    """Search, look at the full model, shift the limits by the difference, and again until both agree.

    Where the full model is more than the search's own physics, the first looks are coarse ones: the strip still moves.
    From the second look on the shift is that of a secant, since the difference itself changes with the strip.
    """
    objective = problem.objective
    coarse = [a for a in _COARSE if a > accuracy] if beyond_core else []
    guard = _GUARD * accuracy if beyond_core else 0.0
    enough = _AGREED * accuracy if beyond_core else 0.1 * accuracy
    proof = search(machine, objective, limits, sizes, accuracy, BOXES)
    best, found, before = proof.best, None, None
    for look in range(_CORRECTIONS + len(coarse)):
        if best is None:
            break
        final = look >= len(coarse)
        outcome = evaluate(best.dimensions, min(accuracy, 1e-6) if final else coarse[look])
        if outcome.value.stresses is None:
            limits, before, apart = replace(limits, stability=1.1 * limits.stability), None, math.inf
        else:
            shifted = _shifted(problem, best, outcome.value, guard)
            apart = _apart(shifted, limits)
            if final and _meets(outcome.value, problem.requirements):
                better = found is None or _cost(objective, outcome.value) < _cost(objective, found.outcome.value)
                found = _Found(best, outcome, limits, proof, shifted) if better else found
                if apart <= enough or not better:
                    break
            limits, before = _secant(before, (limits, shifted)), (limits, shifted)
        if apart > 0.05 * accuracy or sizes.stock_h or sizes.step_b or sizes.step_l:
            # The optimum itself may move elsewhere, and its bound with it.
            proof = search(machine, objective, limits, sizes, accuracy, BOXES)
            best = proof.best
        else:
            best = polish(machine, objective, limits, sizes.around(best.dimensions), best.dimensions)
    return found, proof


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
    return Limits(**values | {"stability": max(values["stability"], _SAFE)})


def _cost(objective: Objective, result: RodCheck) -> float:
    value = objective.read(result)
    return -objective.sign * math.inf if value is None else objective.sign * value


def _meets(result: RodCheck, r: Requirements) -> bool:
    s = result.stresses
    fatigue = math.inf if s.fatigue_safety is None else s.fatigue_safety
    stability = math.inf if result.stability_safety is None else result.stability_safety
    strength = math.inf if s.yield_safety is None else s.yield_safety
    return (
        fatigue >= r.min_fatigue_safety
        and stability >= r.min_stability_safety
        and (r.min_yield_safety is None or strength >= r.min_yield_safety)
        and (r.max_contact_pressure is None or s.contact_pressure_max <= r.max_contact_pressure)
        and (r.max_friction_power is None or s.friction_power <= r.max_friction_power)
    )


def _shifted(problem: RodProblem, best: Polished, full: RodCheck, guard: float) -> Limits:
    """The limits moved by the ratio of own values to the full model's, and by ``guard`` to the safe side."""
    r, s = problem.requirements, full.stresses
    own = _values(best)

    def least(required: float | None, mine: float, theirs: float | None) -> float | None:
        return None if required is None else required * (1.0 + guard) * (mine / theirs if theirs else 1.0)

    def most(required: float | None, mine: float, theirs: float | None) -> float | None:
        return None if required is None else required * (1.0 - guard) * (mine / theirs if theirs else 1.0)

    # Stresses in the ratio of the yield safeties, theirs to mine: a least safety turned into a greatest stress.
    strength, highest = problem.scene.material.yield_strength, math.exp(own[FIXED_ROWS + 1])
    stress = (
        None if r.min_yield_safety is None else strength / least(r.min_yield_safety, strength / highest, s.yield_safety)
    )
    stability = math.exp(-max(own[rows.STABILITY], own[FIXED_ROWS]))
    return Limits(
        least(r.min_fatigue_safety, math.exp(-own[rows.UTILISATION]), s.fatigue_safety),
        max(least(r.min_stability_safety, stability, full.stability_safety), _SAFE),
        stress,
        most(r.max_contact_pressure, math.exp(own[rows.PRESSURE]), s.contact_pressure_max),
        most(r.max_friction_power, math.exp(own[rows.POWER]), s.friction_power),
    )  # fmt: skip


def _values(best: Polished) -> np.ndarray:
    """All rows of a strip on the search's model."""
    d, focus = best.dimensions, best.focus
    values = np.empty(FIXED_ROWS + 2 + 2 * (1 + (focus.eta.size - 1) // 3))
    rows_at(focus, d.b, d.h, d.l, np.empty((focus.force.size, focus.eta.size)), values)
    return values


def _apart(a: Limits, b: Limits) -> float:
    """The greatest relative difference of two sets of limits."""
    pairs = [(getattr(a, n), getattr(b, n)) for n in a.__dataclass_fields__]
    return max(abs(x / y - 1.0) for x, y in pairs if x is not None and y is not None)


def _certificate(
    objective: Objective, found: _Found, active: frozenset[str], shaping: tuple[ActiveConstraint, ...], density: float
) -> Certificate:
    proof, value = found.proof, objective.read(found.outcome.value)
    # What the limits could still be shifted by buys as much as the multipliers of the requirements say.
    owed = 0.0
    for constraint in shaping:
        if (name := _LIMITED_BY.get(constraint.name)) is not None:
            ratio = getattr(found.shifted, name) / getattr(found.limits, name)
            owed += abs(constraint.sensitivity * math.log(ratio))
    gap = max(found.best.log_cost - proof.log_bound, 0.0) + owed
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
    evidence |= _beyond(active, "equal to those at the last strip looked at")
    return Certificate("branch and bound over (ln tau, ln l)", math.inf, 0.0, evidence)


def require_known(name: str) -> Objective:
    """The objective of this name, or InvalidInput."""
    if name not in OBJECTIVES:
        raise InvalidInput("objective", f"there is no objective {name!r}", ", ".join(OBJECTIVES))
    return OBJECTIVES[name]
