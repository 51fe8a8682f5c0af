"""Sequential quadratic programming in the logarithms of b, h, l, on an active-peak model of any physics.

The worst of many sections is a kinked function; every fibre of the clamp and of each governing inner section is a
constraint of its own here, and so is every peak of the reactions, so that a kink becomes a corner where smooth
constraints meet. An objective that is the greatest of several is written with one more variable that all of them stay
below. Source: D. Kraft (1988), as scipy's SLSQP.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.rod import rows
from solvers.rod.constraints import Limits
from solvers.rod.optimum.peaks import Wanted
from solvers.rod.problem import Objective
from solvers.rod.rows import Layout

Array = NDArray[np.float64]

TOLERANCE, ITERATIONS = 1e-10, 60
"""Slopes by differences tell no less; line searches for less than that go on for hundreds of evaluations."""
_FAR = 700.0
ALL = np.arange(3)
"""The indices of b, h, l."""


class ActiveRows(Protocol):
    """All rows of strips near one whose peaks are known, as functions of x = ln(b, h, l)."""

    layout: Layout

    def values(self, x: Array) -> Array:
        """All rows, shape (rows,)."""

    def slopes(self, x: Array, free: Array = ALL) -> Array:
        """Their derivatives by x, shape (rows, 3); by those with other indices than ``free`` they may be left out."""


class Program(NamedTuple):
    """Minimise sum(weight row) over ``linear`` + ``top_weight`` max(rows ``top`` - ``offset``), subject to
    rows ``which`` <= ``limit``."""

    linear: tuple[tuple[int, float], ...]
    top: NDArray[np.intp]
    offset: Array
    top_weight: float
    which: NDArray[np.intp]
    limit: Array

    def cost(self, values: Array) -> float:
        """What is made small, of all rows."""
        cost = float(sum(weight * values[row] for row, weight in self.linear))
        return cost + self.top_weight * float(np.max(values[self.top] - self.offset)) if self.top.size else cost

    def violation(self, values: Array) -> float:
        """The greatest excess of a limited row over its limit; negative where all have room."""
        return float(np.max(values[self.which] - self.limit)) if self.which.size else -np.inf


@dataclass(frozen=True)
class Step:
    """Where a run ended, and what the model says there: the cost, and the greatest excess over a limit."""

    x: Array
    cost: float
    violation: float


def wanted_of(objective: Objective, limits: Limits) -> Wanted:
    """What objective and limits look at."""
    weighed = dict(objective.weights)
    pressed = rows.PRESSURE in limits or rows.PRESSURE in weighed or rows.SIDE in weighed
    return Wanted(rows.STRESS in limits, pressed, rows.POWER in limits or rows.POWER in weighed)


def limited_rows(limits: Limits, layout: Layout) -> tuple[NDArray[np.intp], Array]:
    """The smooth rows that are limited, and their limits; stability both in the crank's plane and out of it."""
    which, limit = [rows.SIDEWAYS], [limits[rows.STABILITY]]
    for row, greatest in limits.items():
        parts = layout.parts(row)
        which += parts
        limit += [greatest] * len(parts)
    return np.array(which, dtype=np.intp), np.array(limit)


def program(objective: Objective, limits: Limits, layout: Layout, safe: float = 0.0) -> Program:
    """The objective under limits, each tightened by ``safe``."""
    weights = dict(objective.weights)
    top = next((row for row in weights if len(layout.parts(row)) > 1), None)
    weight = 0.0 if top is None else weights.pop(top)
    inner = np.array(layout.parts(top) if weight else [], dtype=np.intp)
    which, limit = limited_rows(limits, layout)
    return Program(tuple(weights.items()), inner, np.zeros(inner.size), weight, which, limit - safe)


def feasibility_program(limits: Limits, layout: Layout) -> Program:
    """The greatest excess over a limit, made small; short of buckling throughout."""
    which, limit = limited_rows(limits, layout)
    upright = np.array([rows.STABILITY, rows.SIDEWAYS], dtype=np.intp)
    return Program((), which, limit, 1.0, upright, np.full(2, -1e-3))


@dataclass
class Memory:
    """Rows and slopes at the places last asked for, which an optimizer asks for again and again."""

    active: ActiveRows
    at: bytes = b""
    sloped: tuple[bytes, frozenset[int]] = (b"", frozenset())
    """Where, and by which of b, h, l. Places are known by their bytes: ten times as fast as by comparing arrays."""

    def values(self, x: Array) -> Array:
        key = x.tobytes()
        if key != self.at:
            self._values, self.at = self.active.values(x), key
        return self._values

    def slopes(self, x: Array, free: Array = ALL) -> Array:
        key, wanted = x.tobytes(), frozenset(free.tolist())
        if key != self.sloped[0] or not wanted <= self.sloped[1]:
            self.values(x)
            self._slopes, self.sloped = self.active.slopes(x, free), (key, wanted)
        return self._slopes


def run(memory: Memory, p: Program, box: Array, x: Array, tolerance: float = TOLERANCE, most: int = ITERATIONS) -> Step:
    """One run of SLSQP from x within ``box`` (3, 2): where it ends."""
    from scipy.optimize import minimize

    free = np.flatnonzero(box[:, 1] > box[:, 0])
    layered = p.top.size > 0

    def place(y: Array) -> Array:
        at = x.copy()
        at[free] = y[: free.size]
        return at

    def cost(y: Array) -> float:
        values = memory.values(place(y))
        linear = sum(weight * values[row] for row, weight in p.linear)
        return linear + p.top_weight * y[-1] if layered else linear

    def cost_slope(y: Array) -> Array:
        slope = np.zeros(y.size)
        if p.linear:
            slopes = memory.slopes(place(y), free)
            slope[: free.size] = sum(weight * slopes[row, free] for row, weight in p.linear)
        if layered:
            slope[-1] += p.top_weight
        return slope

    def slack(y: Array) -> Array:
        values = memory.values(place(y))
        out = p.limit - values[p.which]
        return np.concatenate([out, y[-1] + p.offset - values[p.top]]) if layered else out

    def slack_slope(y: Array) -> Array:
        slopes = memory.slopes(place(y), free)[:, free]
        if not layered:
            return -slopes[p.which]
        count = p.which.size
        out = np.zeros((count + p.top.size, y.size))
        out[:count, :-1], out[count:, :-1], out[count:, -1] = -slopes[p.which], -slopes[p.top], 1.0
        return out

    start, ranges = x[free], box[free]
    if layered:
        start = np.append(start, np.max(memory.values(x)[p.top] - p.offset))
        ranges = np.vstack([ranges, [-_FAR, _FAR]])
    if free.size:
        result = minimize(
            cost,
            start,
            jac=cost_slope,
            bounds=ranges,
            method="SLSQP",
            constraints={"type": "ineq", "fun": slack, "jac": slack_slope},
            options={"ftol": tolerance, "maxiter": most},
        )
        start = np.clip(result.x, ranges[:, 0], ranges[:, 1])
    at = place(start)
    if not np.all(np.isfinite(at)):
        return Step(x, np.inf, np.inf)
    values = memory.values(at)
    return Step(at, p.cost(values), p.violation(values))


def restored(memory: Memory, p: Program, box: Array, x: Array, steps: int = 4, near: float = 1e-2) -> Step:
    """The least steps that take violated limits back, where a run stopped a little outside."""
    for _ in range(steps):
        values = memory.values(x)
        excess = values[p.which] - p.limit
        over = excess > 0.0
        if not over.any() or excess.max() > near:
            break
        free, step = box[:, 1] > box[:, 0], np.zeros(3)
        slopes = memory.slopes(x, np.flatnonzero(free))[p.which][over]
        for _ in range(3):
            step[free] = -np.linalg.lstsq(slopes[:, free], excess[over], rcond=1e-9)[0]
            outside = free & ((x + step < box[:, 0]) | (x + step > box[:, 1]))
            if not outside.any():
                break
            free &= ~outside
            step[~free] = 0.0
        x = np.clip(x + step, box[:, 0], box[:, 1])
    values = memory.values(x)
    return Step(x, p.cost(values), p.violation(values))
