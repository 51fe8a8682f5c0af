"""Local search on the full model: trust-region SQP with outer approximation.

At every iterate the strip is checked exactly, and its peaks are located and added to the earlier ones. The active-peak
model of the full physics, with each limit shifted to agree with the exact check there, is then solved by SLSQP within a
trust region. The search ends at a strip that is feasible by the exact check and that the model cannot improve.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.numerics.arrays import Array
from solvers.outcome import Outcome
from solvers.rod import rows
from solvers.rod.check import RodCheck
from solvers.rod.constraints import CONSTRAINTS, Limits
from solvers.rod.optimum.core.local_optimum import dimensions_within
from solvers.rod.optimum.full_model.model import FullModel, FullRows
from solvers.rod.optimum.full_model.strip import logarithms
from solvers.rod.optimum.sqp import program, restore_feasibility, run_slsqp
from solvers.rod.problem import Bounds, RodProblem
from solvers.rod.scene import Dimensions

_MAX_ITERATIONS, _MAX_ITERATIONS_WITH_NOISE = 30, 10
"""Maximum iterations of a search, and under a noisy load, where the last ones are fruitless."""
_FIRST_RADIUS, _MAX_RADIUS = 0.15, 0.3
"""Trust-region radii in ln b, ln h, ln l."""
_POOR_RATIO, _GOOD_RATIO, _BEST_RATIO = 0.1, 0.75, 0.9
"""Actual over predicted reduction of the merit: below which the trust region shrinks, and above which it grows twofold
and fourfold."""
SAME_STRIP = 2e-3
"""Distance in ln b, ln h, ln l within which two results are the same strip."""
_PENALTY = 100.0
"""Weight of a violation against the cost: larger than the Lagrange multipliers of rods, including hardly feasible ones.
"""
_STALL_EXCESS = 1e-3
"""Excess above which a search that no longer reduces it is abandoned."""
MIN_EXCESS = 1e-16
"""The excess of a violation below rounding."""
_MIN_REDUCTION = 0.05
"""Share of the excess: a smaller predicted reduction counts as none."""
TOTAL_GAIN_RATIO = 4.0
_INTERIOR_GAIN_RATIO = 2.5
"""Maximum expected total gain of all following steps over the predicted gain of one step: of a step limited by the
trust region, and of one within it."""
_RELIABLE_SHARE = 0.8
"""Share of the predicted gain of a step to the result of another search that is relied upon."""
_ROUNDING = 1e-9
"""Rounding error of ln b, ln h, ln l."""
_SLSQP_ITERATIONS = 12
"""Maximum iterations of SLSQP in one iteration of the search."""


@dataclass(frozen=True)
class Task:
    """A problem for local searches: limits are tightened by ``margin``, and the search ends when the predicted gain in
    ln objective is below ``min_gain``. No search starts for the sake of a ``negligible_gain``."""

    problem: RodProblem
    margin: float
    min_gain: float
    negligible_gain: float = 0.0

    @cached_property
    def limits(self) -> Limits:
        """The limits by row of the search."""
        return self.problem.requirements.limits(self.problem.scene)

    def cost(self, check: RodCheck) -> float:
        """The ln objective of a check."""
        return self.problem.objective.log_cost(check, self.problem.scene)

    def excess(self, check: RodCheck) -> float:
        """The largest logarithmic excess of a check over a limit; 0 if it meets every requirement."""
        # Compared as a user would compare the values, not by logarithms.
        if self.problem.requirements.met_by(check):
            return 0.0
        excesses = (exact - self.limits[row] for row, exact in self._limited_rows(check))
        return max(max(excesses, default=0.0), MIN_EXCESS)

    def shifted_limits(self, check: RodCheck, values: Array) -> Limits:
        """The limits, each shifted by the difference of the exact value of its row from a model's ``values``."""
        limits = dict(self.limits)
        for row, exact in self._limited_rows(check):
            value = max(values[rows.STABILITY], values[rows.SIDEWAYS]) if row == rows.STABILITY else values[row]
            if math.isfinite(exact) and value > rows.NEVER_COMPRESSED:
                limits[row] -= exact - value
        return limits

    def _limited_rows(self, check: RodCheck) -> Iterator[tuple[int, float]]:
        """The rows that are limited, and their exact values."""
        return ((c.row, c.result.log_cost(check, self.problem.scene)) for c in CONSTRAINTS if c.row in self.limits)

    def iterate(self, outcome: Outcome[RodCheck], near: FullRows | None = None) -> Iterate:
        """A strip with its check and, if given, the model of the rows near it."""
        check = outcome.value
        x = logarithms(check.dimensions)
        limits = self.limits if near is None else self.shifted_limits(check, near.values(x))
        return Iterate(x, outcome, self.cost(check), self.excess(check), near, limits)


@dataclass(frozen=True)
class Iterate:
    """A strip with its exact check and the model there: all rows, and limits shifted to agree with the check.

    ``excess`` is the largest logarithmic excess over a limit. A strip that was only checked has no model (``rows``
    None).
    """

    x: Array
    outcome: Outcome[RodCheck]
    log_cost: float
    excess: float
    rows: FullRows | None
    limits: Limits

    @property
    def feasible(self) -> bool:
        return self.excess <= 0.0

    @property
    def dimensions(self) -> Dimensions:
        return self.outcome.value.dimensions


@dataclass(frozen=True)
class LocalResult:
    """The best feasible iterate or, without one, that of the least excess; ``predicted_gain`` is the gain in ln
    objective that the model still predicts there, ``refuted_gain`` what its slope promises for the longest step from
    there that was rejected, at most what it predicted for that."""

    at: Iterate
    predicted_gain: float
    refuted_gain: float = 0.0

    @property
    def feasible(self) -> bool:
        return self.at.feasible


def local_search(
    model: FullModel,
    task: Task,
    bounds: Bounds,
    start: Array,
    radius: float = _FIRST_RADIUS,
    max_iterations: int | None = None,
    incumbent: float = math.inf,
    results: Sequence[LocalResult] = (),
) -> LocalResult | None:
    """The best strip near ``start`` = ln(b, h, l) within the bounds.

    None if no strip near the start is stable against buckling, or if the search converges to one of the ``results`` of
    other searches. A search that is not expected to improve on the ln objective ``incumbent`` is abandoned.
    """
    box = bounds.logarithms
    current = _first_stable_iterate(model, task, bounds, np.clip(start, box[:, 0], box[:, 1]))
    if current is None:
        return None
    max_iterations = max_iterations or (_MAX_ITERATIONS_WITH_NOISE if model.is_excited_by_corners else _MAX_ITERATIONS)
    converged = [result.at for result in results if _is_converged_within(model, task, result, box)]
    best, gain, refuted, longest = current, math.inf, 0.0, 0.0
    for _ in range(max_iterations):
        min_gain = max(task.min_gain, model.unresolved_gain(current.outcome))
        step, predicted = _model_step(task, box, current, radius, min_gain)
        if current is best:
            gain = max(predicted, 0.0) if current.feasible else math.inf
            if gain <= min_gain:
                return LocalResult(best, gain, min(refuted, gain * longest / radius))
        length = float(np.max(np.abs(step - current.x)))
        if current.feasible and _leads_to_other(
            step, current.log_cost - _RELIABLE_SHARE * predicted + min_gain, converged
        ):
            return None
        at_edge = length > 0.95 * radius
        if length == 0.0 or radius < model.min_radius or _is_futile(current, predicted, min_gain, at_edge, incumbent):
            break
        trial, tried = evaluate_iterate(model, task, dimensions_within(bounds, step), current.rows), radius
        if model.is_excited_by_corners and trial is not None and 0.0 < trial.excess < predicted and current.feasible:
            trial = _second_order_correction(model, task, bounds, trial, length, min_gain)
        actual = -math.inf if trial is None else _merit(current) - _merit(trial)
        radius = _next_radius(radius, length, predicted, actual)
        if trial is None:
            continue
        if actual > 0.0 or (trial.feasible and not current.feasible):
            current = trial
        else:
            # The model at the iterate must represent the peaks at the rejected strip, too.
            again = task.iterate(current.outcome, model.rows_near(trial.rows.peaks, current.dimensions))
            if best is current:
                best, refuted, longest = again, max(refuted, predicted), max(longest, tried)
            current = again
        if _is_better(trial, best):
            best, refuted, longest = trial, 0.0, 0.0
    return LocalResult(best, gain, min(refuted, gain * longest / radius))


def _leads_to_other(step: Array, expected: float, converged: Sequence[Iterate]) -> bool:
    """Whether a step leads to the end of another search, which costs less than is ``expected`` of the step."""
    return any(_is_same(step, other.x) and expected > other.log_cost for other in converged)


def _is_futile(current: Iterate, predicted: float, min_gain: float, at_edge: bool, incumbent: float) -> bool:
    """Whether the steps that follow are not expected to meet the limits, or to improve on ``incumbent``; ``at_edge``:
    the trust region limits the first one."""
    if not current.feasible:
        return current.excess > _STALL_EXCESS and predicted < _MIN_REDUCTION * _PENALTY * current.excess
    total_gain_ratio = TOTAL_GAIN_RATIO if at_edge else _INTERIOR_GAIN_RATIO
    return current.log_cost - total_gain_ratio * max(predicted, min_gain) > incumbent


def _next_radius(radius: float, length: float, predicted: float, actual: float) -> float:
    """The trust-region radius after a step of some ``length``."""
    if actual < _POOR_RATIO * predicted:
        return 0.25 * min(radius, length)
    if actual > _GOOD_RATIO * predicted and length > 0.9 * radius:
        return min((4.0 if actual > _BEST_RATIO * predicted else 2.0) * radius, _MAX_RADIUS)
    return radius


def _second_order_correction(
    model: FullModel, task: Task, bounds: Bounds, trial: Iterate, radius: float, min_gain: float
) -> Iterate:
    """Second-order correction of a step: the strip to which the model at a slightly infeasible ``trial`` leads, if its
    merit is better, otherwise the trial.

    A model without all curvatures misses limits by the square of its step. The merit function counts that for more
    than the gain, so that only small steps would be accepted (the Maratos effect; Nocedal and Wright, Numerical
    Optimization, 2006, 15.5 and 15.6).
    """
    step, _ = _model_step(task, bounds.logarithms, trial, radius, min_gain)
    other = evaluate_iterate(model, task, dimensions_within(bounds, step), trial.rows)
    return trial if other is None or _merit(other) > _merit(trial) else other


def _is_converged_within(model: FullModel, task: Task, result: LocalResult, box: Array) -> bool:
    """Whether another search has converged, to a strip within these bounds."""
    min_gain = max(task.min_gain, model.unresolved_gain(result.at.outcome))
    inside = np.all((box[:, 0] - _ROUNDING < result.at.x) & (result.at.x < box[:, 1] + _ROUNDING))
    return result.feasible and result.predicted_gain <= min_gain and bool(inside)


def _is_same(x: Array, other: Array) -> bool:
    return float(np.max(np.abs(x - other))) < SAME_STRIP


def is_among(x: Array, results: Sequence[LocalResult]) -> bool:
    """Whether one of the results is the strip x = ln(b, h, l)."""
    return any(_is_same(x, result.at.x) for result in results)


def evaluate_iterate(model: FullModel, task: Task, d: Dimensions, earlier: FullRows | None = None) -> Iterate | None:
    """The check and the active-peak model at a strip, including the peaks of ``earlier`` rows; None if it buckles."""
    outcome = model.check(d)
    if outcome.value.stresses is None:
        return None
    peaks = model.peaks(d)
    return task.iterate(outcome, model.rows_near(peaks if earlier is None else peaks.merged_with(earlier.peaks), d))


def _first_stable_iterate(model: FullModel, task: Task, bounds: Bounds, x: Array) -> Iterate | None:
    """The iterate at x, or at the first thicker strip that does not buckle."""
    for thickening in (0.0, 0.03, 0.1, 0.3):
        thicker = x.copy()
        thicker[1] += thickening
        found = evaluate_iterate(model, task, dimensions_within(bounds, thicker))
        if found is not None:
            return found
    return None


def _model_step(task: Task, box: Array, current: Iterate, radius: float, min_gain: float) -> tuple[Array, float]:
    """The model's optimum within the trust region, and the predicted reduction of the merit function."""
    trust_box = np.stack([np.maximum(box[:, 0], current.x - radius), np.minimum(box[:, 1], current.x + radius)], axis=1)
    values = current.rows.values(current.x)
    p = program(task.problem.objective, current.limits, current.rows.layout, task.margin)
    step = run_slsqp(current.rows, p, trust_box, current.x, 0.1 * min_gain, _SLSQP_ITERATIONS)
    if step.violation > task.margin:
        # Where a violation is hardly above rounding SLSQP finds no descent: to first order, its merit function is
        # constant along the step to the limit.
        step = restore_feasibility(current.rows, p, trust_box, step.x)
    gain = p.cost(values) - step.cost
    if not current.feasible:
        gain += _PENALTY * (max(p.violation(values), 0.0) - max(step.violation, 0.0))
    return step.x, gain


def _merit(at: Iterate) -> float:
    return at.log_cost + _PENALTY * at.excess


def _is_better(trial: Iterate, best: Iterate) -> bool:
    if trial.feasible and best.feasible:
        return trial.log_cost < best.log_cost
    return trial.excess < best.excess
