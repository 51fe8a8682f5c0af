"""Global optimisation of the linkage: the best of every allowed type, the overall best, and its proof of optimality."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

from solvers.accuracy import require_accuracy
from solvers.effects import AUTO, EffectSelection
from solvers.linkage.check import check
from solvers.linkage.constraints import active
from solvers.linkage.effects import Situation, choose_for
from solvers.linkage.mechanism.change_point import MIN_LONG_LINK_MARGIN, MIN_PARALLELOGRAM_MARGIN, ChangePoint
from solvers.linkage.mechanism.closure import Closure
from solvers.linkage.mechanism.lengths import Mechanism
from solvers.linkage.optimum.branch_and_bound import FamilyOptimum, search
from solvers.linkage.optimum.family import MAX_MARGIN, PROOF_RANGE_FACTOR, Family
from solvers.linkage.optimum.infeasibility import diagnose
from solvers.linkage.optimum.unbounded import refuse_unbounded
from solvers.linkage.problem import LinkageProblem
from solvers.linkage.result import LinkageCheck
from solvers.linkage.scene import Scene
from solvers.outcome import Accuracy, Certificate, Outcome, Status
from solvers.verdict import per_cent

_METHOD = "branch and bound over the free ratio of every type, orientation included"
_LEAST_GAP = 1e-6
_ACTIVE, _WIDE = 1e-7, 5e-4
_EQUALITY_TOLERANCE = 1e-10
"""Relative tolerance for equality of quantities that are closed forms or extrema converged to less."""


@dataclass(frozen=True)
class Alternative:
    """The best mechanism of a type with its objective value, or the reason why there is none."""

    kind: ChangePoint
    mechanism: Mechanism | None
    value: float | None
    reason: str


@dataclass(frozen=True)
class LinkageDesign:
    """The optimal linkage, its scene (with the speed or frequency found), and the best of every type."""

    check: LinkageCheck
    scene: Scene
    objective: str
    value: float
    active_limits: tuple[str, ...]
    alternatives: tuple[Alternative, ...]


def design(
    problem: LinkageProblem,
    effects: EffectSelection = AUTO,
    effect_tolerance: float = 1e-2,
    accuracy: float = 1e-6,
) -> Outcome[LinkageDesign]:
    """The optimal linkage for a problem, or the diagnosis of infeasibility.

    It is made for the middle of the restitution's range. ``accuracy`` is the gap of the proof, at least 1e-6; the
    optimum itself is refined to a small fraction of it. Raises InvalidInput for an invalid request.
    """
    started = time.perf_counter()
    require_accuracy(accuracy)
    gap = max(accuracy, _LEAST_GAP)
    refuse_unbounded(problem)
    found: list[tuple[Family, FamilyOptimum]] = []
    for kind in problem.kinds:
        family = Family(kind, problem.scene.restitution.gain)
        known = min((proven.cost for _, proven in found), default=math.inf)
        found.append((family, search(problem, family, gap, known)))
    feasible = [(family, proven) for family, proven in found if proven.q is not None]
    settings: dict[str, float | int | str] = {"gap": gap}
    if not feasible:
        nominal = Mechanism(found[0][0].member(0.0), 1.0, Closure(problem.kinds[0], 0.0, 0.0))
        situation = Situation(problem.scene, nominal, problem.limits, accuracy, None)
        choice = choose_for(situation, effects, effect_tolerance, problem.demands())
        return Outcome(
            Status.INFEASIBLE,
            None,
            choice.manifest,
            Accuracy(accuracy, gap, settings),
            certificate=Certificate(_METHOD, math.inf, 0.0, _evidence(found)),
            diagnosis=diagnose(problem),
            timing={"solve_s": time.perf_counter() - started},
        )
    family, best = min(feasible, key=lambda pair: pair[1].cost)
    mechanism = _mechanism(family, best)
    scene = problem.settled(best.scale, mechanism.bar.u31_end)
    outcome = check(scene, mechanism, problem.limits, effects, effect_tolerance, accuracy, problem.demands())
    value = problem.objective.value(best.cost)
    # The checked value may differ from the one used in the search: the bound is relaxed by the difference.
    difference = abs(problem.objective.read(outcome.value, scene) / value - 1.0)
    bound = min(proven.bound for _, proven in found) * (1.0 - (difference if difference > _EQUALITY_TOLERANCE else 0.0))
    alternatives = tuple(_alternative(problem, family, proven) for family, proven in found)
    excluded_to = max(1.0 - bound / best.cost, 0.0)
    check_with_warning = _with_search_warning(outcome.value, family, best, excluded_to, gap)
    result = LinkageDesign(
        check_with_warning,
        scene,
        problem.objective.name,
        value,
        active(problem.limits, outcome.value, _ACTIVE),
        alternatives,
    )
    certificate = Certificate(_METHOD, problem.objective.value(bound), excluded_to, _evidence(found))
    return Outcome(
        Status.SUCCEEDED,
        result,
        outcome.effects,
        Accuracy(accuracy, max(outcome.accuracy.estimated, 1e-12), {**outcome.accuracy.settings, **settings}),
        certificate=certificate,
        timing={"solve_s": time.perf_counter() - started},
    )


def _mechanism(family: Family, proven: FamilyOptimum) -> Mechanism:
    bar = family.member(proven.q)
    crank = proven.scale / (float(bar.ratios.rocker) * bar.u31_end)
    return Mechanism(bar, crank, Closure(family.kind, 0.0, 0.0))


def _alternative(problem: LinkageProblem, family: Family, proven: FamilyOptimum) -> Alternative:
    if proven.q is None:
        why = "no mechanism of this type meets the limits"
        if proven.cells == 0:
            why = "no mechanism of this type turns fully with links, transmission angle and speed as asked for"
        return Alternative(family.kind, None, None, why)
    return Alternative(family.kind, _mechanism(family, proven), problem.objective.value(proven.cost), "")


def _evidence(found: list[tuple[Family, FamilyOptimum]]) -> dict[str, float | int | str]:
    out: dict[str, float | int | str] = {f"ranges_{family.kind.name}": proven.cells for family, proven in found}
    out["searched"] = (
        f"designs: free ratios beyond their least value, relative to it, by {MIN_PARALLELOGRAM_MARGIN:g} "
        f"(largest rocker: {MIN_LONG_LINK_MARGIN:g} (1 - 1/g^2)) to {MAX_MARGIN:g}; "
        f"the bound: {PROOF_RANGE_FACTOR:g} times further at both ends, up to the parallelogram and to "
        "where links grow without end and nothing else changes"
    )
    out["rests_on"] = "lengths, swing and u31 monotone in the free ratio; width and height sinusoids between corners"
    return out


def _with_search_warning(
    value: LinkageCheck, family: Family, best: FamilyOptimum, excluded_to: float, gap: float
) -> LinkageCheck:
    """The check with a warning if a better mechanism is not excluded to the gap."""
    messages = []
    low, high = family.design_range
    if abs(best.q - low) < _ACTIVE or abs(high - best.q) < _ACTIVE:
        possible_gain = 1.0 / (1.0 - min(excluded_to, 0.5)) - 1.0
        unbounded = best.q > low or family.kind.minimum_margin(family.gain) != MIN_PARALLELOGRAM_MARGIN
        where = "links without end" if unbounded else "the parallelogram"
        message = (
            f"the best mechanism lies at the edge of the search, next to {where}: farther out at most "
            f"{per_cent(possible_gain)} % of the objective would be gained"
        )
        messages.append(
            f"{message}; a limit on the size would give a mechanism that can be built" if unbounded else message
        )
    elif excluded_to > 2.0 * max(gap, _WIDE):
        messages.append(f"a better mechanism is excluded only to {per_cent(excluded_to)} %")
    return replace(value, warnings=(*value.warnings, *messages)) if messages else value
