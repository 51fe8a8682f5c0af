"""Optimisation of the strip, with the effects that its own answer calls for."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from weakref import WeakMethod

from solvers.effects import AUTO, EffectSelection
from solvers.fatigue import FatigueCriterion, serensen
from solvers.outcome import Outcome
from solvers.rod.constraints import BY_NAME
from solvers.rod.optimum.answer.requirement_as_objective import AttainableBest
from solvers.rod.optimum.answer.result import RodDesign, SearchResult
from solvers.rod.optimum.search.context import Suffices, never
from solvers.rod.optimum.search.effect_selection import EffectsAtStrips
from solvers.rod.optimum.strip_search import CoreOptimum, StripSearch, beyond_core
from solvers.rod.problem import Requirements, RodProblem
from solvers.rod.scene import Dimensions
from solvers.watch import Watch, in_time, no_watch

_INERTIA = "reciprocating_inertia"
_MAX_SELECTIONS = 3
"""Maximum number of effect selections at the optimum."""
_COARSE_GAP, _GAP_SHARE, _DISCRETE_GAP_SHARE = 1e-3, 0.1, 0.01
"""Gap of the core's first search, and of its last one as a share of the influence of effects beyond the core: smaller
with discrete sizes, since later searches move to neighbouring sizes only."""
_SLACKS = 0.2, 1.0
"""Fractions of the maximum slack by which requirements are relaxed in turn."""
_NEARLY = 0.01
"""Relative violation up to which a known strip is a start."""


def design(
    problem: RodProblem,
    effects: EffectSelection = AUTO,
    effect_tolerance: float = 1e-2,
    accuracy: float = 1e-6,
    criterion: FatigueCriterion | None = None,
    time_budget: float | None = None,
) -> Outcome[RodDesign]:
    """The optimal strip for a problem, or the diagnosis of infeasibility.

    Branch and bound over (ln tau, ln l), tau = 1/(b h^3), finds and certifies the optimum of the core: gas load,
    reciprocating inertia, beam-column, contact. Effects are selected at that optimum. If they go beyond the core, SQP
    on the full model continues from there, and effects are selected again at its result, until none is added; those
    that the result does not select are then left out, if that is consistent. The answer satisfies every requirement as
    evaluated by ``check``, or if no strip found does, to within the accuracy, at most 1e-3; the certificate states what
    is proven and what is not.

    ``accuracy`` is the requested relative numerical accuracy of results and optimum, 1e-12 … 1e-1. After
    ``time_budget`` seconds the search on the full model returns the best feasible strip known; without one it
    continues.
    """
    start = time.perf_counter()
    watch = no_watch if time_budget is None else Watch(time_budget)
    criterion = criterion or serensen(problem.scene.material)
    outcome = _Design(problem, effects, effect_tolerance, accuracy, criterion, watch).run()
    return replace(outcome, timing={"solve_s": time.perf_counter() - start})


@dataclass
class _Design:
    """A design run: which effects the searches of the strip include.

    The arguments but the first six are those of ``StripSearch``. ``other_designs`` are designs of other problems in the
    same scene, which several problems may need.
    """

    problem: RodProblem
    selection: EffectSelection
    effect_tolerance: float
    accuracy: float
    criterion: FatigueCriterion
    watch: Callable[[], None]
    relaxes: bool = True
    slack: float = 0.0
    known: tuple[Dimensions, ...] = ()
    suffices: Suffices = never
    other_designs: dict[tuple[str, Requirements], AttainableBest | None] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.selected = EffectsAtStrips(self.problem, self.selection, self.effect_tolerance)
        # Weak: a cycle would keep the strips of a search until it is collected.
        other_design = WeakMethod(self.other_design)
        self.search = StripSearch(
            self.problem, self.selected, self.accuracy, self.criterion, self.watch,
            lambda *given: other_design()(*given), self.relaxes, self.slack, self.known, self.suffices,
        )  # fmt: skip

    def run(self) -> Outcome[RodDesign]:
        result = self.result_with_selected_effects()
        if self.search.is_nearly_met(result.excess):
            result = self.relaxed_result(result)
        return replace(result.compose_answer(), effects=self.selected.manifest(result.strip, result.chosen))

    def relaxed_result(self, strict: SearchResult) -> SearchResult:
        """The result with requirements relaxed within the accuracy; the strict one if that is infeasible, too.

        Requirements that leave no room, such as those that a known strip just meets, cannot be met with a margin.
        """
        for share in _SLACKS:
            slack = share * self.search.max_slack
            problem = replace(self.problem, requirements=self.problem.requirements.relaxed(slack))
            relaxed = replace(self, problem=problem, relaxes=False, slack=slack).result_with_selected_effects(strict)
            if relaxed.feasible:
                return relaxed
        return strict

    def result_with_selected_effects(
        self, start: SearchResult | None = None, given: frozenset[str] | None = None
    ) -> SearchResult:
        """The result with all effects that are selected at its own strip; the search starts at the core's optimum, or
        at another result's strip with its effects. The search from the core begins with the effects ``given``, or with
        those that its optimum selects."""
        core = None
        if start is None:
            chosen, core = self.core_optimum(given or frozenset(), fixed=given is not None)
            result = self.search.with_effects(chosen, core, tentative=True)
        else:
            result = self.result_near(start.chosen, start.strip)
        for _ in range(_MAX_SELECTIONS - 1):
            further = self.selected.at(result.strip) - result.chosen
            if not further or self.search.out_of_time:
                break
            chosen = result.chosen | further
            if core is None or _INERTIA in further:
                chosen, core = self.core_optimum(chosen)
            else:
                core = replace(core, strip=result.strip)
            result = self.search.with_effects(chosen, core)
        return self.without_surplus_effects(result)

    def result_near(self, chosen: frozenset[str], strip: Dimensions) -> SearchResult:
        """The result with given effects; the search on the full model starts at a strip."""
        _, core = self.core_optimum(chosen, fixed=True)
        return self.search.with_effects(chosen, core.starting_at(strip) if beyond_core(chosen) else core)

    def without_surplus_effects(self, result: SearchResult) -> SearchResult:
        """The result with the effects selected at its strip only, without those selected on the way to it, if that is
        as good and its strip selects the same: an answer should not depend on the way to it. Otherwise the result with
        all of them, for which an incomplete search is repeated to its end."""
        selected, other = self.selected.at(result.strip), result
        has_surplus = not selected >= result.chosen and result.excess <= self.effect_tolerance
        if has_surplus and not self.search.out_of_time:
            other = self.result_near(selected, result.strip)
            is_as_good = other.feasible or (self.search.is_nearly_met(other.excess) and not result.feasible)
            if is_as_good and not self.search.out_of_time and self.selected.at(other.strip) == selected:
                return other
        if result.complete or self.search.out_of_time:
            return result
        return self.result_near(result.chosen, (other if other.feasible else result).strip)

    def core_optimum(self, chosen: frozenset[str], fixed: bool = False) -> tuple[frozenset[str], CoreOptimum]:
        """The effects selected at the core's optimum added to ``chosen`` unless ``fixed``, and that optimum.

        Effects beyond the core widen its bound by their influence; the gap is then closed only to a share of that.
        """
        gap, core = max(_COARSE_GAP, self.accuracy), None
        middle = self.search.sizes.bounds.middle
        with_inertia = _INERTIA in chosen or (not fixed and self.selected.probably_at(middle, _INERTIA))
        share = _DISCRETE_GAP_SHARE if self.search.sizes.discrete else _GAP_SHARE
        while True:
            core = self.search.core(with_inertia, gap, core)
            chosen |= frozenset() if fixed else self.selected.at(core.strip)
            if with_inertia != (_INERTIA in chosen):
                # The relevance of inertia is evaluated at a strip, which itself depends on it.
                with_inertia, core = not with_inertia, None
                continue
            influence = self.selected.influence(core.strip, beyond_core(chosen))
            required_gap = max(share * influence, self.accuracy)
            if gap <= required_gap or core.proof.best is None:
                return chosen, core
            gap = max(0.5 * required_gap, self.accuracy)

    def other_design(self, effects: frozenset[str], problem: RodProblem, suffices: Suffices) -> AttainableBest | None:
        """The design of another problem in the same scene, which selects its own effects whichever it begins with; None
        if infeasible or if no time is left. Raises ``Sufficient`` at the first strip whose check suffices."""
        if not in_time(self.watch):
            return None
        key = problem.objective.name, problem.requirements
        if key not in self.other_designs:
            self.other_designs[key] = self.attainable_best(effects, problem, suffices)
        return self.other_designs[key]

    def attainable_best(
        self, effects: frozenset[str], problem: RodProblem, suffices: Suffices
    ) -> AttainableBest | None:
        """The design of another problem, which begins with given effects and selects its own at its result; known
        strips that nearly meet its requirements are further starts."""
        asked, nearly = problem.requirements, problem.requirements.relaxed(_NEARLY)
        others = ((name, best.check) for (name, _), best in self.other_designs.items() if best is not None)
        # A strip that meets them is no start if another objective led to it: it is far from optimal.
        known = tuple(
            check.dimensions
            for name, check in others
            if nearly.met_by(check) and (name == problem.objective.name or not asked.met_by(check))
        )
        other = replace(self, problem=problem, relaxes=False, known=known, suffices=suffices)
        result = other.result_with_selected_effects(given=effects)
        if not result.feasible:
            return None
        outcome = result.compose_answer()
        opponents = tuple(BY_NAME[a.name] for a in outcome.value.active if a.name in BY_NAME)
        # Without what composes it, which holds the searches with all their strips.
        composed = replace(result, compose_answer=lambda: outcome)
        return AttainableBest(outcome.value.check, outcome.accuracy.estimated, opponents, composed)
