"""The optimum on the full model: where the local searches start, and which of their ends is the answer.

The core's global optimum is the first start. From the strip found there, what the full model changes in every result
is known; the core is searched globally once more with its limits shifted by that, and where its optimum lies elsewhere
it is a start too. Where limits do not pin a strip down in every direction, the curvature along them is measured, and a
Newton step that promises a gain, or one to both sides where the curvature is negative, is a start again. Sizes that
come in steps: see ``available_sizes``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from solvers.outcome import Outcome
from solvers.rod import rows
from solvers.rod.check import RodCheck
from solvers.rod.constraints import BY_NAME, CONSTRAINTS, Limits
from solvers.rod.optimum.answer.sensitivities import Stationarity, stationarity
from solvers.rod.optimum.core_cycle import CoreCycle
from solvers.rod.optimum.core_optimum import within
from solvers.rod.optimum.full_model import Array, FullModel, dimensions_of, logarithms
from solvers.rod.optimum.local_search import Iterate, Local, Task, local_search
from solvers.rod.optimum.proof.outer_approximation import Proof, Sizes, search
from solvers.rod.problem import Bounds, RodProblem
from solvers.rod.scene import Dimensions

BOXES = 20_000
_SHIFTED_BOXES, _SHIFTED_GAP = 2000, 1e-3
_ELSEWHERE, _SAME, _CLOSE_BY = 0.02, 2e-3, 0.1
"""In ln b, ln h, ln l: from where on a strip is another start, up to where two ends are one, or close to each other."""
_APART = 0.02
"""To each side of a strip its curvature is measured."""
_FARTHEST = 0.1
"""A step along the limits, in ln b, ln h, ln l."""
_NEWTON_STEPS = 4
_STRIPS, _SCANNED, _RIPPLES, _RIPPLE_RADIUS = 32, 0.03, 2, 0.01
"""Of results that ripple: strips checked, how far to each side, searches from the best of them and their radius."""
_SHIFTS = 3


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
    ripple: float = 0.0
    """What may be missed among several optima close to each other, in ln objective: how high results ripple, or by how
    much the next of them is worse; 0 where there is one."""


@dataclass
class Context:
    """A problem with its core and its full model."""

    problem: RodProblem
    cycle: CoreCycle
    model: FullModel
    task: Task
    sizes: Sizes
    ends: list[Local] = field(default_factory=list)
    starts: int = 0

    @property
    def bounds(self) -> Bounds:
        """Those of the problem, the length no longer than the rod."""
        b = self.sizes.bounds
        return Bounds(b.b, b.h, (b.l[0], min(b.l[1], self.cycle.rod_length)))

    def search_from(self, start: Dimensions, bounds: Bounds, radius: float = 0.15) -> Local | None:
        """One local search, kept among the ends."""
        self.starts += 1
        local = local_search(self.model, self.task, bounds, logarithms(start), radius)
        if local is not None:
            self.ends.append(local)
        return local

    def best(self) -> Local | None:
        """The best end: admissible before not, cheaper before dearer."""
        key = lambda local: (local.best.excess, local.best.log_cost)  # noqa: E731
        return min(self.ends, key=key, default=None)

    def known(self) -> Outcome[RodCheck] | None:
        """The best strip of available sizes that was checked and meets every requirement."""
        p, density = self.problem, self.model.scene.material.density
        met = [o for o in self.model.checked() if p.requirements.met_by(o.value) and self.available(o.value.dimensions)]
        return min(met, key=lambda o: p.objective.log_cost(o.value, density), default=None)

    def available(self, d: Dimensions) -> bool:
        """Whether a strip has sizes that are to be had."""
        near = self.sizes.around(d)
        return all(
            low <= size <= high for size, (low, high) in zip((d.b, d.h, d.l), (near.b, near.h, near.l), strict=True)
        )

    def best_in_time(self) -> Optimum | None:
        """The best admissible strip of all that were checked, when the time is over; None where there is none."""
        outcome = self.known()
        if outcome is None:
            return None
        d = outcome.value.dimensions
        cost = self.problem.objective.log_cost(outcome.value, self.model.scene.material.density)
        at = Iterate(logarithms(d), outcome, cost, 0.0, None, self.task.limits)
        return Optimum(Local(at, math.inf, 0), starts=self.starts, ends=len(self.ends))

    def core_limits_at(self, d: Dimensions, check: RodCheck, guard: float = 0.0) -> Limits:
        """The limits as the core sees them: moved by what its rows differ from the full model's at a strip."""
        core = self.cycle.following(self.cycle.peaks(d, self.model.wanted), self.model.wanted)
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

    def shifted_core(self, limits: Limits) -> Proof:
        """The core's optimum under other limits."""
        return search(self.cycle, self.problem.objective, limits, self.sizes, _SHIFTED_GAP, _SHIFTED_BOXES)


def continuous_optimum(context: Context, start: Dimensions) -> Optimum | None:
    """The best strip of sizes that may be chosen at will; its best iterate may be inadmissible, if none is found."""
    context.search_from(start, context.bounds)
    for _ in range(_SHIFTS):
        other, known = _other_start(context), len(context.ends)
        if other is None:
            break
        end = context.search_from(other, context.bounds)
        if end is None or _near(end.best.x, context.ends[:known], _SAME):
            break
    for _ in range(_NEWTON_STEPS):
        local = context.best()
        if local is None or local.found is None:
            return None if local is None else Optimum(local, starts=context.starts, ends=1)
        conditions = conditions_at(context, local.best, context.bounds, context.bounds)
        second = _second_order(local.best, conditions)
        if second.gain <= context.task.enough:
            break
        for step in second.steps:
            context.search_from(dimensions_of(local.best.x + step, context.model.scene), context.bounds, _APART)
        if local.best.log_cost - context.best().best.log_cost <= context.task.enough:
            # Searches from where the promise pointed refute it.
            second = replace(second, gain=0.0)
            break
    ripple = 0.0
    if context.model.ripples:
        ripple = _search_ripples(context)
        ripple = max(ripple, _next_best(context.best(), context.ends))
    best = context.best()
    return Optimum(best, conditions, second, context.starts, _different(context.ends), ripple)


def _other_start(context: Context) -> Dimensions | None:
    """Where the core has its optimum with limits as the full model shifts them, if that is a new strip."""
    local = context.best()
    if local is None:
        return None
    strip = local.best.outcome.value
    best = context.shifted_core(context.core_limits_at(strip.dimensions, strip, context.task.guard)).best
    if best is None or _near(logarithms(best.dimensions), context.ends, _ELSEWHERE):
        return None
    return best.dimensions


def _near(x: Array, ends: list[Local], within: float) -> bool:
    return any(np.max(np.abs(x - end.best.x)) < within for end in ends)


def conditions_at(context: Context, at: Iterate, bounds: Bounds, sizes: Bounds) -> Stationarity:
    """First-order conditions of the full model at an iterate."""
    values, slopes = at.memory.values(at.x), at.memory.slopes(at.x)
    within = max(1e-6, 10.0 * context.task.guard)
    return stationarity(
        values, slopes, at.memory.active.layout, context.problem.objective, at.limits, bounds, sizes,
        at.outcome.value.dimensions, within,
    )  # fmt: skip


def _second_order(at: Iterate, conditions: Stationarity) -> SecondOrder:
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
    lengths = np.clip(down / np.maximum(curvatures, 1e-12), -_FARTHEST, _FARTHEST)
    gains = down * lengths - 0.5 * curvatures * lengths**2
    if curvatures[0] > 0.0:
        return SecondOrder(float(curvatures[0]), float(np.sum(gains)), ((axes @ lengths) @ ways,))
    both = tuple(side * _FARTHEST * axes[:, 0] @ ways for side in (1.0, -1.0))
    gain = abs(down[0]) * _FARTHEST - 0.5 * float(curvatures[0]) * _FARTHEST**2
    return SecondOrder(float(curvatures[0]), gain, both)


def _search_ripples(context: Context) -> float:
    """Local searches from the most promising strips along what limits leave free; how high results ripple there.

    Undamped ringing makes results ripple over a percent of length: of many optima close to each other the search has
    found one. Strips spread along the free directions are checked, and judged by the Lagrangian; what a quadratic in
    the offsets leaves of it is the ripple, in ln objective.
    """
    best = context.best()
    if best is None or best.found is None:
        return 0.0
    conditions = conditions_at(context, best.best, context.bounds, context.bounds)
    ways = conditions.tangent
    if not len(ways):
        return 0.0
    worth = {BY_NAME[a.name].row: abs(a.sensitivity) for a in conditions.active if a.name in BY_NAME}
    offsets = _spread_offsets(len(ways))
    strips = [within(context.bounds, best.best.x + offset @ ways) for offset in offsets]
    merits = np.array([_lagrangian(context, d, worth) for d in strips])
    for n in np.argsort(merits)[:_RIPPLES]:
        if merits[n] < best.best.log_cost - context.task.enough:
            context.search_from(strips[n], context.bounds, _RIPPLE_RADIUS)
    sound = np.isfinite(merits)
    quadratic = np.array([np.append(o, 1.0)[i] * np.append(o, 1.0) for o in offsets for i in range(len(ways) + 1)])
    quadratic = quadratic.reshape(len(offsets), -1)[sound]
    if not sound.any():
        return math.inf
    fitted = quadratic @ np.linalg.lstsq(quadratic, merits[sound], rcond=None)[0]
    return float(np.max(np.abs(merits[sound] - fitted)))


def _spread_offsets(directions: int) -> Array:
    """Steps along so many directions, evenly spread within ``_SCANNED`` to each side, shape (strips, directions)."""
    if directions == 1:
        return np.linspace(-_SCANNED, _SCANNED, _STRIPS)[:, None]
    from scipy.stats.qmc import Sobol

    return _SCANNED * (2.0 * Sobol(directions, scramble=False).random(_STRIPS) - 1.0)


def _lagrangian(context: Context, d: Dimensions, worth: Mapping[int, float]) -> float:
    """ln objective of a strip by its check, with what its limits are missed by, or left over, at their worth."""
    check, scene = context.model.check(d).value, context.model.scene
    if check.stresses is None:
        return math.inf
    limits = context.task.limits
    missed = ((c.row, c.log_value(check, scene) - limits[c.row]) for c in CONSTRAINTS if c.row in worth)
    total = sum(worth[row] * by for row, by in missed if math.isfinite(by))
    return context.task.objective.log_cost(check, scene.material.density) + total


def _next_best(best: Local, ends: list[Local]) -> float:
    """By how much the best of the other admissible ends close by is worse."""
    near = [
        end.best.log_cost - best.best.log_cost
        for end in ends
        if end.found is not None and _SAME < float(np.max(np.abs(end.best.x - best.best.x))) < _CLOSE_BY
    ]
    return min(near, default=0.0)


def _different(ends: list[Local]) -> int:
    """How many of the ends are other strips."""
    found: list[Array] = []
    for end in ends:
        if all(np.max(np.abs(end.best.x - x)) >= _SAME for x in found):
            found.append(end.best.x)
    return len(found)
