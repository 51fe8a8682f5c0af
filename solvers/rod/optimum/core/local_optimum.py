"""Local refinement of a strip to the nearest optimum on the core's physics.

After each run of the optimiser the governing angles and sections are located again and added to the previous ones,
until the strip no longer changes. This is an exchange algorithm (E. Remez, 1934). Since no peak is dropped, it cannot
cycle between strips with different governing sections. The cost of a strip is that at its own governing sections.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from solvers.rod.constraints import Limits
from solvers.rod.objectives import Objective
from solvers.rod.optimum.core.cycle import CoreCycle, CoreRows
from solvers.rod.optimum.peaks import Peaks
from solvers.rod.optimum.sqp import (
    TOLERANCE,
    ActiveRows,
    Program,
    SlsqpResult,
    program,
    required_results,
    restore_feasibility,
    run_slsqp,
)
from solvers.rod.problem import Bounds
from solvers.rod.scene import Dimensions

_MAX_VIOLATION, _MARGIN = 0.9e-9, 1e-9
"""Violation of a limit, tightened by the margin, at which a strip still meets the limit itself."""
_STATIONARY_STEP, _ROUNDS = 1e-4, 12
"""Step in ln b, ln h, ln l from which peaks are located again, and how often at the most."""
_ROUNDING = 1e-12
"""Relative rounding error of a size."""


@dataclass(frozen=True)
class Polished:
    """A locally optimal strip.

    log_cost   logarithm of the minimised objective (1/n for a safety, mass/density)
    peaks      locations of its peaks
    active     rows of the strips near it
    """

    dimensions: Dimensions
    log_cost: float
    peaks: Peaks
    active: CoreRows


def polish(
    cycle: CoreCycle, objective: Objective, limits: Limits, bounds: Bounds, start: Dimensions,
    tolerance: float = TOLERANCE,
) -> Polished | None:  # fmt: skip
    """The strip near ``start`` that meets the limits with a margin of 1e-9 and is locally optimal to a ``tolerance`` in
    ln objective; None if none is reached.

    It is not worse than ``start``.
    """
    box = bounds.logarithms
    x = np.clip(np.log([start.b, start.h, start.l]), box[:, 0], box[:, 1])
    required = required_results(objective, limits)
    peaks = cycle.peaks(Dimensions(*np.exp(x).tolist()), required)
    active = cycle.rows_near(peaks, required)
    p = program(objective, limits, active.layout, _MARGIN)
    values = active.values(x)
    initial, cost, violation = (x, peaks, active), p.cost(values), p.violation(values)
    initial_cost = cost if violation <= _MAX_VIOLATION else math.inf
    for _ in range(_ROUNDS):
        step = _within_limits(active, p, box, run_slsqp(active, p, box, x, tolerance))
        converged = float(np.max(np.abs(step.x - x))) < _STATIONARY_STEP
        x, cost, violation = step.x, step.cost, step.violation
        if converged:
            break
        peaks = cycle.peaks(Dimensions(*np.exp(x).tolist()), required).merged_with(peaks)
        active = cycle.rows_near(peaks, required)
        p, values = program(objective, limits, active.layout, _MARGIN), active.values(x)
        change = max(abs(p.cost(values) - cost), abs(p.violation(values) - violation))
        cost, violation = p.cost(values), p.violation(values)
        if change < tolerance:
            step = _within_limits(active, p, box, SlsqpResult(x, cost, violation))
            x, cost, violation = step.x, step.cost, step.violation
            break
    if violation > _MAX_VIOLATION or cost > initial_cost:
        if initial_cost == math.inf:
            return None
        (x, peaks, active), cost = initial, initial_cost
    return Polished(dimensions_within(bounds, x), cost, peaks, active)


def _within_limits(active: ActiveRows, p: Program, box: np.ndarray, step: SlsqpResult) -> SlsqpResult:
    """The result of a run led back within limits that it slightly exceeds."""
    if step.violation > _MAX_VIOLATION and math.isfinite(step.violation):
        return restore_feasibility(active, p, box, step.x)
    return step


def dimensions_within(bounds: Bounds, x: np.ndarray) -> Dimensions:
    """The strip with x = ln(b, h, l) within the bounds; a size that differs from a bound by rounding is set to it."""
    ranges = (bounds.b, bounds.h, bounds.l)
    return Dimensions(*(_snapped_to_bounds(math.exp(v), low, high) for v, (low, high) in zip(x, ranges, strict=True)))


def _snapped_to_bounds(size: float, low: float, high: float) -> float:
    if size <= low * (1.0 + _ROUNDING):
        return low
    return high if size >= high * (1.0 - _ROUNDING) else size
