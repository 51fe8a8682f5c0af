"""Optimisation of the strip: the core's certified global optimum, then local searches on the full model."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from solvers.effects import AUTO, EffectSelection
from solvers.fatigue import FatigueCriterion, serensen
from solvers.outcome import Outcome
from solvers.rod import rows
from solvers.rod.constraints import BY_NAME
from solvers.rod.cycle.composition import Cycle
from solvers.rod.effects import EFFECTS, choose_for, compose
from solvers.rod.optimum.answer.composition import Answers, RodDesign
from solvers.rod.optimum.answer.requirement_as_objective import AttainableBest, RequirementsAsObjectives
from solvers.rod.optimum.core.cycle import core_cycle
from solvers.rod.optimum.full_model.corrections import is_stable
from solvers.rod.optimum.full_model.model import FullModel, no_watch
from solvers.rod.optimum.proof.outer_approximation import Proof, Sizes, search
from solvers.rod.optimum.search.available_sizes import discrete_optimum
from solvers.rod.optimum.search.costly_limits import refine_checks
from solvers.rod.optimum.search.effect_selection import EffectsAtStrips
from solvers.rod.optimum.search.feasibility import least_violating, least_violation
from solvers.rod.optimum.search.full_optimum import (
    MAX_BOXES,
    Context,
    NoVibration,
    Optimum,
    continuous_optimum,
    first_order_conditions,
)
from solvers.rod.optimum.search.local_search import MIN_EXCESS, LocalResult, Task
from solvers.rod.optimum.sqp import required_results
from solvers.rod.problem import Bounds, Requirements, RodProblem
from solvers.rod.scene import Dimensions
from solvers.verdict import MAX_SLACK
from solvers.watch import OutOfTime, Watch

_INERTIA = "reciprocating_inertia"
_CORE = frozenset({_INERTIA, "beam_column", "friction"})
_MAX_SELECTIONS = 3
"""Maximum number of effect selections at the optimum."""
_MARGIN, _MIN_GAIN = 0.05, 0.1
"""Fractions of the accuracy: margin to the limits, and the gain not worth another step."""
_COARSE_GAP, _GAP_SHARE = 1e-3, 0.1
"""Gap of the core's first search, and of its last one as a share of the influence of effects beyond the core."""
_CORRECTION_MARGINS = (1e-3, 1e-3, 1e-2, 0.1, 1.0, 1.0)
"""Fractions of the accuracy: margins of the core's searches in turn, until a check meets the requirements."""
_MAX_CHECK_ERROR, _RESOLVED = 1e-3, 0.3
"""Maximum error of a check that counts in the minimum resolvable gain, and the share of one within the accuracy."""
_RECOVERABLE_EXCESS = 0.1
"""Logarithmic excess over the core's limits below which effects may restore feasibility."""
_UNRESOLVED_EXCESS = 2e-3
"""Excess over the core's limits that the search for the least one does not distinguish from 0."""
_SLACKS, _MAX_MISSED = (0.2, 1.0), 10.0
"""Fractions of the maximum slack by which requirements are relaxed in turn, and what a search may have missed them by,
as the searches for the least violation are less exact than others."""
_MAX_STRIPS = 100
"""Evaluations allowed, regardless of time, in search of a first feasible strip."""


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
    design_run = _Design(problem, effects, effect_tolerance, accuracy, criterion or serensen(problem.scene.material))
    if time_budget is not None:
        design_run.watch = Watch(time_budget)
    outcome = design_run.run()
    return replace(outcome, timing={"solve_s": time.perf_counter() - start})


@dataclass(frozen=True)
class _SearchResult:
    """Result of a search: its effects, the strip at which effects are to be selected next, what that is known to miss
    the requirements by (0 if feasible), and a function that composes the answer, without its effects, when it is
    required. An incomplete search ended early, at a strip whose vibration need not be modelled."""

    chosen: frozenset[str]
    strip: Dimensions
    excess: float
    compose_answer: Callable[[], Outcome[RodDesign]]
    complete: bool = True

    @property
    def feasible(self) -> bool:
        return self.excess <= 0.0


@dataclass
class _Design:
    """State of one design run."""

    problem: RodProblem
    selection: EffectSelection
    effect_tolerance: float
    accuracy: float
    criterion: FatigueCriterion
    watch: Callable[[], None] = no_watch
    relaxes: bool = True
    """Whether requirements that leave no room are relaxed within the accuracy."""
    slack: float = 0.0
    """By how much the problem's requirements have been relaxed."""
    out_of_time: bool = False
    other_designs: dict[tuple[EffectSelection, str, Requirements], AttainableBest | None] = field(default_factory=dict)
    """Designs of other problems in the same scene, which several problems may need."""
    known: tuple[Dimensions, ...] = ()
    """Strips with the greatest value of the objective under other requirements: further starts."""

    def __post_init__(self) -> None:
        p = self.problem
        self.sizes = Sizes(p.bounds, p.stock_h, p.step_b, p.step_l)
        self.limits = p.requirements.limits(p.scene)
        self.selected = EffectsAtStrips(p, self.selection, self.effect_tolerance)
        # The relative violation of a requirement that does not count, as in the verdict.
        self.max_slack = min(self.accuracy, MAX_SLACK)

    def run(self) -> Outcome[RodDesign]:
        result = self.result_with_selected_effects()
        if self.is_nearly_met(result.excess):
            result = self.relaxed_result(result)
        return replace(result.compose_answer(), effects=self.selected.manifest(result.strip, result.chosen))

    def relaxed_result(self, strict: _SearchResult) -> _SearchResult:
        """The result with requirements relaxed within the accuracy; the strict one if that is infeasible, too.

        Requirements that leave no room, such as those that a known strip just meets, cannot be met with a margin.
        """
        for share in _SLACKS:
            slack = share * self.max_slack
            problem = replace(self.problem, requirements=self.problem.requirements.relaxed(slack))
            relaxed = replace(self, problem=problem, relaxes=False, slack=slack).result_with_selected_effects(strict)
            if relaxed.feasible:
                return relaxed
        return strict

    def result_with_selected_effects(self, start: _SearchResult | None = None) -> _SearchResult:
        """The result with all effects that are selected at its own strip; the search starts at the core's optimum, or
        at another result's strip with its effects."""
        if start is None:
            chosen, proof, excess, strip = self.core_optimum(frozenset())
            result = self.result_with_effects(chosen, proof, excess, strip, tentative=True)
        else:
            result = self.result_near(start.chosen, start.strip)
        for _ in range(_MAX_SELECTIONS - 1):
            further = self.selected.at(result.strip) - result.chosen
            if not further or self.out_of_time:
                break
            chosen, strip = result.chosen | further, result.strip
            if _INERTIA in further or start is not None:
                chosen, proof, excess, strip = self.core_optimum(chosen)
            result = self.result_with_effects(chosen, proof, excess, strip)
        return self.complete(self.without_surplus_effects(result))

    def complete(self, result: _SearchResult) -> _SearchResult:
        """The result with the same effects of a search to the end."""
        if result.complete or self.out_of_time:
            return result
        return self.result_near(result.chosen, result.strip)

    def result_near(self, chosen: frozenset[str], strip: Dimensions) -> _SearchResult:
        """The result with given effects; the search on the full model starts at a strip."""
        _, proof, excess, core_strip = self.core_optimum(chosen, fixed=True)
        if _beyond(chosen):
            return self.result_with_effects(chosen, proof, 0.0, strip)
        return self.result_with_effects(chosen, proof, excess, core_strip)

    def without_surplus_effects(self, result: _SearchResult) -> _SearchResult:
        """The result with the effects selected at its strip only, without those selected on the way to it, if it is
        not worse for that and its strip selects the same: an answer should not depend on the way to it."""
        selected = self.selected.at(result.strip)
        if selected >= result.chosen or self.out_of_time or result.excess > self.effect_tolerance:
            return result
        cycle, other = self.cycle, self.result_near(selected, result.strip)
        is_as_good = other.feasible or (self.is_nearly_met(other.excess) and not result.feasible)
        if is_as_good and not self.out_of_time and self.selected.at(other.strip) == selected:
            return other
        self.cycle = cycle
        return result

    def core_optimum(
        self, chosen: frozenset[str], fixed: bool = False
    ) -> tuple[frozenset[str], Proof, float, Dimensions]:
        """The core's optimum with the effects selected at it added to ``chosen`` unless ``fixed``, and these effects.

        Effects beyond the core widen its bound by their influence; the gap is then closed only to a share of that.
        """
        gap, proof = max(_COARSE_GAP, self.accuracy), None
        while True:
            with_inertia = _INERTIA in chosen
            proof, excess, strip = self.core_search(with_inertia, gap, proof)
            chosen |= frozenset() if fixed else self.selected.at(strip)
            if with_inertia != (_INERTIA in chosen):
                # The relevance of inertia is evaluated at a strip, which itself depends on it.
                proof = None
                continue
            required_gap = max(_GAP_SHARE * self.selected.influence(strip, _beyond(chosen)), self.accuracy)
            if gap <= required_gap or proof.best is None:
                return chosen, proof, excess, strip
            gap = max(0.5 * required_gap, self.accuracy)

    def core_search(self, with_inertia: bool, gap: float, earlier: Proof | None) -> tuple[Proof, float, Dimensions]:
        """The core's optimum; if infeasible, the excess over the limits and the strip with the least excess."""
        p = self.problem
        mass = p.scene.piston.reciprocating_mass if with_inertia else 0.0
        self.cycle = core_cycle(p.scene, self.criterion, mass)
        proof = search(self.cycle, p.objective, self.limits, self.sizes, gap, MAX_BOXES, earlier)
        if proof.best is not None:
            return proof, 0.0, proof.best.dimensions
        b = p.bounds
        least = least_violation(self.cycle, self.limits, Bounds(b.b, b.h, (b.l[0], min(b.l[1], self.cycle.rod_length))))
        return (proof, *least) if least is not None else (proof, math.inf, b.stiffest)

    def min_resolvable_gain(self, model: FullModel, strip: Dimensions) -> float:
        """The gain below which a step is not resolved: the error of a check, or a part of it within the accuracy, if
        corners of the load excite vibration; otherwise 0."""
        if not model.is_excited_by_corners or not is_stable(Cycle(self.problem.scene, strip, model.composition)):
            return 0.0
        error = model.check(strip).accuracy.estimated
        return _RESOLVED * error if error <= self.accuracy else min(error, _MAX_CHECK_ERROR)

    def context(self, chosen: frozenset[str], strip: Dimensions) -> Context:
        p = self.problem
        fixed = EffectSelection(chosen, frozenset(effect.name for effect in EFFECTS) - chosen)
        # A fixed selection does not depend on the strip.
        composition = compose(choose_for(p.scene, p.bounds.stiffest, fixed, self.effect_tolerance))
        required = required_results(p.objective, self.limits)
        model = FullModel(
            p.scene, composition, self.criterion, fixed, self.effect_tolerance, self.accuracy, required, self.sizes.free
        )
        margin = _MARGIN * self.accuracy
        min_gain = max(_MIN_GAIN * self.accuracy, self.min_resolvable_gain(model, strip))
        task = Task(p.objective, p.requirements, self.limits, margin, min_gain)
        context = Context(p, self.cycle, model, task, self.sizes)

        def watch() -> None:
            try:
                self.watch()
            except OutOfTime:
                # Continue to the first feasible strip, up to _MAX_STRIPS evaluations.
                if model.strip_count > _MAX_STRIPS or context.feasible_checks():
                    raise

        model.watch = watch
        return context

    def result_with_effects(
        self, chosen: frozenset[str], proof: Proof, excess: float, strip: Dimensions, tentative: bool = False
    ) -> _SearchResult:
        """The result with given effects; ``tentative`` ones are incomplete if the first optimum does not vibrate."""
        context = self.context(chosen, strip)

        def confirm_vibration(local: LocalResult) -> None:
            if "rod_inertia" not in self.selected.at(local.best.outcome.value.dimensions):
                raise NoVibration

        if tentative:
            context.confirm_vibration = confirm_vibration
        beyond = _beyond(chosen)
        if not beyond:
            return self.core_result(context, proof, excess, strip)
        influence = self.selected.influence(strip, beyond)
        # Infeasible unless effects change the results by more than three times the bound of their influence.
        clearly_infeasible = excess > max(_RECOVERABLE_EXCESS, 3.0 * influence)
        # If effects may change results by 100 %, the stiffest strip, which vibrates least, is a start, too.
        starts = [strip, *self.known, *([context.bounds.stiffest] if influence > 1.0 else [])]
        attainable = self.requirements_as_objectives(context)
        try:
            optimum, complete = self.full_optimum(context, attainable, excess, starts, clearly_infeasible), True
        except NoVibration:
            optimum, complete = context.best_within_budget(), False
        if _is_feasible(optimum):
            best = optimum.local.best.outcome.value.dimensions
            return _SearchResult(chosen, best, 0.0, partial(self.answer, context, proof, beyond, optimum), complete)
        if self.out_of_time and optimum is None:
            return _SearchResult(chosen, strip, math.inf, self.answers.failed)
        missed = math.inf if optimum is None else optimum.local.best.excess
        strip = strip if optimum is None else optimum.local.best.outcome.value.dimensions
        compose = partial(self.answers.infeasible, context, attainable, proof, strip, beyond, optimum)
        return _SearchResult(chosen, strip, missed, compose, complete)

    def answer(self, context: Context, proof: Proof, beyond: tuple[str, ...], optimum: Optimum) -> Outcome[RodDesign]:
        """The outcome of the best strip on the full model, after refining checks according to the multipliers of its
        limits."""
        best = optimum.local.best
        if not self.out_of_time:
            fixed = self.sizes.around(best.outcome.value.dimensions)
            optimum.conditions = optimum.conditions or first_order_conditions(context, best, context.bounds, fixed)
            try:
                context, optimum = refine_checks(context, optimum, fixed)
            except OutOfTime:
                self.out_of_time = True
        return self.answers.of_full_model(context, proof, beyond, optimum)

    def core_result(self, context: Context, proof: Proof, excess: float, strip: Dimensions) -> _SearchResult:
        """The result without effects beyond the core: the core's optimum, with limits corrected until a check satisfies
        them."""
        p, limits, latest, chosen = self.problem, dict(self.limits), proof, context.model.effects.include
        # Growing, since a search meets limits only to its own tolerance.
        for margin in _CORRECTION_MARGINS:
            best = latest.best
            if best is None:
                break
            outcome = context.model.check(best.dimensions)
            if p.requirements.met_by(outcome.value):
                compose = partial(self.answers.of_core, context, proof, best, outcome, limits)
                return _SearchResult(chosen, best.dimensions, 0.0, compose)
            if outcome.value.stresses is None:
                limits[rows.STABILITY] -= 1e-6
            else:
                margin *= self.accuracy
                limits = dict(context.corrected_core_limits(best.dimensions, outcome.value, margin))
            latest = search(self.cycle, p.objective, limits, self.sizes, self.accuracy, MAX_BOXES)
        attainable = self.requirements_as_objectives(context)
        compose = partial(self.answers.infeasible, context, attainable, proof, strip, (), None)
        return _SearchResult(chosen, strip, max(excess - _UNRESOLVED_EXCESS, MIN_EXCESS), compose)

    def full_optimum(
        self, context: Context, attainable: RequirementsAsObjectives, excess: float, starts: Sequence[Dimensions],
        clearly_infeasible: bool,
    ) -> Optimum | None:  # fmt: skip
        """The best strip on the full model found within the time."""
        try:
            optimum = None if excess > 0.0 else self.optimum_from(context, starts)
            if _is_feasible(optimum) or not math.isfinite(excess):
                return optimum
            nearest = least_violating(context, starts[0], clearly_infeasible)
            if nearest is None:
                return None
            if self.relaxes and self.is_nearly_met(nearest.best.excess):
                return Optimum(nearest, searches=context.search_count)
            ends = [] if nearest.best.feasible else [nearest]
            for start in self.promising_strips(attainable, nearest, clearly_infeasible):
                optimum = self.optimum_from(context, [start])
                if _is_feasible(optimum):
                    return optimum
                # At low accuracy a search does not find strips in the little room that limits may leave.
                end = context.search_from(start, context.slice_around(start))
                ends += [] if end is None else [end]
            closest = min(ends, key=lambda end: end.best.excess, default=None)
            return optimum if closest is None else Optimum(closest, searches=context.search_count)
        except OutOfTime:
            self.out_of_time = True
            return context.best_within_budget()

    def promising_strips(
        self, attainable: RequirementsAsObjectives, nearest: LocalResult, clearly_infeasible: bool
    ) -> Iterator[Dimensions]:
        """Strips from which to search: the least violating one, if it is feasible, and the optimum of a requirement
        that it violates, if that meets this requirement, too, to within its error.

        The violation may have a local minimum between any two resonances; a design searches all of them.
        """
        closest = nearest.best.outcome.value
        if nearest.feasible_best is not None:
            yield closest.dimensions
        # If it violates none, its sizes are not available, and any requirement will do.
        violated = attainable.first_violated(closest)
        best = None if violated is None else attainable.best(violated)
        if best is not None and attainable.may_be_met_by(best):
            yield best.check.dimensions
        # The search for the best value may have run out of time; what clearly cannot be met is diagnosed nevertheless.
        if not clearly_infeasible:
            self.watch()

    def requirements_as_objectives(self, context: Context) -> RequirementsAsObjectives:
        design_of = partial(self.other_design, context.model.effects)
        return RequirementsAsObjectives(self.problem, self.accuracy, design_of, self.is_in_time)

    def is_in_time(self) -> bool:
        try:
            self.watch()
        except OutOfTime:
            return False
        return True

    def other_design(self, effects: EffectSelection, problem: RodProblem) -> AttainableBest | None:
        """The design of another problem in the same scene; None if infeasible or if no time is left."""
        if not self.is_in_time():
            return None
        key = effects, problem.objective.name, problem.requirements
        if key not in self.other_designs:
            self.other_designs[key] = self.attainable_best(effects, problem)
        return self.other_designs[key]

    def attainable_best(self, effects: EffectSelection, problem: RodProblem) -> AttainableBest | None:
        objective, asked = problem.objective.name, problem.requirements
        similar = (best for (_, name, _), best in self.other_designs.items() if name == objective and best is not None)
        known = tuple(best.check.dimensions for best in similar if asked.met_by(best.check))
        other = replace(self, problem=problem, selection=effects, relaxes=False, known=known)
        result = other.result_with_selected_effects()
        if not result.feasible:
            return None
        outcome = result.compose_answer()
        opponents = tuple(BY_NAME[a.name] for a in outcome.value.active if a.name in BY_NAME)
        return AttainableBest(outcome.value.check, outcome.accuracy.estimated, opponents)

    def optimum_from(self, context: Context, starts: Sequence[Dimensions]) -> Optimum | None:
        return (discrete_optimum if self.sizes.discrete else continuous_optimum)(context, starts)

    def is_nearly_met(self, excess: float) -> bool:
        """Whether a strip violates the requirements, but by little more than the maximum slack."""
        return 0.0 < excess < _MAX_MISSED * self.max_slack

    @property
    def answers(self) -> Answers:
        p = self.problem
        return Answers(p, self.cycle, self.sizes, self.accuracy, self.slack, self.selected.influence, self.out_of_time)


def _is_feasible(optimum: Optimum | None) -> bool:
    return optimum is not None and optimum.local.feasible_best is not None


def _beyond(chosen: frozenset[str]) -> tuple[str, ...]:
    """Those effects that go beyond the core."""
    return tuple(sorted(chosen - _CORE))
