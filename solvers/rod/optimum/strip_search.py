"""The best strip with given effects: the core's certified optimum, then local searches on the full model; or, if there
is none, the strip that violates the requirements least, and the diagnosis.

Which effects are given is decided by ``solvers.rod.design``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from weakref import ref

from solvers.effects import EffectSelection
from solvers.fatigue import FatigueCriterion
from solvers.outcome import Outcome
from solvers.rod import rows
from solvers.rod.effects import EFFECTS, choose_for
from solvers.rod.optimum.answer.answers import Answers
from solvers.rod.optimum.answer.requirement_as_objective import AttainableBest, RequirementsAsObjectives
from solvers.rod.optimum.answer.result import RodDesign, SearchResult
from solvers.rod.optimum.core.cycle import CoreCycle, core_cycle
from solvers.rod.optimum.full_model.model import FullModel
from solvers.rod.optimum.proof.outer_approximation import MAX_BOXES, Proof, search
from solvers.rod.optimum.search.context import Context, OtherEffects, Suffices, never
from solvers.rod.optimum.search.continuous_sizes import continuous_optimum
from solvers.rod.optimum.search.costly_limits import refine_checks
from solvers.rod.optimum.search.discrete_sizes import discrete_optimum
from solvers.rod.optimum.search.earlier_search import MAX_INFLUENCE, EarlierSearch
from solvers.rod.optimum.search.effect_selection import EffectsAtStrips
from solvers.rod.optimum.search.feasibility import least_violating, least_violation
from solvers.rod.optimum.search.local_search import MIN_EXCESS, LocalResult, Task
from solvers.rod.optimum.search.optimality import first_order_conditions
from solvers.rod.optimum.search.optimum import Optimum
from solvers.rod.optimum.search.other_gaps import optimum_near
from solvers.rod.optimum.sizes import Sizes
from solvers.rod.optimum.sqp import required_results
from solvers.rod.problem import RodProblem
from solvers.rod.scene import Dimensions
from solvers.verdict import MAX_SLACK
from solvers.watch import OutOfTime, in_time

_CORE = frozenset({"reciprocating_inertia", "beam_column", "friction"})
_MARGIN, _MIN_GAIN, _NEGLIGIBLE_GAIN = 0.05, 0.1, 0.5
"""Fractions of the accuracy: margin to the limits, the gain not worth another step, and that not worth a search."""
_CORRECTION_MARGINS = (1e-3, 1e-3, 1e-2, 0.1, 1.0, 1.0)
"""Fractions of the accuracy: margins of the core's searches in turn, until a check meets the requirements."""
_RECOVERABLE_EXCESS = 0.1
"""Logarithmic excess over the core's limits below which effects may restore feasibility."""
_UNRESOLVED_EXCESS = 2e-3
"""Excess over the core's limits that the search for the least one does not distinguish from 0."""
_MAX_MISSED = 10.0
"""Fraction of the maximum slack that a search may miss the requirements by where a relaxed one may meet them, as the
searches for the least violation are less exact than others."""
_MAX_STRIPS = 100
"""Evaluations allowed, regardless of time, in search of a first feasible strip."""


def beyond_core(chosen: frozenset[str]) -> tuple[str, ...]:
    """Those effects that go beyond the core's physics."""
    return tuple(sorted(chosen - _CORE))


@dataclass(frozen=True)
class CoreOptimum:
    """The core's optimum with its proof; without one, the strip with the least ``excess`` over the core's limits
    (logarithmic)."""

    cycle: CoreCycle
    proof: Proof
    excess: float
    strip: Dimensions

    def starting_at(self, strip: Dimensions) -> CoreOptimum:
        """The same with another strip, which may be feasible on the full model, to start from."""
        return replace(self, excess=0.0, strip=strip)


class AnsweredByOther(Exception):
    """The optimum without the limit on its objective meets this limit, too."""

    def __init__(self, result: SearchResult) -> None:
        self.result = result


@dataclass
class StripSearch:
    """Searches of one problem.

    selected       the effects selected at strips, with the bounds of their influence
    other_design   design of another problem in the same scene, beginning with given effects; None if infeasible or
                   out of time; raises ``Sufficient`` at the first strip whose check suffices
    relaxes        whether requirements that leave no room will be relaxed within the accuracy
    slack          by how much the problem's requirements have been relaxed
    known          strips with the greatest value of the objective under other requirements: further starts
    suffices       whether a feasible strip with this check ends the search (by ``Sufficient``)
    out_of_time    whether the time has ended a search
    earlier        what the last search with resonances found
    """

    problem: RodProblem
    selected: EffectsAtStrips
    accuracy: float
    criterion: FatigueCriterion
    watch: Callable[[], None]
    other_design: Callable[[frozenset[str], RodProblem, Suffices], AttainableBest | None]
    relaxes: bool = True
    slack: float = 0.0
    known: tuple[Dimensions, ...] = ()
    suffices: Suffices = never
    out_of_time: bool = False
    earlier: EarlierSearch | None = None

    def __post_init__(self) -> None:
        p = self.problem
        # Searches on the core do not evaluate strips longer than the rod.
        self.sizes = Sizes(p.bounds.up_to(p.scene.mechanism.rod_length), p.stock_h, p.step_b, p.step_l)
        self.limits = p.requirements.limits(p.scene)

    def core(self, with_inertia: bool, gap: float, earlier: CoreOptimum | None) -> CoreOptimum:
        """The core's optimum to a ``gap``, continued from an ``earlier`` one of the same cycle."""
        p = self.problem
        mass = p.scene.piston.reciprocating_mass if with_inertia else 0.0
        cycle = core_cycle(p.scene, self.criterion, mass)
        previous = None if earlier is None else earlier.proof
        proof = search(cycle, p.objective, self.limits, self.sizes, gap, MAX_BOXES, previous)
        if proof.best is not None:
            return CoreOptimum(cycle, proof, 0.0, proof.best.dimensions)
        least = least_violation(cycle, self.limits, self.sizes.bounds)
        return CoreOptimum(cycle, proof, *(least if least is not None else (math.inf, p.bounds.stiffest)))

    def with_effects(self, chosen: frozenset[str], core: CoreOptimum, tentative: bool = False) -> SearchResult:
        """The result with given effects; with resonances a ``tentative`` search ends, incomplete, at its first optimum
        if that calls for other effects."""
        context, beyond = self._context(chosen, core.cycle), beyond_core(chosen)
        if not beyond:
            return self._on_core(context, chosen, core)
        if tentative:
            context.confirm_effects = partial(self._confirm_effects, chosen)
        influence = self.selected.influence(core.strip, beyond)
        # Infeasible unless effects change the results by more than three times the bound of their influence.
        clearly_infeasible = core.excess > max(_RECOVERABLE_EXCESS, 3.0 * influence)
        # If effects may change results by 100 %, the stiffest strip, which vibrates least, is a start, too.
        starts = [core.strip, *self.known, *([context.sizes.bounds.stiffest] if influence > 1.0 else [])]
        attainable = self._requirements_as_objectives(chosen)
        try:
            optimum = self._on_full_model(context, attainable, core, starts, clearly_infeasible)
        except OtherEffects as ended:
            self._remember(context, chosen, None)
            compose = partial(self._answer_so_far, context, core.proof, beyond)
            return SearchResult(chosen, ended.strip, 0.0, compose, complete=False)
        except AnsweredByOther as other:
            return other.result
        if _is_feasible(optimum):
            self._remember(context, chosen, optimum)
            compose = partial(self._answer, context, core.proof, beyond, optimum)
            return SearchResult(chosen, optimum.local.at.dimensions, 0.0, compose)
        if self.out_of_time and optimum is None:
            return SearchResult(chosen, core.strip, math.inf, self._answers(context).failed)
        missed = math.inf if optimum is None else optimum.local.at.excess
        strip = core.strip if optimum is None else optimum.local.at.dimensions
        compose = partial(self._answers(context).infeasible, attainable, core.proof, strip, beyond, optimum)
        return SearchResult(chosen, strip, missed, compose)

    def is_nearly_met(self, excess: float) -> bool:
        """Whether a strip violates the requirements, but by little more than the maximum slack."""
        return 0.0 < excess < _MAX_MISSED * self.max_slack

    @property
    def max_slack(self) -> float:
        """The relative violation of a requirement that does not count, as in the verdict."""
        return min(self.accuracy, MAX_SLACK)

    def _confirm_effects(self, chosen: frozenset[str], found: LocalResult) -> None:
        """End the search if the strip found calls for other effects than those chosen."""
        if chosen != self.selected.at(found.at.dimensions):
            raise OtherEffects(found.at.dimensions)

    def _context(self, chosen: frozenset[str], cycle: CoreCycle) -> Context:
        p = self.problem
        fixed = EffectSelection(chosen, frozenset(effect.name for effect in EFFECTS) - chosen)
        # A fixed selection does not depend on the strip.
        choice = choose_for(p.scene, p.bounds.stiffest, fixed, self.selected.tolerance)
        required = required_results(p.objective, self.limits)
        model = FullModel(p.scene, choice, self.criterion, self.accuracy, required, self.sizes.free)
        task = Task(p, *(share * self.accuracy for share in (_MARGIN, _MIN_GAIN, _NEGLIGIBLE_GAIN)))
        earlier = self._earlier_search(chosen) if model.has_resonances else None
        context = Context(p, cycle, model, task, self.sizes, suffices=self.suffices, earlier=earlier)
        # Weak, as the model holds the watch: a cycle would keep all strips until it is collected.
        reference = ref(context)

        def watch() -> None:
            try:
                self.watch()
            except OutOfTime:
                # Continue to the first feasible strip, up to _MAX_STRIPS evaluations.
                searched = reference()
                if searched is None or searched.model.strip_count > _MAX_STRIPS or searched.feasible_checks():
                    raise

        model.watch = watch
        return context

    def _on_core(self, context: Context, chosen: frozenset[str], core: CoreOptimum) -> SearchResult:
        """The result without effects beyond the core: the core's optimum, with limits corrected until a check satisfies
        them."""
        p, limits, latest = self.problem, dict(self.limits), core.proof
        # Growing, since a search meets limits only to its own tolerance.
        for margin in _CORRECTION_MARGINS:
            best = latest.best
            if best is None:
                break
            outcome = context.model.check(best.dimensions)
            if p.requirements.met_by(outcome.value):
                compose = partial(self._answers(context).of_core, core.proof, best, outcome, limits)
                return SearchResult(chosen, best.dimensions, 0.0, compose)
            if outcome.value.stresses is None:
                limits[rows.STABILITY] -= 1e-6
            else:
                margin *= self.accuracy
                limits = dict(context.corrected_core_limits(outcome.value, margin))
            latest = search(core.cycle, p.objective, limits, self.sizes, self.accuracy, MAX_BOXES)
        attainable = self._requirements_as_objectives(chosen)
        compose = partial(self._answers(context).infeasible, attainable, core.proof, core.strip, (), None)
        return SearchResult(chosen, core.strip, max(core.excess - _UNRESOLVED_EXCESS, MIN_EXCESS), compose)

    def _on_full_model(
        self, context: Context, attainable: RequirementsAsObjectives, core: CoreOptimum, starts: Sequence[Dimensions],
        clearly_infeasible: bool,
    ) -> Optimum | None:  # fmt: skip
        """The best strip on the full model found within the time.

        Under relaxed requirements a ringing strip is searched for next to the given one alone, since that comes from a
        search over all gaps between resonances.
        """
        rings, excess = context.model.has_resonances, core.excess
        try:
            if rings and self.slack > 0.0:
                return optimum_near(context, core.strip)
            optimum = None if excess > 0.0 else self._optimum_from(context, starts)
            if _is_feasible(optimum) or not math.isfinite(excess):
                return optimum
            nearest = least_violating(context, starts[0], clearly_infeasible)
            if nearest is None:
                return None
            if self.relaxes and not rings and self.is_nearly_met(nearest.at.excess):
                return Optimum(nearest)
            ends = [] if nearest.feasible else [nearest]
            for start, has_room in self._promising_strips(attainable, nearest, clearly_infeasible):
                optimum = self._optimum_from(context, [start]) if has_room or not rings else None
                if rings and not _is_feasible(optimum):
                    # At low accuracy a search does not find strips in the little room that limits may leave.
                    optimum = optimum_near(context, start)
                if _is_feasible(optimum):
                    return optimum
                ends += [] if optimum is None else [optimum.local]
            closest = min(ends, key=lambda end: end.at.excess, default=None)
            return optimum if closest is None else Optimum(closest)
        except OutOfTime:
            self.out_of_time = True
            return context.best_so_far()

    def _promising_strips(
        self, attainable: RequirementsAsObjectives, nearest: LocalResult, clearly_infeasible: bool
    ) -> Iterator[tuple[Dimensions, bool]]:
        """Strips from which to search, and whether there may be feasible ones far from them.

        First the least violating strip, if it is feasible. Then two from the design for a requirement that it violates:
        the first strip that clearly meets the requirement, and the best one, if that meets it to within its error. If
        the best one hardly meets it, no strip in another gap between resonances does. The violation may have a local
        minimum between any two resonances; a design searches all of them.
        """
        closest = nearest.at.outcome.value
        if nearest.feasible:
            yield closest.dimensions, True
        # If it violates none, its sizes are not available, and any requirement will do.
        violated = attainable.first_violated(closest)
        if violated is not None and violated.result != self.problem.objective:
            room = _MAX_MISSED * self.max_slack
            if (strip := attainable.first_meeting(violated, room)) is not None:
                yield strip, True
        best = None if violated is None else attainable.best(violated)
        if best is not None and attainable.may_be_met_by(best):
            if violated.result == self.problem.objective and self.problem.requirements.met_by(best.check):
                raise AnsweredByOther(best.result)
            stricter = self.problem.requirements.relaxed(-_MAX_MISSED * self.max_slack)
            yield best.check.dimensions, violated.meets(best.check, getattr(stricter, violated.name))
        # The search for the best value may have run out of time; what clearly cannot be met is diagnosed nevertheless.
        if not clearly_infeasible:
            self.watch()

    def _optimum_from(self, context: Context, starts: Sequence[Dimensions]) -> Optimum | None:
        return (discrete_optimum if self.sizes.discrete else continuous_optimum)(context, starts)

    def _remember(self, context: Context, chosen: frozenset[str], optimum: Optimum | None) -> None:
        """Keep what a search with resonances has found, but for its models of rows, which hold its strips; without an
        optimum it ended before other gaps were searched."""
        if context.coarse is None or self.out_of_time:
            return
        found = optimum or Optimum(context.coarse.best())
        best, *ends = (replace(end, at=replace(end.at, rows=None)) for end in (found.local, *context.coarse.results))
        self.earlier = EarlierSearch(replace(found, local=best), tuple(ends), chosen, complete=optimum is not None)

    def _earlier_search(self, chosen: frozenset[str]) -> EarlierSearch | None:
        """What the last search with resonances found, if the effects by which it differs have little influence."""
        earlier = self.earlier
        if earlier is None:
            return None
        strip = earlier.optimum.local.at.dimensions
        influence = self.selected.influence(strip, tuple(chosen ^ earlier.effects))
        return replace(earlier, influence=influence) if influence <= MAX_INFLUENCE else None

    def _requirements_as_objectives(self, chosen: frozenset[str]) -> RequirementsAsObjectives:
        design_of = partial(self.other_design, chosen)
        return RequirementsAsObjectives(self.problem, self.accuracy, design_of, partial(in_time, self.watch))

    def _answer_so_far(self, context: Context, proof: Proof, beyond: tuple[str, ...]) -> Outcome[RodDesign]:
        """The outcome of the best feasible strip checked so far, if there is one."""
        optimum = context.best_so_far()
        return self._answers(context).failed() if optimum is None else self._answer(context, proof, beyond, optimum)

    def _answer(self, context: Context, proof: Proof, beyond: tuple[str, ...], optimum: Optimum) -> Outcome[RodDesign]:
        """The outcome of the best strip on the full model, after refining checks according to the multipliers of its
        limits."""
        best = optimum.local.at
        if not self.out_of_time:
            try:
                optimum.conditions = optimum.conditions or first_order_conditions(context, best)
                context, optimum = refine_checks(context, optimum)
            except OutOfTime:
                self.out_of_time = True
        return self._answers(context).of_full_model(proof, beyond, optimum)

    def _answers(self, context: Context) -> Answers:
        return Answers(context, self.accuracy, self.slack, self.selected.influence, self.out_of_time)


def _is_feasible(optimum: Optimum | None) -> bool:
    return optimum is not None and optimum.local.feasible
