"""Optimisation of the strip: the core's global optimum with its proof, then the best strip on the full model."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

from solvers.effects import AUTO, Choice, EffectSelection
from solvers.fatigue import FatigueCriterion, serensen
from solvers.outcome import (
    EffectReport,
    EffectState,
    Outcome,
)
from solvers.rod import rows
from solvers.rod.check import RodCheck
from solvers.rod.constraints import BY_NAME
from solvers.rod.cycle.composition import Cycle
from solvers.rod.effects import EFFECTS, RodEffect, choose_for, compose
from solvers.rod.optimum.answer.composition import Answers, RodDesign
from solvers.rod.optimum.answer.requirement_as_objective import AttainableBest, RequirementsAsObjectives
from solvers.rod.optimum.core.cycle import core_cycle
from solvers.rod.optimum.full_model.corrections import stands
from solvers.rod.optimum.full_model.model import FullModel, no_watch
from solvers.rod.optimum.proof.outer_approximation import Proof, Sizes, search
from solvers.rod.optimum.search.available_sizes import discrete_optimum
from solvers.rod.optimum.search.costly_limits import with_finer_checks
from solvers.rod.optimum.search.feasibility import least_violating, least_violation
from solvers.rod.optimum.search.full_optimum import BOXES, Context, Optimum, conditions_at, continuous_optimum
from solvers.rod.optimum.search.local_search import Local, Task
from solvers.rod.optimum.sqp import required_results
from solvers.rod.problem import Bounds, RodProblem
from solvers.rod.scene import Dimensions
from solvers.watch import OutOfTime, Watch

_INERTIA = "reciprocating_inertia"
_CORE = frozenset({_INERTIA, "beam_column", "friction"})
_MAX_SELECTIONS = 3
"""Maximum number of effect selections at the optimum."""
_GUARD, _MIN_GAIN = 0.05, 0.1
"""Fractions of the accuracy: safety distance of the answer from its limits, and the gain not worth another step."""
_COARSE_GAP, _SHARE = 1e-3, 0.1
"""Gap of the core's first search, and of its last one as a share of what effects beyond the core may change."""
_CORRECTIONS = 6
_MOST_UNKNOWN = 1e-3
"""So much of it at the most counts."""
_MAX_EXCESS = 0.1
"""Logarithmic excess over the core's limits below which effects may restore feasibility."""
_CLOSE = 0.05
"""Excess, in logarithms, up to which another search for an admissible strip is worth its time."""
_ROUGH = 1e-4
"""The accuracy of that search."""
_ROUNDS = 6
"""Of a local search for what is attainable."""
_MAX_STRIPS = 100
"""Evaluations allowed, regardless of time, in search of a first admissible strip."""


def design(
    problem: RodProblem,
    effects: EffectSelection = AUTO,
    effect_tolerance: float = 1e-2,
    accuracy: float = 1e-6,
    criterion: FatigueCriterion | None = None,
    time_budget: float | None = None,
) -> Outcome[RodDesign]:
    """The optimal strip for a problem, or the diagnosis of infeasibility.

    Branch and bound over (ln tau, ln l), tau = 1/(b h^3), finds and proves the optimum of the core: gas load,
    reciprocating inertia, beam-column, contact. Effects are selected at that optimum. If they go beyond the core, SQP
    on the full model continues from there, and effects are selected again at its end, until none is added. The answer
    satisfies every requirement as evaluated by ``check``; the certificate states what is proven and what is not.

    ``accuracy`` is the requested relative numerical accuracy of results and optimum, 1e-12 … 1e-1. After
    ``time_budget`` seconds the search on the full model returns the best admissible strip known; without one it
    continues.
    """
    started = time.perf_counter()
    done = _Design(problem, effects, effect_tolerance, accuracy, criterion or serensen(problem.scene.material))
    if time_budget is not None:
        done.watch = Watch(time_budget)
    outcome = done.run()
    return replace(outcome, timing={"solve_s": time.perf_counter() - started})


@dataclass(frozen=True)
class _End:
    """Where a search ended: the strip at which effects are to be selected, and the answer, composed when it is needed,
    without its manifest."""

    strip: Dimensions
    feasible: bool
    answer: Callable[[], Outcome[RodDesign]]


@dataclass
class _Design:
    """State of one design run."""

    problem: RodProblem
    selection: EffectSelection
    effect_tolerance: float
    accuracy: float
    criterion: FatigueCriterion
    watch: Callable[[], None] = no_watch
    out_of_time: bool = False

    def __post_init__(self) -> None:
        p = self.problem
        self.sizes = Sizes(p.bounds, p.stock_h, p.step_b, p.step_l)
        self.limits = p.requirements.limits(p.scene)

    def run(self) -> Outcome[RodDesign]:
        chosen, end = self.ended()
        return replace(end.answer(), effects=self.manifest(end.strip, chosen))

    def ended(self) -> tuple[frozenset[str], _End]:
        """The end with the effects that its strip calls for, and these."""
        chosen, proof, excess, strip = self.proven(frozenset())
        end = self.solved(chosen, proof, excess, strip)
        for _ in range(_MAX_SELECTIONS - 1):
            further = self.chosen_at(end.strip) - chosen
            if not further or self.out_of_time:
                break
            chosen, strip = chosen | further, end.strip
            if _INERTIA in further:
                chosen, proof, excess, strip = self.proven(chosen)
            end = self.solved(chosen, proof, excess, strip)
        return chosen, end

    def proven(self, chosen: frozenset[str]) -> tuple[frozenset[str], Proof, float, Dimensions]:
        """The core's optimum as ``core_search`` has it, after the effects ``chosen``, with those that it needs.

        Where effects go beyond the core, its bound is widened by their influence, and is sought to a share of that.
        """
        gap, proof = max(_COARSE_GAP, self.accuracy), None
        while True:
            moving = _INERTIA in chosen
            proof, excess, strip = self.core_search(moving, gap, proof)
            chosen |= self.chosen_at(strip)
            if moving != (_INERTIA in chosen):
                # The relevance of inertia is evaluated at a strip, which itself depends on it.
                proof = None
                continue
            enough = max(_SHARE * self.influence(strip, _beyond(chosen)), self.accuracy)
            if gap <= enough or proof.best is None:
                return chosen, proof, excess, strip
            gap = max(0.5 * enough, self.accuracy)

    def core_search(self, moving: bool, gap: float, before: Proof | None) -> tuple[Proof, float, Dimensions]:
        """The core's optimum; if infeasible, the excess over the limits and the strip with the least excess."""
        p = self.problem
        mass = p.scene.piston.reciprocating_mass if moving else 0.0
        self.cycle = core_cycle(p.scene, self.criterion, mass)
        proof = search(self.cycle, p.objective, self.limits, self.sizes, gap, BOXES, before)
        if proof.best is not None:
            return proof, 0.0, proof.best.dimensions
        b = p.bounds
        least = least_violation(self.cycle, self.limits, Bounds(b.b, b.h, (b.l[0], min(b.l[1], self.cycle.rod_length))))
        return (proof, *least) if least is not None else (proof, math.inf, b.stiffest)

    def choice_at(self, strip: Dimensions) -> Choice[RodEffect]:
        p = self.problem
        demands = p.requirements.demands() + p.objective.demands()
        return choose_for(p.scene, strip, self.selection, self.effect_tolerance, demands)

    def chosen_at(self, strip: Dimensions) -> frozenset[str]:
        """The effects selected at a strip."""
        return frozenset(effect.name for effect in self.choice_at(strip).active)

    def manifest(self, strip: Dimensions, chosen: frozenset[str]) -> tuple[EffectReport, ...]:
        """The effects of the answer; those selected only at intermediate strips are reported as such."""
        why = "needed by a strip that the search evaluated"
        return tuple(
            report._replace(state=EffectState.ACTIVE, why=why)
            if report.name in chosen and report.state is EffectState.SKIPPED
            else report
            for report in self.choice_at(strip).manifest
        )

    def unknown(self, model: FullModel, strip: Dimensions) -> float:
        """What a check leaves unknown beyond the accuracy where a table's points set the strip ringing: a gain of less
        is not worth a step."""
        if not model.textured or not stands(Cycle(self.problem.scene, strip, model.composition)):
            return 0.0
        accuracy = model.check(strip).accuracy
        return 0.0 if accuracy.estimated <= self.accuracy else min(accuracy.estimated, _MOST_UNKNOWN)

    def context(self, chosen: frozenset[str], strip: Dimensions) -> Context:
        p = self.problem
        settled = EffectSelection(chosen, frozenset(effect.name for effect in EFFECTS) - chosen)
        # With settled effects any strip will do.
        composition = compose(choose_for(p.scene, p.bounds.stiffest, settled, self.effect_tolerance))
        wanted = required_results(p.objective, self.limits)
        model = FullModel(
            p.scene, composition, self.criterion, settled, self.effect_tolerance, self.accuracy, wanted, self.sizes.free
        )
        guard = _GUARD * self.accuracy
        enough = max(_MIN_GAIN * self.accuracy, self.unknown(model, strip))
        task = Task(p.objective, p.requirements, self.limits, guard, enough)
        context = Context(p, self.cycle, model, task, self.sizes)

        def watch() -> None:
            try:
                self.watch()
            except OutOfTime:
                # Still wait for the first admissible strip, up to _MAX_STRIPS.
                if model.strips > _MAX_STRIPS or context.known():
                    raise

        model.watch = watch
        return context

    def solved(self, chosen: frozenset[str], proof: Proof, excess: float, strip: Dimensions) -> _End:
        """The end with these effects."""
        context = self.context(chosen, strip)
        beyond = _beyond(chosen)
        if not beyond:
            return self.on_core(context, proof, strip)
        influence = self.influence(strip, beyond)
        # Infeasible unless the effects changed the results by more than three times their bound.
        hopeless = excess > max(_MAX_EXCESS, 3.0 * influence)
        # Where effects may change results by as much as these are, the strip that vibrates least is a start, too.
        starts = [strip, context.bounds.stiffest] if influence > 1.0 else [strip]
        quick = not context.model.rings and not self.sizes.discrete
        effects = context.model.effects
        alone = RequirementsAsObjectives(
            self.problem, partial(self.reached, effects), partial(self.led, effects), quick
        )
        optimum = self.on_full_model(context, alone, excess, starts, hopeless)
        if _found(optimum):
            best = optimum.local.best.outcome.value.dimensions
            return _End(best, True, partial(self.answer, context, proof, beyond, optimum))
        if self.out_of_time and optimum is None:
            return _End(strip, False, self.answers.failed)
        strip = strip if optimum is None else optimum.local.best.outcome.value.dimensions
        return _End(strip, False, partial(self.answers.infeasible, context, alone, proof, strip, beyond, optimum))

    def answer(self, context: Context, proof: Proof, beyond: tuple[str, ...], optimum: Optimum) -> Outcome[RodDesign]:
        """What is told of the best strip of the full model, whose limits are resolved as finely as they cost."""
        best = optimum.local.best
        if not self.out_of_time:
            fixed = self.sizes.around(best.outcome.value.dimensions)
            optimum.conditions = optimum.conditions or conditions_at(context, best, context.bounds, fixed)
            try:
                context, optimum = with_finer_checks(context, optimum, fixed)
            except OutOfTime:
                self.out_of_time = True
        return self.answers.of_full_model(context, proof, beyond, optimum)

    def on_core(self, context: Context, proof: Proof, strip: Dimensions) -> _End:
        """The end if no effect goes beyond the core: the search's optimum, with the limits as a check evaluates
        them."""
        p, limits, latest = self.problem, dict(self.limits), proof
        for _ in range(_CORRECTIONS):
            best = latest.best
            if best is None:
                break
            outcome = context.model.check(best.dimensions)
            if p.requirements.met_by(outcome.value):
                return _End(best.dimensions, True, partial(self.answers.of_core, context, proof, best, outcome, limits))
            if outcome.value.stresses is None:
                limits[rows.STABILITY] -= 1e-6
            else:
                limits = dict(context.core_limits_at(best.dimensions, outcome.value, 1e-3 * self.accuracy))
            latest = search(self.cycle, p.objective, limits, self.sizes, self.accuracy, BOXES)
        nothing = RequirementsAsObjectives(p, lambda _: None, lambda *_: None, False)
        return _End(strip, False, partial(self.answers.infeasible, context, nothing, proof, strip, (), None))

    def on_full_model(
        self, context: Context, alone: RequirementsAsObjectives, excess: float, starts: Sequence[Dimensions],
        hopeless: bool,
    ) -> Optimum | None:  # fmt: skip
        """The best strip on the full model found within the time."""
        try:
            optimum = None if excess > 0.0 else self.optimum_from(context, starts)
            if _found(optimum) or not math.isfinite(excess):
                return optimum
            nearest = least_violating(context, starts[0], hopeless)
            if nearest is None:
                return None
            for start in self.admissible(alone, nearest, hopeless):
                optimum = self.optimum_from(context, [start])
                if _found(optimum):
                    return optimum
            return Optimum(nearest, starts=context.starts) if nearest.found is None else optimum
        except OutOfTime:
            self.out_of_time = True
            return context.best_in_time()

    def admissible(self, alone: RequirementsAsObjectives, nearest: Local, hopeless: bool) -> Iterator[Dimensions]:
        """Strips that meet all requirements: that which misses them least, if it misses none, and the best by one that
        it misses, if that meets this one, too.

        What a strip misses may have minima between any two resonances; an optimum is looked for in all of them.
        """
        close = nearest.best.outcome.value
        if nearest.found is not None:
            yield close.dimensions
        # If it misses none, its sizes are not to be had: any requirement will do.
        missed = alone.first_violated(close)
        worth = alone.quick or (not hopeless and nearest.best.excess < _CLOSE)
        best = alone.best(missed) if worth and missed is not None else None
        if best is not None and self.problem.requirements.met_by(best.check):
            yield best.check.dimensions
        # Without time left the best one may not have been found.
        self.watch()

    def reached(self, effects: EffectSelection, problem: RodProblem) -> AttainableBest | None:
        """The design of another problem in the same scene, roughly; None where it is infeasible or no time is left."""
        try:
            self.watch()
        except OutOfTime:
            return None
        _, end = replace(self, problem=problem, selection=effects, accuracy=max(self.accuracy, _ROUGH)).ended()
        if not end.feasible:
            return None
        outcome = end.answer()
        opponents = tuple(BY_NAME[a.name] for a in outcome.value.active if a.name in BY_NAME)
        return AttainableBest(outcome.value.check, outcome.accuracy.estimated, opponents)

    def led(self, effects: EffectSelection, problem: RodProblem, strip: Dimensions) -> Outcome[RodCheck] | None:
        """The end of one local search for another problem in the same scene, roughly; None where it meets not all
        requirements or no time is left."""
        other = replace(self, problem=problem, selection=effects, accuracy=max(self.accuracy, _ROUGH))
        other.cycle = self.cycle
        context = other.context(effects.include, strip).explored(strip)
        try:
            end = context.search_from(strip, context.bounds, rounds=_ROUNDS)
        except OutOfTime:
            return None
        return None if end is None or end.found is None else end.found.outcome

    def optimum_from(self, context: Context, starts: Sequence[Dimensions]) -> Optimum | None:
        return (discrete_optimum if self.sizes.discrete else continuous_optimum)(context, starts)

    @property
    def answers(self) -> Answers:
        p = self.problem
        return Answers(p, self.cycle, self.sizes, self.accuracy, self.influence, self.out_of_time)

    def influence(self, strip: Dimensions, beyond: tuple[str, ...]) -> float:
        """Sum of the bounds of the effects beyond the core at a strip."""
        return sum(report.influence for report in self.choice_at(strip).manifest if report.name in beyond)


def _found(optimum: Optimum | None) -> bool:
    return optimum is not None and optimum.local.found is not None


def _beyond(chosen: frozenset[str]) -> tuple[str, ...]:
    """Those effects that go beyond the core."""
    return tuple(sorted(chosen - _CORE))
