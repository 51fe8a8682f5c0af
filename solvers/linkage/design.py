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
from solvers.linkage.mechanism.change_point import LONGEST, NEAREST, ChangePoint
from solvers.linkage.mechanism.closure import Closure
from solvers.linkage.mechanism.lengths import Mechanism
from solvers.linkage.optimum.branch_and_bound import Proven, search
from solvers.linkage.optimum.family import FURTHER, GREATEST_MARGIN, Family
from solvers.linkage.optimum.infeasibility import diagnose
from solvers.linkage.optimum.unbounded import refuse_endless
from solvers.linkage.problem import LinkageProblem
from solvers.linkage.result import LinkageCheck
from solvers.linkage.scene import Scene
from solvers.outcome import Accuracy, Certificate, Outcome, Status

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
    refuse_endless(problem)
    found: list[tuple[Family, Proven]] = []
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
    scene = problem.settled(best.scale, mechanism.bar.end)
    outcome = check(scene, mechanism, problem.limits, effects, effect_tolerance, accuracy, problem.demands())
    value = problem.objective.value(best.cost)
    # The checked value may differ from the one used in the search: the bound is relaxed by the difference.
    apart = abs(problem.objective.read(outcome.value, scene) / value - 1.0)
    bound = min(proven.bound for _, proven in found) * (1.0 - (apart if apart > _EQUALITY_TOLERANCE else 0.0))
    alternatives = tuple(_alternative(problem, family, proven) for family, proven in found)
    excluded_to = max(1.0 - bound / best.cost, 0.0)
    judged = _warned(outcome.value, family, best, excluded_to, gap)
    result = LinkageDesign(
        judged, scene, problem.objective.name, value, active(problem.limits, outcome.value, _ACTIVE), alternatives
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


def _mechanism(family: Family, proven: Proven) -> Mechanism:
    bar = family.member(proven.q)
    crank = proven.scale / (float(bar.ratios.rocker) * bar.end)
    return Mechanism(bar, crank, Closure(family.kind, 0.0, 0.0))


def _alternative(problem: LinkageProblem, family: Family, proven: Proven) -> Alternative:
    if proven.q is None:
        why = "no mechanism of this type meets the limits"
        if proven.cells == 0:
            why = "no mechanism of this type turns fully with links, transmission angle and speed as asked for"
        return Alternative(family.kind, None, None, why)
    return Alternative(family.kind, _mechanism(family, proven), problem.objective.value(proven.cost), "")


def _evidence(found: list[tuple[Family, Proven]]) -> dict[str, float | int | str]:
    out: dict[str, float | int | str] = {f"ranges_{family.kind.name}": proven.cells for family, proven in found}
    out["searched"] = (
        f"designs: free ratios beyond their least value, relative to it, by {NEAREST:g} (largest rocker: {LONGEST:g} "
        f"(1 - 1/g^2)) to {GREATEST_MARGIN:g}; the bound: {FURTHER:g} times further at both ends, up to the "
        "parallelogram and to where links grow without end and nothing else changes"
    )
    out["rests_on"] = "lengths, swing and u31 monotone in the free ratio; width and height sinusoids between corners"
    return out


def _warned(value: LinkageCheck, family: Family, best: Proven, excluded_to: float, gap: float) -> LinkageCheck:
    """The check with a warning if a better mechanism is not excluded to the gap."""
    said = []
    low, high = family.range
    if abs(best.q - low) < _ACTIVE or abs(high - best.q) < _ACTIVE:
        kept = 1.0 / (1.0 - min(excluded_to, 0.5)) - 1.0
        endless = best.q > low or family.kind.least_margin(family.gain) != NEAREST
        where = "links without end" if endless else "the parallelogram"
        told = (
            f"the best mechanism lies at the edge of the search, next to {where}: farther out at most {kept:.1e} of "
            "the objective would be gained"
        )
        said.append(f"{told}; a limit on the size would give a mechanism that can be built" if endless else told)
    elif excluded_to > 2.0 * max(gap, _WIDE):
        said.append(f"a better mechanism is excluded only to {excluded_to:.1e}")
    return replace(value, warnings=(*value.warnings, *said)) if said else value
