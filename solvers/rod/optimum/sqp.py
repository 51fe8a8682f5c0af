"""From a good strip to the best one nearby: sequential quadratic programming in logarithms of b, h, l.

The worst of many sections is a kinked function; every fibre of the clamp and of each governing inner section is a
constraint of its own here, and so is every peak of the reactions, so that a kink becomes a corner where smooth
constraints meet. An objective that is the greatest of several is written with one more variable that all of them stay
below. After each run the governing angles and sections are looked for again and join the earlier ones, until the strip
stays where it is: an exchange as E. Remez's (1934), which cannot go round in circles between strips whose worst
sections are each other's harmless ones. What a strip is said to cost, it costs at its own worst sections.
Source: D. Kraft (1988), as scipy's SLSQP.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from solvers.rod.optimum import constraints as rows
from solvers.rod.optimum.full_model.tilt import Tilt
from solvers.rod.optimum.machine import Machine, Matters
from solvers.rod.optimum.peak_model import (
    FIRST_GROUP,
    SIDEWAYS,
    STRESS,
    Array,
    Focus,
    first_peak,
    joined,
    row_count,
    rows_and_slopes,
)
from solvers.rod.problem import Bounds, Objective
from solvers.rod.scene import Dimensions

_TOLERANCE = 1e-13
_VIOLATION = 0.9e-9
_SAFE_SIDE = 1e-9
_STILL = 1e-4
_ROUNDS = 12
_STEPS_BACK = 4
_NEAR_ENOUGH = 1e-2


@dataclass(frozen=True)
class Limits:
    """What a strip has to meet: least safeties, greatest stress, contact pressure and power; None asks for nothing."""

    fatigue: float | None
    stability: float
    stress: float | None = None
    pressure: float | None = None
    power: float | None = None


@dataclass(frozen=True)
class Polished:
    """A strip, the logarithm of its objective as made small (1/n for a safety; mass per density), and what governs it:
    the focus on it and the middle angles of the focus."""

    dimensions: Dimensions
    log_cost: float
    focus: Focus
    angles: Array


@dataclass
class _Memory:
    """One focus and the rows at the last place asked for, tilted where they are."""

    focus: Focus
    tilt: Tilt | None
    at: Array | None = None

    def __post_init__(self) -> None:
        self.table = np.empty((self.focus.force.size, self.focus.eta.size))
        self.values = np.empty(row_count(self.focus))
        self.slopes = np.empty((self.values.size, 3))

    def look(self, x: Array) -> tuple[Array, Array]:
        if self.at is None or not np.array_equal(x, self.at):
            rows_and_slopes(self.focus, x, self.table, self.values, self.slopes)
            if self.tilt is not None:
                self.tilt.apply(x, self.focus, self.values, self.slopes)
            self.at = x.copy()
        return self.values, self.slopes


def matters(objective: Objective, limits: Limits) -> Matters:
    """What objective and limits look at."""
    weighed = dict(objective.weights)
    pressed = limits.pressure is not None or rows.PRESSURE in weighed or rows.SIDE in weighed
    return Matters(limits.stress is not None, pressed, limits.power is not None or rows.POWER in weighed)


def parts_of(focus: Focus, row: int) -> range:
    """The rows that a row is the greatest of, or the row itself."""
    peaks, count = first_peak(focus), row_count(focus)
    greatest_of = {
        rows.UTILISATION: range(FIRST_GROUP, peaks),
        rows.SIDE: range(peaks, count, 2),
        rows.PRESSURE: range(peaks + 1, count, 2),
    }
    return greatest_of.get(row, range(row, row + 1))


def constraint_rows(limits: Limits, focus: Focus) -> tuple[Array, Array]:
    """The rows that are limited and the logarithms of their limits."""
    which, limit = [rows.STABILITY, SIDEWAYS], [-math.log(limits.stability)] * 2
    for row, greatest in (
        (rows.UTILISATION, limits.fatigue and 1.0 / limits.fatigue),
        (STRESS, limits.stress),
        (rows.PRESSURE, limits.pressure),
        (rows.POWER, limits.power),
    ):
        if greatest is not None:
            parts = parts_of(focus, row)
            which += parts
            limit += [math.log(greatest)] * len(parts)
    return np.array(which), np.array(limit)


def polish(
    machine: Machine,
    objective: Objective,
    limits: Limits,
    bounds: Bounds,
    start: Dimensions,
    tilt: Tilt | None = None,
) -> Polished | None:
    """The best strip near ``start`` that meets the limits, to the safe side by 1e-9, or None if none is reached.

    Not worse than ``start``. With a ``tilt`` limits and cost are those of tilted rows.
    """
    box = np.log([bounds.b, bounds.h, bounds.l])
    x = np.clip(np.log([start.b, start.h, start.l]), box[:, 0], box[:, 1])
    wanted = matters(objective, limits)
    focus, angles = machine.focus_at(*np.exp(x), wanted)
    memory = _Memory(focus, tilt)
    unmoved, (cost, violation) = (x, focus, angles), _measured(memory, objective, limits, x)
    least = cost if violation <= _VIOLATION else math.inf
    for _ in range(_ROUNDS):
        moved, cost, violation = _run(memory, objective, limits, box, x)
        if not np.all(np.isfinite(moved)):
            violation = math.inf
            break
        if violation > _VIOLATION:
            moved, cost, violation = _restored(memory, objective, limits, box, moved)
        still = float(np.max(np.abs(moved - x))) < _STILL
        x = moved
        if still:
            break
        focus, angles = joined(machine.focus_at(*np.exp(x), wanted), (focus, angles))
        memory = _Memory(focus, tilt)
    else:
        cost, violation = _measured(memory, objective, limits, x)
    if violation > _VIOLATION or cost > least:
        if least == math.inf:
            return None
        (x, focus, angles), cost = unmoved, least
    b, h, l = (
        min(max(math.exp(v), low), high) for v, (low, high) in zip(x, (bounds.b, bounds.h, bounds.l), strict=True)
    )
    return Polished(Dimensions(b, h, l), cost, focus, angles)


def _measured(memory: _Memory, objective: Objective, limits: Limits, x: Array) -> tuple[float, float]:
    """ln objective and the greatest violation."""
    which, limit = constraint_rows(limits, memory.focus)
    values = memory.look(x)[0]
    cost = float(sum(weight * values[row] for row, weight in objective.weights))
    return cost, float(np.max(values[which] - limit + _SAFE_SIDE))


def _restored(
    memory: _Memory, objective: Objective, limits: Limits, box: Array, x: Array
) -> tuple[Array, float, float]:
    """The least steps that take the violated limits back, where the run stopped outside: as ``_run`` returns."""
    which, limit = constraint_rows(limits, memory.focus)
    limit = limit - _SAFE_SIDE
    for _ in range(_STEPS_BACK):
        values, slopes = memory.look(x)
        excess = values[which] - limit
        over = excess > 0.0
        if not over.any() or excess.max() > _NEAR_ENOUGH:
            break
        free = np.ones(3, dtype=bool)
        step = np.zeros(3)
        for _ in range(3):
            step[free] = -np.linalg.lstsq(slopes[which][over][:, free], excess[over], rcond=1e-9)[0]
            outside = free & ((x + step < box[:, 0]) | (x + step > box[:, 1]))
            if not outside.any():
                break
            free &= ~outside
            step[~free] = 0.0
        x = np.clip(x + step, box[:, 0], box[:, 1])
    return x, *_measured(memory, objective, limits, x)


def _run(memory: _Memory, objective: Objective, limits: Limits, box: Array, x: Array) -> tuple[Array, float, float]:
    """One run of SLSQP on one focus: where it ends, ln objective, greatest violation."""
    from scipy.optimize import minimize

    which, limit = constraint_rows(limits, memory.focus)
    limit = limit - _SAFE_SIDE
    free = np.flatnonzero(box[:, 1] > box[:, 0])
    weights = dict(objective.weights)
    topped = next((row for row in weights if len(parts_of(memory.focus, row)) > 1), None)
    above = weights.pop(topped, 0.0)
    inner = np.array(parts_of(memory.focus, topped) if above else [], dtype=int)

    def place(y: Array) -> Array:
        at = x.copy()
        at[free] = y[: free.size]
        return at

    def cost(y: Array) -> tuple[float, Array]:
        values, slopes = memory.look(place(y))
        value, slope = 0.0, np.zeros(y.size)
        for row, weight in weights.items():
            value += weight * values[row]
            slope[: free.size] += weight * slopes[row, free]
        if above:
            value += above * y[-1]
            slope[-1] += above
        return value, slope

    def slack(y: Array) -> Array:
        values = memory.look(place(y))[0]
        out = limit - values[which]
        return np.concatenate([out, y[-1] - values[inner]]) if above else out

    def slack_slope(y: Array) -> Array:
        slopes = memory.look(place(y))[1][:, free]
        if not above:
            return -slopes[which]
        out = np.zeros((which.size + inner.size, y.size))
        out[: which.size, :-1], out[which.size :, :-1], out[which.size :, -1] = -slopes[which], -slopes[inner], 1.0
        return out

    start, ranges = x[free], box[free]
    if above:
        start = np.append(start, np.max(memory.look(x)[0][inner]))
        ranges = np.vstack([ranges, [-700.0, 700.0]])
    if start.size:
        result = minimize(
            cost,
            start,
            jac=True,
            bounds=ranges,
            method="SLSQP",
            constraints={"type": "ineq", "fun": slack, "jac": slack_slope},
            options={"ftol": _TOLERANCE, "maxiter": 60},
        )
        start = np.clip(result.x, ranges[:, 0], ranges[:, 1])
    at = place(start)
    return at, *_measured(memory, objective, limits, at)
