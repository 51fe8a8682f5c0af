"""From a strip to the best one nearby on the full model: trust-region SQP with outer approximation.

At every iterate the strip is checked exactly and its peaks are looked for; they join the earlier ones. The active-peak
model of the full physics, with each limit shifted by what the exact check says of it there, is then solved by SLSQP
within a trust region. The search ends at a strip that the exact check admits and that the model cannot better.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from solvers.outcome import Outcome
from solvers.rod import rows
from solvers.rod.check import RodCheck
from solvers.rod.constraints import CONSTRAINTS, Limits
from solvers.rod.optimum.core.optimum import dimensions_within
from solvers.rod.optimum.full_model.model import Array, FullModel, FullRows
from solvers.rod.optimum.full_model.strip import logarithms
from solvers.rod.optimum.sqp import MemoisedRows, feasibility_program, program, restore_feasibility, run_slsqp
from solvers.rod.problem import Bounds, Objective, Requirements
from solvers.rod.scene import Dimensions, Scene

ROUNDS = 10
_FIRST_RADIUS, _GREATEST_RADIUS = 0.15, 0.3
_POOR, _GOOD, _BEST = 0.1, 0.75, 0.9
SAME = 2e-3
"""In ln b, ln h, ln l: up to where two ends are one."""
_PENALTY = 100.0
"""Of a violation against the cost: more than the multipliers of rods are, those of hardly feasible ones included."""
_FAR, _ROUGH = 1e-2, 1e-3
"""Beyond this excess a strip is first made admissible; to this share of the excess."""
_STRAY = 1e-3
"""Beyond this excess a search that no longer lessens it is over."""
_LEAST_EXCESS = 1e-16
_STUCK = 0.05
"""A promise to lessen the excess by a smaller share is none."""
CATCHES_UP = 4.0
_CATCHES_UP_INSIDE = 2.5
"""Times what a step promises: what all that follow are expected to gain at most; the same of a step that ends within
the trust region."""
_KEEPS = 0.8
"""Of what a step to the end of another search promises: what is counted on."""
_ROUNDING = 1e-9
"""Of ln b, ln h, ln l."""
_ITERATIONS = 12
"""Of the optimizer in one round."""


@dataclass(frozen=True)
class Task:
    """What is asked of a strip: ``guard`` is how far to the safe side of limits the search keeps, ``enough`` the gain
    in ln objective below which it ends."""

    objective: Objective
    requirements: Requirements
    limits: Limits
    guard: float
    enough: float


@dataclass(frozen=True)
class Iterate:
    """A strip with its exact check, and the model there: all rows, limits shifted by the check.

    ``excess`` is the greatest by which a limit is missed, in logarithms. There is no model (``memory`` None) where the
    time was over before.
    """

    x: Array
    outcome: Outcome[RodCheck]
    log_cost: float
    excess: float
    memory: MemoisedRows | None
    limits: Limits

    @property
    def admissible(self) -> bool:
        return self.excess <= 0.0


@dataclass(frozen=True)
class Local:
    """The best admissible iterate or, without one, that of the least excess; ``gain`` is what the model still promises
    there, in ln objective, ``rounds`` how often it was solved."""

    best: Iterate
    gain: float
    rounds: int

    @property
    def found(self) -> Iterate | None:
        return self.best if self.best.admissible else None


def local_search(
    model: FullModel,
    task: Task,
    bounds: Bounds,
    start: Array,
    radius: float = _FIRST_RADIUS,
    rounds: int = ROUNDS,
    known: float = math.inf,
    ends: Sequence[Local] = (),
) -> Local | None:
    """The best strip near ``start`` = ln(b, h, l) within the bounds; None where no strip near it stands up, or where it
    leads to one of the ``ends`` of others within them.

    A search that is not going to come below a ``known`` ln objective is given up.
    """
    box = np.log([bounds.b, bounds.h, bounds.l])
    at = _standing(model, task, bounds, np.clip(start, box[:, 0], box[:, 1]))
    if at is None:
        return None
    bottoms = [end.best for end in ends if _is_bottom(end, box, task.enough)]
    best, gain = at, math.inf
    for turn in range(1, rounds + 1):
        step, promised = _promised(model, task, box, at, radius)
        if at is best:
            gain = max(promised, 0.0) if at.admissible else math.inf
            if gain <= task.enough:
                return Local(best, gain, turn)
        if at.excess > _STRAY and promised < _STUCK * _PENALTY * at.excess:
            break
        expected = at.log_cost - _KEEPS * promised + task.enough
        if at.admissible and any(_same(step, other.x) and expected > other.log_cost for other in bottoms):
            return None
        moved = float(np.max(np.abs(step - at.x)))
        catches_up = CATCHES_UP if moved > 0.95 * radius else _CATCHES_UP_INSIDE
        if at.admissible and at.log_cost - catches_up * max(promised, task.enough) > known:
            break
        if moved == 0.0 or radius < model.least_radius:
            break
        trial = iterate(model, task, dimensions_within(bounds, step), at.memory.active, at.excess > _FAR)
        actual = -math.inf if trial is None else _merit(at) - _merit(trial)
        if actual < _POOR * promised:
            radius = 0.25 * min(radius, moved)
        elif actual > _GOOD * promised and moved > 0.9 * radius:
            radius = min((4.0 if actual > _BEST * promised else 2.0) * radius, _GREATEST_RADIUS)
        if trial is None:
            continue
        if actual > 0.0 or (trial.admissible and not at.admissible):
            at = trial
        else:
            # What the step ran into is known from now on.
            at, seeing = _seeing(model, task, at, trial), at
            best = at if best is seeing else best
        if _better(trial, best):
            best = trial
    return Local(best, gain, rounds)


def _is_bottom(end: Local, box: Array, enough: float) -> bool:
    """Whether another search has come to its end, at a strip within these bounds."""
    inside = np.all((box[:, 0] - _ROUNDING < end.best.x) & (end.best.x < box[:, 1] + _ROUNDING))
    return end.best.admissible and end.gain <= enough and bool(inside)


def _same(x: Array, other: Array) -> bool:
    return float(np.max(np.abs(x - other))) < SAME


def iterate(
    model: FullModel, task: Task, d: Dimensions, before: FullRows | None = None, far: bool = False
) -> Iterate | None:
    """The check and the active-peak model at a strip, which sees the peaks of ``before`` too; None beyond buckling.

    The check is exact, but where limits are likely to be far (``far``) and are.
    """
    outcome, x = model.check(d, max(_ROUGH, model.accuracy) if far else None), logarithms(d)
    if outcome.value.stresses is None:
        return None
    if far and excess_of(task, outcome.value, model.scene) <= _FAR:
        outcome = model.check(d)
    check = outcome.value
    if check.stresses is None:
        return None
    peaks = model.peaks(d)
    memory = MemoisedRows(model.rows_near(peaks if before is None else peaks.merged_with(before.peaks), d))
    limits = _shifted(model, task, check, memory.values(x))
    cost = task.objective.log_cost(check, model.scene.material.density)
    return Iterate(x, outcome, cost, excess_of(task, check, model.scene), memory, limits)


def _seeing(model: FullModel, task: Task, at: Iterate, beside: Iterate) -> Iterate:
    """The same iterate with a model that follows the peaks of another, too."""
    memory = MemoisedRows(model.rows_near(beside.memory.active.peaks, at.outcome.value.dimensions))
    return replace(at, memory=memory, limits=_shifted(model, task, at.outcome.value, memory.values(at.x)))


def _shifted(model: FullModel, task: Task, check: RodCheck, values: Array) -> Limits:
    """The limits, each by what the exact value of its row exceeds the model's."""
    exact = {c.row: c.log_value(check, model.scene) for c in CONSTRAINTS if c.row in task.limits}
    return {row: limit - _shift(exact.get(row), values, row) for row, limit in task.limits.items()}


def excess_of(task: Task, check: RodCheck, scene: Scene) -> float:
    """The greatest by which a check misses a limit, in logarithms; 0 where it meets every requirement."""
    # By the very comparison that a user would make, not by logarithms.
    if task.requirements.met_by(check):
        return 0.0
    missed = (c.log_value(check, scene) - task.limits[c.row] for c in CONSTRAINTS if c.row in task.limits)
    return max(max(missed, default=0.0), _LEAST_EXCESS)


def _shift(exact: float | None, values: Array, row: int) -> float:
    """What the exact value of a row exceeds the model's by."""
    own = max(values[rows.STABILITY], values[rows.SIDEWAYS]) if row == rows.STABILITY else values[row]
    return exact - own if exact is not None and math.isfinite(exact) and own > rows.NEVER_COMPRESSED else 0.0


def _standing(model: FullModel, task: Task, bounds: Bounds, x: Array) -> Iterate | None:
    """The iterate at x, or at the first thicker strip that does not buckle."""
    for thicker in (0.0, 0.03, 0.1, 0.3):
        moved = x.copy()
        moved[1] += thicker
        at = iterate(model, task, dimensions_within(bounds, moved))
        if at is not None:
            return at
    return None


def _promised(model: FullModel, task: Task, box: Array, at: Iterate, radius: float) -> tuple[Array, float]:
    """Where the model has its optimum within the radius, and what merit it promises to gain there.

    From far outside the limits the model is first led to where it violates them least; there is no optimum where that
    is still outside.
    """
    near = np.stack([np.maximum(box[:, 0], at.x - radius), np.minimum(box[:, 1], at.x + radius)], axis=1)
    layout, values = at.memory.active.layout, at.memory.values(at.x)
    p, x = program(task.objective, at.limits, layout, task.guard), at.x
    if at.excess > _FAR:
        towards = feasibility_program({row: limit - task.guard for row, limit in at.limits.items()}, layout)
        step = run_slsqp(at.memory, towards, near, x, _ROUGH * at.excess, _ITERATIONS)
        x = step.x
        if step.cost > 0.0:
            return x, _PENALTY * (p.violation(values) - step.cost)
    step = run_slsqp(at.memory, p, near, x, 0.1 * task.enough, _ITERATIONS)
    if step.violation > 0.1 * task.guard:
        step = restore_feasibility(at.memory, p, near, step.x, 3)
    gain = p.cost(values) - step.cost
    if not at.admissible:
        gain += _PENALTY * (max(p.violation(values), 0.0) - max(step.violation, 0.0))
    return step.x, gain


def _merit(at: Iterate) -> float:
    return at.log_cost + _PENALTY * at.excess


def _better(trial: Iterate, best: Iterate) -> bool:
    if trial.admissible and best.admissible:
        return trial.log_cost < best.log_cost
    return trial.excess < best.excess
