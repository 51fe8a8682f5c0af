"""The optimum on the full model: starting points of the local searches, and selection among their results.

The core's global optimum is the first start. With resonances the gaps between them are searched as well (``gaps``), at
low accuracy, and the best results are refined. Without, if the active limits leave directions free, the curvature of
the Lagrangian along them is evaluated; a Newton step with a predicted gain, or steps to both sides along negative
curvature, give further starts. Discrete sizes: see ``available_sizes``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from solvers.outcome import Outcome
from solvers.rod import rows
from solvers.rod.check import RodCheck
from solvers.rod.constraints import CONSTRAINTS, Limits
from solvers.rod.optimum.core.cycle import CoreCycle
from solvers.rod.optimum.core.optimum import dimensions_within
from solvers.rod.optimum.full_model.model import Array, FullModel
from solvers.rod.optimum.full_model.strip import dimensions_of, logarithms
from solvers.rod.optimum.proof.outer_approximation import Proof, Sizes, search
from solvers.rod.optimum.search.gaps import Gaps
from solvers.rod.optimum.search.local_search import (
    SAME_STRIP,
    TOTAL_GAIN_RATIO,
    Iterate,
    LocalResult,
    Task,
    local_search,
)
from solvers.rod.optimum.sensitivities import Stationarity, stationarity
from solvers.rod.problem import Bounds, RodProblem
from solvers.rod.scene import Dimensions
from solvers.watch import no_watch

MAX_BOXES = 20_000
_SHIFTED_MAX_BOXES, _SHIFTED_GAP = 2000, 1e-3
_CURVATURE_STEP = 0.02
"""Step of the differences for curvatures, in ln b, ln h, ln l."""
_MAX_STEP = 0.1
"""Length of a step along negative curvature, in ln b, ln h, ln l."""
_NEWTON_STEPS = 4
_MAX_GAP_SEARCHES, _MAX_GAP_FAILURES, _GAP_RADIUS = 12, 4, 0.01
"""Maximum numbers of searches in other gaps, in all and in succession without improvement; their first radius, in ln b,
ln h, ln l."""
_TIE = 5e-4
"""Difference in ln objective within which a result in another gap starts a search path of its own."""
_COARSE_ITERATIONS = 6
"""Maximum iterations of the first searches with resonances, which others follow."""
_FINE_RADIUS = 2e-3
"""First radius of searches at full accuracy, in ln b, ln h, ln l."""
_MAX_REFINEMENTS = 3
"""Maximum number of successive searches at full accuracy towards one local optimum."""
_MAX_CANDIDATES = 3
"""Maximum number of coarse results that are refined at full accuracy."""
_MIN_GAIN = 0.1
"""Share of the accuracy: a smaller gain is not worth another step."""
_COARSE_ACCURACY, _MAX_COARSE_ACCURACY = 1e-4, 1e-3
"""Accuracy of all searches but the last with resonances, and its maximum if no check attains it."""


@dataclass(frozen=True)
class SecondOrder:
    """The least curvature of the Lagrangian along the directions that limits leave free (None if there are none), the
    gain in ln objective predicted by a quadratic model within the step bounds, and the predicted steps in ln(b, h, l).
    """

    curvature: float | None
    predicted_gain: float
    steps: tuple[Array, ...]


@dataclass
class Optimum:
    """The best result of all local searches; ``local_optima`` is the number of different strips found."""

    local: LocalResult
    conditions: Stationarity | None = None
    second_order: SecondOrder | None = None
    searches: int = 0
    local_optima: int = 0
    remaining_gain: float = 0.0
    """Estimate of the gain in ln objective in other gaps between resonances, if the search there was cut short."""
    ratio_range: tuple[float, float] | None = None
    """Minimum and maximum frequency ratio of the gaps searched; None without resonances."""


class NoVibration(Exception):
    """The vibration of a strip found need not be modelled."""


def keep_vibration(local: LocalResult) -> None:
    """Search on, whatever strip was found."""


@dataclass
class Context:
    """A problem with its core, its full model, and the searches so far.

    ``confirm_vibration`` is called with the first optimum, before other gaps between resonances are searched, and may
    raise ``NoVibration``: most of the time is spent there, and without vibration there are no gaps.
    """

    problem: RodProblem
    cycle: CoreCycle
    model: FullModel
    task: Task
    sizes: Sizes
    results: list[LocalResult] = field(default_factory=list)
    start_points: list[Array] = field(default_factory=list)
    confirm_vibration: Callable[[LocalResult], None] = keep_vibration
    coarse: Context | None = None
    """The same problem at lower accuracy: with resonances all searches but the last are made there."""

    @property
    def search_count(self) -> int:
        """Number of local searches."""
        return len(self.start_points)

    @property
    def bounds(self) -> Bounds:
        """The bounds of the problem, with the length limited to the rod's."""
        b = self.sizes.bounds
        return Bounds(b.b, b.h, (b.l[0], min(b.l[1], self.cycle.rod_length)))

    def slice_around(self, d: Dimensions) -> Bounds:
        """These bounds, with discrete sizes fixed at the available ones nearest to a strip."""
        nearest = self.sizes.around(d)
        return Bounds(nearest.b, nearest.h, (nearest.l[0], min(nearest.l[1], self.cycle.rod_length)))

    def search_from(
        self, start: Dimensions, bounds: Bounds, radius: float = 0.15, max_iterations: int | None = None,
        incumbent: float = math.inf,
    ) -> LocalResult | None:  # fmt: skip
        """Run a local search and store its result; it is abandoned if it is not expected to improve on the ln objective
        ``incumbent``."""
        self.start_points.append(logarithms(start))
        # Without resonances there are few searches, which are to confirm each other's results.
        others, x = self.results if self.model.has_resonances else (), logarithms(start)
        local = local_search(self.model, self.task, bounds, x, radius, max_iterations, incumbent, others)
        if local is not None:
            self.results.append(local)
        return local

    def exploratory(self, start: Dimensions) -> Context:
        """The context for searches from a strip: with resonances one of low accuracy, or of the accuracy attainable by
        checks there, because higher accuracy only pays in the last steps."""
        if not self.model.has_resonances:
            return self
        model = self.model.coarser(_COARSE_ACCURACY)
        estimated = model.check(dimensions_within(self.bounds, logarithms(start))).accuracy.estimated
        if estimated > model.accuracy and not model.is_excited_by_corners:
            model = model.at_accuracy(min(estimated, _MAX_COARSE_ACCURACY))
        factor = model.accuracy / self.model.accuracy
        # If the error of checks exceeds the accuracy, the minimum gain already accounts for it.
        min_gain = max(min(factor * self.task.min_gain, _MIN_GAIN * model.accuracy), self.task.min_gain)
        task = replace(self.task, margin=factor * self.task.margin, min_gain=min_gain)
        self.coarse = replace(self, model=model, task=task, results=[])
        return self.coarse

    def finer(self) -> Context:
        """This context with the fine model. Under a noisy load the strips of its stencils must be exact, too, unless
        the error of checks exceeds the accuracy."""
        exact = self.model.is_excited_by_corners and self.task.min_gain <= self.model.accuracy
        return replace(self, model=self.model.finer(None if exact else self.coarse.model), results=[])

    def best(self) -> LocalResult | None:
        """The best result: feasible before infeasible, then by cost."""
        key = lambda local: (local.best.excess, local.best.log_cost)  # noqa: E731
        return min(self.results, key=key, default=None)

    def feasible_checks(self) -> list[Outcome[RodCheck]]:
        """Checks of available sizes that meet every requirement: the exact ones, or without any the coarse ones."""
        p = self.problem
        checks = (o for o in self.model.all_checks() if p.requirements.met_by(o.value))
        feasible = [o for o in checks if self.available(o.value.dimensions)]
        return feasible if feasible or self.coarse is None else self.coarse.feasible_checks()

    def cost(self, outcome: Outcome[RodCheck]) -> float:
        """The ln objective of a check."""
        return self.problem.objective.log_cost(outcome.value, self.model.scene.material.density)

    def available(self, d: Dimensions) -> bool:
        """Whether a strip's sizes are available."""
        nearest = self.sizes.around(d)
        limits = zip((d.b, d.h, d.l), (nearest.b, nearest.h, nearest.l), strict=True)
        return all(low <= size <= high for size, (low, high) in limits)

    def best_within_budget(self) -> Optimum | None:
        """The best feasible strip checked so far, when the time is over; None if there is none."""
        self.model.watch = no_watch
        for known in sorted(self.feasible_checks(), key=self.cost):
            d = known.value.dimensions
            outcome = self.model.check(d)
            if self.problem.requirements.met_by(outcome.value):
                at = Iterate(logarithms(d), outcome, self.cost(outcome), 0.0, None, self.task.limits)
                return Optimum(LocalResult(at, math.inf), searches=self.search_count, local_optima=len(self.results))
        return None

    def corrected_core_limits(self, d: Dimensions, check: RodCheck, margin: float = 0.0) -> Limits:
        """The limits for the core, shifted by the difference of its rows from the full model's at a strip and tightened
        by ``margin``."""
        core = self.cycle.rows_near(self.cycle.peaks(d, self.model.required), self.model.required)
        values = core.values(logarithms(d))
        values[rows.STABILITY] = max(values[rows.STABILITY], values[rows.SIDEWAYS])
        limits = dict(self.task.limits)
        for c in CONSTRAINTS:
            if c.row in limits:
                exact = c.log_value(check, self.model.scene)
                shift = exact - values[c.row] if math.isfinite(exact) else 0.0
                limits[c.row] -= shift + margin
        limits[rows.STABILITY] = min(limits[rows.STABILITY], -1e-9)
        return limits

    def objective_correction(self, d: Dimensions) -> float:
        """Difference of ln objective between full model and core at a strip."""
        objective = self.problem.objective
        if objective.per_density:
            return 0.0
        core = self.cycle.rows_near(self.cycle.peaks(d, self.model.required), self.model.required)
        values = core.values(logarithms(d))
        exact = self.cost(self.model.check(d))
        return exact - sum(weight * values[row] for row, weight in objective.weights) if math.isfinite(exact) else 0.0

    def shifted_core(self, limits: Limits) -> Proof:
        """The core's optimum under other limits."""
        return search(self.cycle, self.problem.objective, limits, self.sizes, _SHIFTED_GAP, _SHIFTED_MAX_BOXES)


def continuous_optimum(context: Context, starts: Sequence[Dimensions]) -> Optimum | None:
    """The best strip of continuous sizes; its iterate is infeasible if no feasible strip is found."""
    exploratory = context.exploratory(starts[0])
    max_iterations = _COARSE_ITERATIONS if exploratory.model.has_resonances else None
    for start in starts:
        exploratory.search_from(start, context.bounds, max_iterations=max_iterations)
    local = exploratory.best()
    if local is None or local.feasible_best is None:
        return None if local is None else Optimum(local, searches=context.search_count, local_optima=1)
    if exploratory is not context:
        context.confirm_vibration(local)
        return _optimum_over_gaps(context, exploratory)
    for _ in range(_NEWTON_STEPS):
        local = context.best()
        conditions = first_order_conditions(context, local.best, context.bounds, context.bounds)
        second = _second_order(local.best, conditions, context.bounds)
        if second.predicted_gain <= context.task.min_gain:
            break
        for step in second.steps:
            start = dimensions_of(local.best.x + step, context.model.scene)
            context.search_from(start, context.bounds, _CURVATURE_STEP)
        if local.best.log_cost - context.best().best.log_cost <= context.task.min_gain:
            # Searches from the predicted points refute the prediction.
            second = replace(second, predicted_gain=0.0)
            break
    return Optimum(context.best(), conditions, second, context.search_count, _distinct_count(context.results))


def _optimum_over_gaps(context: Context, exploratory: Context) -> Optimum | None:
    """The best of the local optima between resonances: all of them at low accuracy, the best ones refined."""
    gain, ratio_range = search_other_gaps(exploratory, context.bounds)
    best = refined_best(context, exploratory.results, lambda _: context.bounds)
    local_optima = _distinct_count(exploratory.results)
    if best is None or best.feasible_best is None:
        return None if best is None else Optimum(best, searches=context.search_count, local_optima=local_optima)
    conditions = first_order_conditions(context, best.best, context.bounds, context.bounds)
    return Optimum(best, conditions, None, context.search_count, local_optima, gain, ratio_range)


def refined_best(
    context: Context, results: list[LocalResult], bounds_of: Callable[[Dimensions], Bounds]
) -> LocalResult | None:
    """The best result after refining coarse ones at full accuracy within bounds: the best and those that are worse by
    less than their errors and possible further gains."""
    finer = context.finer()
    for result in _refinement_candidates(results, 1.0 if context.model.is_excited_by_corners else TOTAL_GAIN_RATIO):
        best, strip = finer.best(), result.best.outcome.value.dimensions
        incumbent = math.inf if best is None or best.feasible_best is None else best.best.log_cost
        for _ in range(_MAX_REFINEMENTS):
            result = finer.search_from(strip, bounds_of(strip), _FINE_RADIUS, incumbent=incumbent)
            if result is None or result.feasible_best is None:
                break
            if result.best.log_cost - TOTAL_GAIN_RATIO * result.predicted_gain > incumbent:
                break
            previous, strip = strip, result.best.outcome.value.dimensions
            if result.predicted_gain <= max(context.model.accuracy, context.task.min_gain) or strip == previous:
                break
    return finer.best()


def _refinement_candidates(results: list[LocalResult], total_gain_ratio: float) -> list[LocalResult]:
    """The best result, and those of other strips that may be as good if they gain ``total_gain_ratio`` times the
    predicted gain."""

    def uncertainty(result: LocalResult) -> float:
        return result.best.outcome.accuracy.estimated + total_gain_ratio * result.predicted_gain

    first, *others = sorted(results, key=lambda result: (result.best.excess, result.best.log_cost))
    if first.feasible_best is None:
        return [first]
    best_upper, out = first.best.log_cost + first.best.outcome.accuracy.estimated, [first]
    for result in others:
        may_be_best = result.feasible_best is not None and result.best.log_cost - uncertainty(result) < best_upper
        if may_be_best and not is_near(result.best.x, out, SAME_STRIP):
            out.append(result)
    return out[:_MAX_CANDIDATES]


def search_other_gaps(context: Context, bounds: Bounds) -> tuple[float, tuple[float, float] | None]:
    """Search other gaps between resonances than the best strip's, until several searches in succession bring no
    improvement. Returns the estimated gain in ln objective that remains if the search is cut short, and the minimum and
    maximum frequency ratio searched."""
    gaps, gain, failed = Gaps(context.task, bounds), 0.0, 0
    is_untried = lambda d: not is_near(logarithms(d), context.results, SAME_STRIP)  # noqa: E731
    for _ in range(_MAX_GAP_SEARCHES):
        best = context.best()
        finished = best is None or best.feasible_best is None or failed == _MAX_GAP_FAILURES
        start = None if finished else gaps.next_start(best.best, is_untried)
        if start is None:
            return 0.0, gaps.range
        result = context.search_from(start, bounds, _GAP_RADIUS, incumbent=best.best.log_cost)
        if result is not None:
            gaps.exclude(result.best)
            is_tie = result.best.feasible and result.best.log_cost < best.best.log_cost + _TIE
            if is_tie and not is_near(logarithms(start), [result], SAME_STRIP):
                gaps.add_path(result.best)
        gain = best.best.log_cost - context.best().best.log_cost
        failed = 0 if gain > context.task.min_gain else failed + 1
    return gain, gaps.range


def is_near(x: Array, results: list[LocalResult], distance: float) -> bool:
    """Whether one of the results lies within ``distance`` of x."""
    return any(np.max(np.abs(x - result.best.x)) < distance for result in results)


def first_order_conditions(context: Context, at: Iterate, bounds: Bounds, sizes: Bounds) -> Stationarity:
    """First-order optimality conditions of the full model at an iterate."""
    values, slopes = at.memory.values(at.x), at.memory.jacobian(at.x)
    tolerance = max(1e-6, 10.0 * context.task.margin)
    return stationarity(
        values, slopes, at.memory.active.layout, context.problem.objective, at.limits, bounds, sizes,
        at.outcome.value.dimensions, tolerance,
    )  # fmt: skip


def _second_order(at: Iterate, conditions: Stationarity, bounds: Bounds) -> SecondOrder:
    """Newton's method along the directions that limits leave free.

    Curvatures are differences over ``_CURVATURE_STEP``, large enough for the noise of time meshes to be negligible.
    """
    directions, slope = conditions.tangent, conditions.tangent @ conditions.residual
    if not len(directions):
        return SecondOrder(None, 0.0, ())
    active, lagrangian = at.memory.active, conditions.weights
    centre = float(lagrangian @ active.corrected_values(at.x))

    def second(direction: Array) -> float:
        ahead, behind = (active.corrected_values(at.x + side * _CURVATURE_STEP * direction) for side in (1.0, -1.0))
        return (float(lagrangian @ ahead) + float(lagrangian @ behind) - 2.0 * centre) / _CURVATURE_STEP**2

    matrix = np.diag([second(direction) for direction in directions])
    for i in range(len(directions)):
        for j in range(i):
            mixed = second((directions[i] + directions[j]) / math.sqrt(2.0))
            matrix[i, j] = matrix[j, i] = mixed - 0.5 * (matrix[i, i] + matrix[j, j])
    curvatures, axes = np.linalg.eigh(matrix)
    # The residual is the negative gradient of the Lagrangian.
    descent = axes.T @ slope
    if curvatures[0] > 0.0:
        # A flat minimum may be far away; the search from the predicted point tests the quadratic model.
        step = (axes @ (descent / curvatures)) @ directions
        fraction = min(1.0, _max_step_fraction(at.x, step, bounds))
        predicted_gain = fraction * (1.0 - 0.5 * fraction) * float(descent @ (descent / curvatures))
        return SecondOrder(float(curvatures[0]), predicted_gain, (fraction * step,))
    steps = tuple(side * _MAX_STEP * axes[:, 0] @ directions for side in (1.0, -1.0))
    predicted_gain = abs(descent[0]) * _MAX_STEP - 0.5 * float(curvatures[0]) * _MAX_STEP**2
    return SecondOrder(float(curvatures[0]), predicted_gain, steps)


def _max_step_fraction(x: Array, step: Array, bounds: Bounds) -> float:
    """The largest fraction of a step that stays within the bounds."""
    lower, upper = np.log([bounds.b, bounds.h, bounds.l]).T
    room = np.where(step > 0.0, upper - x, lower - x)
    moving = np.abs(step) > 1e-12
    return max(float(np.min(room[moving] / step[moving], initial=math.inf)), 0.0)


def _distinct_count(results: list[LocalResult]) -> int:
    """Number of different strips among the results."""
    found: list[Array] = []
    for result in results:
        if all(np.max(np.abs(result.best.x - x)) >= SAME_STRIP for x in found):
            found.append(result.best.x)
    return len(found)
