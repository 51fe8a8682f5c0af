"""The optimum on the full model: where the local searches start, and which of their ends is the answer.

The core's global optimum is the first start. From the strip found there, what the full model changes in every result
is known; the core is searched globally once more with its limits shifted by that, and where its optimum lies elsewhere
it is a start too. Where limits do not pin a strip down in every direction, the curvature along them is measured, and a
Newton step that promises a gain, or one to both sides where the curvature is negative, is a start again. Sizes that
come in steps: see ``available_sizes``.
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
from solvers.rod.optimum.full_model.model import Array, FullModel, no_watch
from solvers.rod.optimum.full_model.strip import dimensions_of, logarithms
from solvers.rod.optimum.proof.outer_approximation import Proof, Sizes, search
from solvers.rod.optimum.search.gaps import Gaps
from solvers.rod.optimum.search.local_search import CATCHES_UP, ROUNDS, SAME, Iterate, Local, Task, local_search
from solvers.rod.optimum.sensitivities import Stationarity, stationarity
from solvers.rod.problem import Bounds, RodProblem
from solvers.rod.scene import Dimensions

BOXES = 20_000
_SHIFTED_BOXES, _SHIFTED_GAP = 2000, 1e-3
_ELSEWHERE, _CLOSE_BY = 0.02, 0.1
"""In ln b, ln h, ln l: from where on a strip is another start, up to where two are close to each other."""
_APART = 0.02
"""To each side of a strip its curvature is measured."""
_FARTHEST = 0.1
"""A step along the limits, in ln b, ln h, ln l."""
_NEWTON_STEPS = 4
_SHIFTS = 3
_GAP_STARTS, _GAP_FAILURES, _GAP_RADIUS = 12, 4, 0.01
"""Searches from other gaps at most, and in turn without a better strip; their first radius, in ln b, ln h, ln l."""
_AS_GOOD = 5e-4
"""In ln objective: up to where an end in another gap is about as good as the best strip, and other gaps are looked for
from there, too."""
_ROUGH_ROUNDS = 6
"""Of the first searches between resonances, which others follow."""
_FINE_RADIUS = 2e-3
"""The first radius of searches at full accuracy, in ln b, ln h, ln l."""
_LAST_SEARCHES = 3
"""To the bottom of a valley between resonances: further ones where the first has not come to its end."""
_CONTENDERS = 3
"""So many ends of rough searches are led on at full accuracy."""
_ENOUGH = 0.1
"""Of the accuracy: a gain not worth another step."""
_ROUGH, _ROUGHEST = 1e-4, 1e-3
"""The accuracy of searches between resonances but for the last; and where no check has it, at the most."""


@dataclass(frozen=True)
class SecondOrder:
    """The least curvature of the Lagrangian along what limits leave free (None: nothing), the gain in ln objective that
    a quadratic model promises within reach there, and the steps in ln(b, h, l) that promise it."""

    curvature: float | None
    gain: float
    steps: tuple[Array, ...]


@dataclass
class Optimum:
    """The best end of all local searches, and what is known of it; ``ends`` is how many different strips the searches
    ended at."""

    local: Local
    conditions: Stationarity | None = None
    second_order: SecondOrder | None = None
    starts: int = 0
    ends: int = 0
    left: float = 0.0
    """What may be left to gain in other gaps between resonances, in ln objective, where there is no time for all."""
    followed: tuple[float, float] | None = None
    """The least and greatest frequency ratio between which other gaps were looked into, if strips ring."""


@dataclass
class Context:
    """A problem with its core and its full model."""

    problem: RodProblem
    cycle: CoreCycle
    model: FullModel
    task: Task
    sizes: Sizes
    ends: list[Local] = field(default_factory=list)
    started: list[Array] = field(default_factory=list)
    rough: Context | None = None
    """The same, less exact: between resonances all searches but the last are made there."""

    @property
    def starts(self) -> int:
        """How many local searches there were."""
        return len(self.started)

    @property
    def bounds(self) -> Bounds:
        """Those of the problem, the length no longer than the rod."""
        b = self.sizes.bounds
        return Bounds(b.b, b.h, (b.l[0], min(b.l[1], self.cycle.rod_length)))

    def search_from(
        self, start: Dimensions, bounds: Bounds, radius: float = 0.15, rounds: int = ROUNDS, known: float = math.inf
    ) -> Local | None:
        """One local search, kept among the ends; it is given up where it is not going to come below a ``known`` ln
        objective."""
        self.started.append(logarithms(start))
        # Where nothing rings there are few searches, and they are to confirm each other's ends.
        ends = self.ends if self.model.rings else ()
        local = local_search(self.model, self.task, bounds, logarithms(start), radius, rounds, known, ends)
        if local is not None:
            self.ends.append(local)
        return local

    def explored(self, start: Dimensions) -> Context:
        """Where searches from a strip are made: between resonances roughly, as nothing finer is worth its time before
        the last steps, or as checks have it there."""
        if not self.model.rings:
            return self
        model = self.model.rougher(_ROUGH)
        known = model.check(dimensions_within(self.bounds, logarithms(start))).accuracy.estimated
        if known > model.accuracy and not model.textured:
            model = model.at_accuracy(min(known, _ROUGHEST))
        looser = model.accuracy / self.model.accuracy
        # Where more than the accuracy is left unknown, what is enough need not grow with it.
        enough = max(min(looser * self.task.enough, _ENOUGH * model.accuracy), self.task.enough)
        task = replace(self.task, guard=looser * self.task.guard, enough=enough)
        self.rough = replace(self, model=model, task=task, ends=[])
        return self.rough

    def finer(self) -> Context:
        """The same with smaller steps and rows as good as checks. Behind a table's noise strips of short steps have to
        be as good, too, and where checks leave more unknown than the accuracy, long ones are enough."""
        exact = self.model.textured and self.task.enough <= self.model.accuracy
        return replace(self, model=self.model.finer(None if exact else self.rough.model), ends=[])

    def best(self) -> Local | None:
        """The best end: admissible before not, cheaper before dearer."""
        key = lambda local: (local.best.excess, local.best.log_cost)  # noqa: E731
        return min(self.ends, key=key, default=None)

    def known(self) -> list[Outcome[RodCheck]]:
        """The strips of available sizes that were checked, exactly or else roughly, and meet every requirement."""
        p = self.problem
        met = [o for o in self.model.checked() if p.requirements.met_by(o.value) and self.available(o.value.dimensions)]
        return met if met or self.rough is None else self.rough.known()

    def cost(self, outcome: Outcome[RodCheck]) -> float:
        """The ln objective of a check."""
        return self.problem.objective.log_cost(outcome.value, self.model.scene.material.density)

    def available(self, d: Dimensions) -> bool:
        """Whether a strip has sizes that are to be had."""
        near = self.sizes.around(d)
        return all(
            low <= size <= high for size, (low, high) in zip((d.b, d.h, d.l), (near.b, near.h, near.l), strict=True)
        )

    def best_in_time(self) -> Optimum | None:
        """The best admissible strip of all that were checked, when the time is over; None where there is none."""
        self.model.watch = no_watch
        for rough in sorted(self.known(), key=self.cost):
            d = rough.value.dimensions
            outcome = self.model.check(d)
            if self.problem.requirements.met_by(outcome.value):
                at = Iterate(logarithms(d), outcome, self.cost(outcome), 0.0, None, self.task.limits)
                return Optimum(Local(at, math.inf, 0), starts=self.starts, ends=len(self.ends))
        return None

    def core_limits_at(self, d: Dimensions, check: RodCheck, guard: float = 0.0) -> Limits:
        """The limits as the core sees them: moved by what its rows differ from the full model's at a strip."""
        core = self.cycle.rows_near(self.cycle.peaks(d, self.model.wanted), self.model.wanted)
        own = core.values(logarithms(d))
        own[rows.STABILITY] = max(own[rows.STABILITY], own[rows.SIDEWAYS])
        limits = dict(self.task.limits)
        for c in CONSTRAINTS:
            if c.row in limits:
                exact = c.log_value(check, self.model.scene)
                shift = exact - own[c.row] if math.isfinite(exact) else 0.0
                limits[c.row] -= shift + guard
        limits[rows.STABILITY] = min(limits[rows.STABILITY], -1e-9)
        return limits

    def beyond_core(self, d: Dimensions) -> float:
        """What the full model's ln objective exceeds the core's by at a strip."""
        objective = self.problem.objective
        if objective.per_density:
            return 0.0
        core = self.cycle.rows_near(self.cycle.peaks(d, self.model.wanted), self.model.wanted)
        values = core.values(logarithms(d))
        exact = self.cost(self.model.check(d))
        return exact - sum(weight * values[row] for row, weight in objective.weights) if math.isfinite(exact) else 0.0

    def shifted_core(self, limits: Limits) -> Proof:
        """The core's optimum under other limits."""
        return search(self.cycle, self.problem.objective, limits, self.sizes, _SHIFTED_GAP, _SHIFTED_BOXES)


def continuous_optimum(context: Context, starts: Sequence[Dimensions]) -> Optimum | None:
    """The best strip of sizes that may be chosen at will; its best iterate may be inadmissible, if none is found."""
    explored = context.explored(starts[0])
    _search_everywhere(explored, starts)
    local = explored.best()
    if local is None or local.found is None:
        return None if local is None else Optimum(local, starts=context.starts, ends=1)
    if explored is not context:
        return _among_gaps(context, explored)
    for _ in range(_NEWTON_STEPS):
        local = context.best()
        conditions = conditions_at(context, local.best, context.bounds, context.bounds)
        second = _second_order(local.best, conditions, context.bounds)
        if second.gain <= context.task.enough:
            break
        for step in second.steps:
            context.search_from(dimensions_of(local.best.x + step, context.model.scene), context.bounds, _APART)
        if local.best.log_cost - context.best().best.log_cost <= context.task.enough:
            # Searches from where the promise pointed refute it.
            second = replace(second, gain=0.0)
            break
    return Optimum(context.best(), conditions, second, context.starts, _different(context.ends))


def _search_everywhere(context: Context, starts: Sequence[Dimensions]) -> None:
    """From the starts, and from where the core has its optimum with its limits shifted."""
    rounds = _ROUGH_ROUNDS if context.model.rings else ROUNDS
    for start in starts:
        context.search_from(start, context.bounds, rounds=rounds)
    for _ in range(_SHIFTS):
        other, known = _other_start(context), len(context.ends)
        if other is None:
            break
        end = context.search_from(other, context.bounds, rounds=rounds)
        if end is None or near(end.best.x, context.ends[:known], SAME):
            break


def _among_gaps(context: Context, explored: Context) -> Optimum | None:
    """The best of the optima between resonances: of every gap a rough one, of the best an exact one."""
    left, followed = search_other_gaps(explored, context.bounds)
    best = at_full_accuracy(context, explored.ends, lambda _: context.bounds)
    ends = _different(explored.ends)
    if best is None or best.found is None:
        return None if best is None else Optimum(best, starts=context.starts, ends=ends)
    conditions = conditions_at(context, best.best, context.bounds, context.bounds)
    return Optimum(best, conditions, None, context.starts, ends, left, followed)


def at_full_accuracy(context: Context, ends: list[Local], within: Callable[[Dimensions], Bounds]) -> Local | None:
    """The best of the ends of rough searches, led on within bounds to the bottom of their valleys: of the best and of
    those that are dearer by less than they, and it, may be wrong or still gain."""
    finer = context.finer()
    for end in _contenders(ends, 1.0 if context.model.textured else CATCHES_UP):
        best, strip = finer.best(), end.best.outcome.value.dimensions
        known = math.inf if best is None or best.found is None else best.best.log_cost
        for _ in range(_LAST_SEARCHES):
            led = finer.search_from(strip, within(strip), _FINE_RADIUS, known=known)
            if led is None or led.found is None or led.best.log_cost - CATCHES_UP * led.gain > known:
                break
            before, strip = strip, led.best.outcome.value.dimensions
            if led.gain <= max(context.model.accuracy, context.task.enough) or strip == before:
                break
    return finer.best()


def _contenders(ends: list[Local], catches_up: float) -> list[Local]:
    """The best end, and those of other strips that may be as good if they gain so many times what they promise: behind
    a table's noise no more than that."""

    def doubt(end: Local) -> float:
        return end.best.outcome.accuracy.estimated + catches_up * end.gain

    first, *others = sorted(ends, key=lambda end: (end.best.excess, end.best.log_cost))
    if first.found is None:
        return [first]
    most, out = first.best.log_cost + first.best.outcome.accuracy.estimated, [first]
    for end in others:
        if end.found is not None and end.best.log_cost - doubt(end) < most and not near(end.best.x, out, SAME):
            out.append(end)
    return out[:_CONTENDERS]


def search_other_gaps(context: Context, bounds: Bounds) -> tuple[float, tuple[float, float] | None]:
    """Searches from other gaps between resonances than the best strip's, until several in turn find nothing
    better: what may be left to gain in ln objective where there is no time for all, and the least and greatest
    frequency ratio of what was looked into."""
    gaps, left, failed = Gaps(context.task, bounds), 0.0, 0
    untried = lambda d: not near(logarithms(d), context.ends, SAME)  # noqa: E731
    for _ in range(_GAP_STARTS):
        best = context.best()
        lost = best is None or best.found is None or failed == _GAP_FAILURES
        start = None if lost else gaps.next(best.best, untried)
        if start is None:
            return 0.0, gaps.range
        end = context.search_from(start, bounds, _GAP_RADIUS, known=best.best.log_cost)
        if end is not None:
            gaps.leave_out(end.best)
            as_good = end.best.admissible and end.best.log_cost < best.best.log_cost + _AS_GOOD
            if as_good and not near(logarithms(start), [end], SAME):
                gaps.follow(end.best)
        left = best.best.log_cost - context.best().best.log_cost
        failed = 0 if left > context.task.enough else failed + 1
    return left, gaps.range


def _other_start(context: Context) -> Dimensions | None:
    """Where the core has its optimum with limits as the full model shifts them, if that is a new strip."""
    local = context.best()
    if local is None:
        return None
    strip = local.best.outcome.value
    best = context.shifted_core(context.core_limits_at(strip.dimensions, strip, context.task.guard)).best
    if best is None:
        return None
    rings = context.model.rings
    x, apart = logarithms(best.dimensions), _CLOSE_BY if rings else _ELSEWHERE
    known = [end.best.x for end in context.ends] + context.started[0 if rings else 1 :]
    return None if any(np.max(np.abs(x - other)) < apart for other in known) else best.dimensions


def near(x: Array, ends: list[Local], within: float) -> bool:
    """Whether one of the ends lies so close to x."""
    return any(np.max(np.abs(x - end.best.x)) < within for end in ends)


def conditions_at(context: Context, at: Iterate, bounds: Bounds, sizes: Bounds) -> Stationarity:
    """First-order conditions of the full model at an iterate."""
    values, slopes = at.memory.values(at.x), at.memory.jacobian(at.x)
    within = max(1e-6, 10.0 * context.task.guard)
    return stationarity(
        values, slopes, at.memory.active.layout, context.problem.objective, at.limits, bounds, sizes,
        at.outcome.value.dimensions, within,
    )  # fmt: skip


def _second_order(at: Iterate, conditions: Stationarity, bounds: Bounds) -> SecondOrder:
    """What Newton's method says along the directions that limits leave free.

    Curvatures are differences over ``_APART``, so that the noise of a time mesh does not count.
    """
    ways, slope = conditions.tangent, conditions.tangent @ conditions.residual
    if not len(ways):
        return SecondOrder(None, 0.0, ())
    rows_at, lagrangian = at.memory.active, conditions.weights
    middle = float(lagrangian @ rows_at.corrected_values(at.x))

    def second(way: Array) -> float:
        ends = [float(lagrangian @ rows_at.corrected_values(at.x + side * _APART * way)) for side in (1.0, -1.0)]
        return (ends[0] + ends[1] - 2.0 * middle) / _APART**2

    matrix = np.diag([second(way) for way in ways])
    for i in range(len(ways)):
        for j in range(i):
            across = second((ways[i] + ways[j]) / math.sqrt(2.0))
            matrix[i, j] = matrix[j, i] = across - 0.5 * (matrix[i, i] + matrix[j, j])
    curvatures, axes = np.linalg.eigh(matrix)
    # The residual is the slope downhill.
    down = axes.T @ slope
    if curvatures[0] > 0.0:
        # Of a flat valley the bottom is far; the search from there says what the model is worth.
        step = (axes @ (down / curvatures)) @ ways
        shorter = min(1.0, _room(at.x, step, bounds))
        gain = shorter * (1.0 - 0.5 * shorter) * float(down @ (down / curvatures))
        return SecondOrder(float(curvatures[0]), gain, (shorter * step,))
    both = tuple(side * _FARTHEST * axes[:, 0] @ ways for side in (1.0, -1.0))
    gain = abs(down[0]) * _FARTHEST - 0.5 * float(curvatures[0]) * _FARTHEST**2
    return SecondOrder(float(curvatures[0]), gain, both)


def _room(x: Array, step: Array, bounds: Bounds) -> float:
    """The share of a step that stays within the bounds."""
    lower, upper = np.log([bounds.b, bounds.h, bounds.l]).T
    room = np.where(step > 0.0, upper - x, lower - x)
    moving = np.abs(step) > 1e-12
    return max(float(np.min(room[moving] / step[moving], initial=math.inf)), 0.0)


def _different(ends: list[Local]) -> int:
    """How many of the ends are other strips."""
    found: list[Array] = []
    for end in ends:
        if all(np.max(np.abs(end.best.x - x)) >= SAME for x in found):
            found.append(end.best.x)
    return len(found)
