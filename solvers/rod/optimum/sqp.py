"""Sequential quadratic programming in x = ln(b, h, l) on an active-peak model of any physics.

The maximum over many sections is not differentiable. Each fibre of the clamp and of every governing interior section,
and each peak of the reactions, is therefore a separate smooth constraint. An objective that is a maximum is minimised
in epigraph form: an additional variable bounds all its parts from above. Source: D. Kraft (1988), as scipy's SLSQP.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple, Protocol

import numpy as np

from solvers.numerics.arrays import Array, Index
from solvers.rod import rows
from solvers.rod.constraints import Limits
from solvers.rod.objectives import Objective
from solvers.rod.optimum.peaks import RequiredResults
from solvers.rod.rows import Layout

TOLERANCE, ITERATIONS = 1e-10, 60
"""Derivatives by finite differences resolve no smaller change; line searches for less take hundreds of evaluations."""
_MAX_LOG = 700.0
_RESTORING_STEPS, _MAX_RESTORED = 4, 1e-2
"""Number of Newton steps back to limits, and the logarithmic excess up to which they are made."""
_NO_STEP = 1e-10
"""Step in ln b, ln h, ln l and in ln objective below which a line search is fruitless, as at an infeasible corner."""
ALL = np.arange(3)
"""The indices of b, h, l."""


class ActiveRows(Protocol):
    """All rows of the strips near one with known peaks, as functions of x = ln(b, h, l)."""

    layout: Layout

    def values(self, x: Array) -> Array:
        """All rows, shape (rows,)."""

    def jacobian(self, x: Array, free: Array = ALL) -> Array:
        """Derivatives of all rows with respect to x, shape (rows, 3); only columns ``free`` need be computed."""


class Program(NamedTuple):
    """Minimise sum of weight*row over ``linear`` + ``max_weight`` max(rows ``max_rows`` - ``max_offset``), subject to
    rows ``limited`` <= ``limit``."""

    linear: tuple[tuple[int, float], ...]
    max_rows: Index
    max_offset: Array
    max_weight: float
    limited: Index
    limit: Array

    def cost(self, values: Array) -> float:
        """The cost, from all rows."""
        cost = float(sum(weight * values[row] for row, weight in self.linear))
        if not self.max_rows.size:
            return cost
        return cost + self.max_weight * float(np.max(values[self.max_rows] - self.max_offset))

    def violation(self, values: Array) -> float:
        """Maximum excess of a limited row over its limit; negative if no limit is active."""
        return float(np.max(values[self.limited] - self.limit)) if self.limited.size else -np.inf


class _Stalled(Exception):
    """A line search has shortened its step to nothing."""


@dataclass(frozen=True)
class SlsqpResult:
    """End point of a run, with the model's cost and maximum excess over a limit there."""

    x: Array
    cost: float
    violation: float


def required_results(objective: Objective, limits: Limits) -> RequiredResults:
    """The results on which objective and limits depend."""
    weights = dict(objective.weights)
    reactions = rows.PRESSURE in limits or rows.PRESSURE in weights or rows.SIDE in weights
    stress, power = (row in limits or row in weights for row in (rows.STRESS, rows.POWER))
    return RequiredResults(stress, reactions, power)


def limited_rows(limits: Limits, layout: Layout) -> tuple[Index, Array]:
    """The smooth rows that are limited, and their limits; stability both in and out of the crank's plane."""
    limited, limit = [rows.SIDEWAYS], [limits[rows.STABILITY]]
    for row, value in limits.items():
        parts = layout.parts(row)
        limited += parts
        limit += [value] * len(parts)
    return np.array(limited, dtype=np.intp), np.array(limit)


def program(objective: Objective, limits: Limits, layout: Layout, margin: float) -> Program:
    """The minimisation of an objective under limits, each tightened by ``margin``."""
    weights = dict(objective.weights)
    max_row = next((row for row in weights if len(layout.parts(row)) > 1), None)
    weight = 0.0 if max_row is None else weights.pop(max_row)
    parts = np.array(layout.parts(max_row) if weight else [], dtype=np.intp)
    limited, limit = limited_rows(limits, layout)
    return Program(tuple(weights.items()), parts, np.zeros(parts.size), weight, limited, limit - margin)


def feasibility_program(limits: Limits, layout: Layout) -> Program:
    """The minimisation of the maximum excess over a limit, subject to stability against buckling."""
    limited, limit = limited_rows(limits, layout)
    stability = np.array([rows.STABILITY, rows.SIDEWAYS], dtype=np.intp)
    return Program((), limited, limit, 1.0, stability, np.full(2, -1e-3))


def run_slsqp(
    active: ActiveRows, p: Program, box: Array, x: Array, tolerance: float = TOLERANCE,
    max_iterations: int = ITERATIONS,
) -> SlsqpResult:  # fmt: skip
    """Run SLSQP from x within the bounds ``box``, shape (3, 2)."""
    from scipy.optimize import minimize

    free = np.flatnonzero(box[:, 1] > box[:, 0])
    epigraph, constrained = p.max_rows.size > 0, np.append(p.limited, p.max_rows)

    # SLSQP asks for the rows and their slopes at the same point more than once. Points are told by their bytes, in a
    # tenth of the time of comparing arrays.
    def full_point(sizes: bytes) -> Array:
        at = x.copy()
        at[free] = np.frombuffer(sizes)
        return at

    rows_at = lru_cache(maxsize=1)(lambda sizes: active.values(full_point(sizes)))
    slopes_at = lru_cache(maxsize=1)(lambda sizes: active.jacobian(full_point(sizes), free)[:, free])

    def values_of(y: Array) -> Array:
        return rows_at(y[: free.size].tobytes())

    def slopes_of(y: Array) -> Array:
        return slopes_at(y[: free.size].tobytes())

    def cost(y: Array) -> float:
        if 0.0 < float(np.max(np.abs(y - latest))) < _NO_STEP:
            raise _Stalled
        values = values_of(y)
        linear = sum(weight * values[row] for row, weight in p.linear)
        return linear + p.max_weight * y[-1] if epigraph else linear

    def cost_gradient(y: Array) -> Array:
        nonlocal latest
        latest, gradient = y.copy(), np.zeros(y.size)
        if p.linear:
            slopes = slopes_of(y)
            gradient[: free.size] = sum(weight * slopes[row] for row, weight in p.linear)
        if epigraph:
            gradient[-1] += p.max_weight
        return gradient

    def slack(y: Array) -> Array:
        values = values_of(y)
        out = p.limit - values[p.limited]
        return np.concatenate([out, y[-1] + p.max_offset - values[p.max_rows]]) if epigraph else out

    def slack_jacobian(y: Array) -> Array:
        slopes = slopes_of(y)
        if not epigraph:
            return -slopes[p.limited]
        out = np.zeros((constrained.size, y.size))
        out[:, :-1], out[p.limited.size :, -1] = -slopes[constrained], 1.0
        return out

    start, ranges = x[free], box[free]
    if epigraph:
        start = np.append(start, np.max(values_of(start)[p.max_rows] - p.max_offset))
        ranges = np.vstack([ranges, [-_MAX_LOG, _MAX_LOG]])
    if free.size:
        latest = start
        with suppress(_Stalled):
            latest = minimize(
                cost,
                start,
                jac=cost_gradient,
                bounds=ranges,
                method="SLSQP",
                constraints={"type": "ineq", "fun": slack, "jac": slack_jacobian},
                options={"ftol": tolerance, "maxiter": max_iterations},
            ).x
        start = np.clip(latest, ranges[:, 0], ranges[:, 1])
    at = x.copy()
    at[free] = start[: free.size]
    if not np.all(np.isfinite(at)):
        return SlsqpResult(x, np.inf, np.inf)
    values = values_of(start)
    return SlsqpResult(at, p.cost(values), p.violation(values))


def restore_feasibility(active: ActiveRows, p: Program, box: Array, x: Array) -> SlsqpResult:
    """Restore feasibility after a run that ended slightly outside its limits, by least-norm Newton steps; farther
    outside x is left as it is."""
    for _ in range(_RESTORING_STEPS):
        values = active.values(x)
        excess = values[p.limited] - p.limit
        over = excess > 0.0
        if not over.any() or excess.max() > _MAX_RESTORED:
            break
        free, step = box[:, 1] > box[:, 0], np.zeros(3)
        jacobian = active.jacobian(x, np.flatnonzero(free))[p.limited][over]
        for _ in range(3):
            step[free] = -np.linalg.lstsq(jacobian[:, free], excess[over], rcond=1e-9)[0]
            outside = free & ((x + step < box[:, 0]) | (x + step > box[:, 1]))
            if not outside.any():
                break
            free &= ~outside
            step[~free] = 0.0
        x = np.clip(x + step, box[:, 0], box[:, 1])
    values = active.values(x)
    return SlsqpResult(x, p.cost(values), p.violation(values))
