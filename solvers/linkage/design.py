"""Global optimisation of the linkage: the best of every allowed type, the overall best, and its proof of optimality."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

import numpy as np

from solvers.accuracy import require_accuracy
from solvers.effects import AUTO, EffectSelection
from solvers.errors import InvalidInput
from solvers.linkage.check import check
from solvers.linkage.constraints import active
from solvers.linkage.effects import Situation, choose_for
from solvers.linkage.mechanism.change_point import MIN_LONG_LINK_MARGIN, MIN_PARALLELOGRAM_MARGIN, ChangePoint
from solvers.linkage.mechanism.lengths import Mechanism
from solvers.linkage.optimum.branch_and_bound import FamilyOptimum, search_all
from solvers.linkage.optimum.family import MAX_MARGIN, PROOF_RANGE_FACTOR, Family
from solvers.linkage.optimum.infeasibility import diagnose
from solvers.linkage.optimum.quantities import EXCESS, Quantities
from solvers.linkage.problem import BLOW_FREQUENCY, LinkageProblem
from solvers.linkage.result import LinkageCheck
from solvers.linkage.scene import Scene
from solvers.outcome import Accuracy, Certificate, Outcome, Status
from solvers.verdict import per_cent

_METHOD = "branch and bound over the free ratio of every type, orientation included"
_LEAST_GAP = 1e-6
_ACTIVE, _WIDE = 1e-7, 5e-4
_EQUALITY_TOLERANCE = 1e-10
"""Relative tolerance for equality of quantities that are closed forms or extrema converged to less."""
_VANISHING = 1e-3
"""|u31(2 pi)| at an end of the family below which the base is assumed to grow without bound toward that end."""


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
    _refuse_unbounded(problem)
    found = search_all(problem, gap)
    best = min(found, key=lambda other: other.cost)
    settings: dict[str, float | int | str] = {"gap": gap}
    if best.mechanism is None:
        nominal = Mechanism(best.family.member(0.0), 1.0)
        situation = Situation(problem.scene, nominal, problem.limits, accuracy, None)
        choice = choose_for(situation, effects, effect_tolerance, problem.demands())
        return Outcome(
            Status.INFEASIBLE,
            None,
            choice.manifest,
            # What is attainable is what an actual linkage attains.
            Accuracy(accuracy, EXCESS, settings),
            certificate=Certificate(_METHOD, math.inf, 0.0, _evidence(found)),
            diagnosis=diagnose(problem),
            timing={"solve_s": time.perf_counter() - started},
        )
    scene = problem.settled(best.scale, best.mechanism.bar.u31_end)
    outcome = check(scene, best.mechanism, problem.limits, effects, effect_tolerance, accuracy, problem.demands())
    value = problem.objective.value(best.cost)
    # The checked value may differ from the one used in the search: the bound is relaxed by the difference.
    difference = abs(problem.objective.read(outcome.value, scene) / value - 1.0)
    bound = min(other.bound for other in found) * (1.0 - (difference if difference > _EQUALITY_TOLERANCE else 0.0))
    excluded_to = max(1.0 - bound / best.cost, 0.0)
    result = LinkageDesign(
        replace(outcome.value, warnings=(*outcome.value.warnings, *_search_warnings(best, excluded_to, gap))),
        scene,
        value,
        active(problem.limits, outcome.value, _ACTIVE),
        tuple(_alternative(problem, other) for other in found),
    )
    return Outcome(
        Status.SUCCEEDED,
        result,
        outcome.effects,
        Accuracy(accuracy, max(outcome.accuracy.estimated, 1e-12), {**outcome.accuracy.settings, **settings}),
        certificate=Certificate(_METHOD, problem.objective.value(bound), excluded_to, _evidence(found)),
        timing={"solve_s": time.perf_counter() - started},
    )


def _refuse_unbounded(problem: LinkageProblem) -> None:
    """Raise InvalidInput if longer links improve the objective indefinitely.

    With a tool at its own radius the blow frequency is v/(2 pi r |u31(2 pi)|), and |u31(2 pi)| = (g + 1)/e tends to 0
    as the base, and with it e, grows without bound: the largest rocker for lambda2 -> g^2, the largest base for
    lambda0 -> inf. The transmission angle then tends to 2 asin(1/g), and in crank lengths all dimensions of the swept
    area except its length along the base converge. So if a sufficiently distant member is feasible, all members beyond
    it are feasible too, each better than the one before.
    """
    limits = problem.limits
    boxed = limits.width is not None and limits.height is not None
    if boxed or limits.longest_link is not None or limits.enclosing_radius is not None:
        return
    if problem.objective is not BLOW_FREQUENCY or problem.scene.tool_radius is None:
        return
    for kind in problem.kinds:
        family = Family(kind, problem.scene.restitution.gain)
        q = np.array(family.proof_range)
        ends = Quantities(problem, family, q, q)
        if np.any((ends.u31_end[0] < _VANISHING) & ends.fits):
            raise InvalidInput(
                "limits.longest_link",
                f"the longer the links of the {kind.name.replace('_', ' ')} the higher the blow frequency at this tool "
                "radius, without end",
                "a limit on the longest link, the enclosing radius, or both width and height",
            )


def _alternative(problem: LinkageProblem, best: FamilyOptimum) -> Alternative:
    if best.mechanism is not None:
        return Alternative(best.family.kind, best.mechanism, problem.objective.value(best.cost), "")
    why = "no mechanism of this type meets the limits"
    if best.cells == 0:
        why = "no mechanism of this type turns fully with links, transmission angle and speed as asked for"
    return Alternative(best.family.kind, None, None, why)


def _evidence(found: list[FamilyOptimum]) -> dict[str, float | int | str]:
    out: dict[str, float | int | str] = {f"ranges_{best.family.kind.name}": best.cells for best in found}
    out["searched"] = (
        f"designs: free ratios beyond their least value, relative to it, by {MIN_PARALLELOGRAM_MARGIN:g} "
        f"(largest rocker: {MIN_LONG_LINK_MARGIN:g} (1 - 1/g^2)) to {MAX_MARGIN:g}; "
        f"the bound: {PROOF_RANGE_FACTOR:g} times further at both ends, up to the parallelogram and to "
        "where links grow without end and nothing else changes"
    )
    out["rests_on"] = "lengths, swing and u31 monotone in the free ratio; width and height sinusoids between corners"
    return out


def _search_warnings(best: FamilyOptimum, excluded_to: float, gap: float) -> tuple[str, ...]:
    """A warning if a better mechanism is not excluded to the gap."""
    low, high = best.family.design_range
    if abs(best.q - low) < _ACTIVE or abs(high - best.q) < _ACTIVE:
        possible_gain = 1.0 / (1.0 - min(excluded_to, 0.5)) - 1.0
        unbounded = best.q > low or best.family.kind.minimum_margin(best.family.gain) != MIN_PARALLELOGRAM_MARGIN
        where = "links without end" if unbounded else "the parallelogram"
        message = (
            f"the best mechanism lies at the edge of the search, next to {where}: farther out at most "
            f"{per_cent(possible_gain)} % of the objective would be gained"
        )
        return (f"{message}; a limit on the size would give a mechanism that can be built" if unbounded else message,)
    if excluded_to > 2.0 * max(gap, _WIDE):
        return (f"a better mechanism is excluded only to {per_cent(excluded_to)} %",)
    return ()
