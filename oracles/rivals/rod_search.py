"""Local searches for a better strip, over (ln b, ln h, ln l), on nothing but what a check says.

Three ways, each from a start of its own:

SLSQP with one-sided differences, quick where every limit is smooth; COBYQA, which models values alone; and linear
programs within a trust region, which keep every tangent seen within it. The last is for corners: a fatigue safety is
the least over sections and fibres, and where two of them govern, one gradient tells half of the truth.

Sizes that come in steps or from a stock are first searched as if they did not, then on their grid: the sizes that stay
free are searched anew at every neighbour, until none is better.

Every strip that is looked at is a rival: the best one that keeps all limits is remembered, whichever way came past it.
"""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import NonlinearConstraint, linprog, minimize

Array = np.ndarray

DIFFERENCE = 3e-6
"""Step of the differences in the logarithms. The check's errors, mostly below 1e-9, spoil a slope by less than a
thousandth; a greater step would straddle the corners of the limits."""
_DIFFERENCES = (3e-7, 3e-5)
"""Of the linear programs, which go along with their reach."""
_PUSH = 1e-9
"""By how much searches keep clear of the limits, so that where they end is within them."""
_LOST = 1.0
"""How far beyond its limit a result counts that does not exist, beyond what stability alone says."""
_PENALTY = 1000.0
"""What a limit missed costs, against the objective; near the greatest fatigue safety that there is, multipliers exceed
100."""
_LEAST_REACH, _LEAST_GAIN = 1e-6, 1e-9
_POLISH = 1e-3
"""Reach of the linear programs that bring the end of another search back within its limits."""
_SAME = 1e-9


@dataclass(frozen=True)
class Look:
    """What a check says of a strip: the logarithm of the objective, as made small, and by how much, as logarithms, each
    limit is kept (negative: missed). Not finite where there is no such result."""

    cost: float
    margins: Array

    @property
    def violation(self) -> float:
        return max(0.0, -float(self.margins.min())) if self.margins.size else 0.0


@dataclass(frozen=True)
class Space:
    """Bounds of the sizes (b, h, l) [any unit], and the values to be had of those that are not free, else None."""

    lower: Array
    upper: Array
    grids: tuple[Array | None, Array | None, Array | None] = (None, None, None)

    @property
    def stepped(self) -> tuple[int, ...]:
        return tuple(i for i, grid in enumerate(self.grids) if grid is not None)

    def sizes(self, logs: Array) -> tuple[Array, bool]:
        """The sizes, within bounds to the last digit, and whether they can be had."""
        sizes = np.clip(np.exp(logs), self.lower, self.upper)
        had = True
        for i in self.stepped:
            nearest = self.grids[i][np.abs(self.grids[i] - sizes[i]).argmin()]
            if abs(nearest / sizes[i] - 1.0) < _SAME:
                sizes[i] = nearest
            else:
                had = False
        return sizes, had


class Spent(Exception):
    """A search has had its evaluations."""


@dataclass
class Hunt:
    """The strips looked at so far. ``seeking`` False asks for any strip within the limits, whatever it costs."""

    space: Space
    look: Callable[[Array], Look]
    seeking: bool = True
    best: tuple[float, Array] | None = None
    found_by: str = ""
    evaluations: int = 0
    way: str = ""
    lead: tuple[float, Array] | None = None
    _left: float = math.inf
    _known: dict[bytes, Look] = field(default_factory=dict)
    _worst_cost: float = -math.inf

    def allow(self, evaluations: int, way: str) -> None:
        """What the next search is called, and what it may use; the lead is the best that it will have come to."""
        self._left, self.way, self.lead = evaluations, way, None

    def at(self, logs: Array) -> Look:
        """The look at a strip, with finite numbers where there is none."""
        sizes, had = self.space.sizes(logs)
        key = sizes.tobytes()
        if key in self._known:
            return self._known[key]
        if self._left <= 0:
            raise Spent
        self._left -= 1
        self.evaluations += 1
        seen = self.look(sizes)
        counts = had and seen.violation == 0.0 and np.all(np.isfinite(seen.margins)) and math.isfinite(seen.cost)
        if counts and (self.best is None or seen.cost < self.best[0]):
            self.best, self.found_by = (seen.cost, sizes), self.way
        self._known[key] = known = self._finite(seen)
        if self.lead is None or _merit(known) < self.lead[0]:
            self.lead = _merit(known), np.log(sizes)
        return known

    def _finite(self, seen: Look) -> Look:
        missing = ~np.isfinite(seen.margins)
        margins = np.where(missing, 0.0, seen.margins)
        margins = np.where(missing, min(0.0, float(margins.min(initial=0.0))) - _LOST, margins)
        if math.isfinite(seen.cost):
            self._worst_cost = max(self._worst_cost, seen.cost)
        cost = seen.cost if math.isfinite(seen.cost) else max(self._worst_cost, -1e3) + _LOST
        return Look(cost if self.seeking else 0.0, margins)

    def slopes(self, logs: Array, free: tuple[int, ...], difference: float = DIFFERENCE) -> tuple[Array, Array]:
        """Slopes of the cost and of the margins (limits × free sizes) by one-sided differences, within the bounds."""
        here, cost, margins = self.at(logs), [], []
        for i in free:
            step = difference if logs[i] + difference <= math.log(self.space.upper[i]) else -difference
            moved = logs.copy()
            moved[i] += step
            there = self.at(moved)
            cost.append((there.cost - here.cost) / step)
            margins.append((there.margins - here.margins) / step)
        return np.array(cost), np.array(margins).T

    def clipped(self, logs: Array) -> Array:
        return np.clip(logs, np.log(self.space.lower), np.log(self.space.upper))

    def merit(self, logs: Array) -> float:
        return _merit(self.at(logs))


def _merit(seen: Look) -> float:
    return seen.cost + _PENALTY * max(float(_PUSH - seen.margins.min(initial=math.inf)), 0.0)


Tangent = tuple[Array, Look, Array, Array]
"""A strip (in logarithms), what is seen there, and the slopes of cost and margins."""
Way = Callable[[Hunt, Array, tuple[int, ...], float], Array]
"""From a start (in logarithms), over some of the sizes, with a first reach: where it ended."""


def slsqp(hunt: Hunt, start: Array, free: tuple[int, ...], reach: float) -> Array:
    """scipy's SLSQP; ``reach`` is its own business."""

    def whole(x: Array) -> Array:
        logs = start.copy()
        logs[list(free)] = x
        return hunt.clipped(logs)

    found = minimize(
        lambda x: hunt.at(whole(x)).cost,
        start[list(free)],
        jac=lambda x: hunt.slopes(whole(x), free)[0],
        bounds=_box(hunt, free),
        constraints={
            "type": "ineq",
            "fun": lambda x: hunt.at(whole(x)).margins - _PUSH,
            "jac": lambda x: hunt.slopes(whole(x), free)[1],
        },
        method="SLSQP",
        options={"ftol": 1e-11, "maxiter": 60},
    )
    return whole(found.x) if np.all(np.isfinite(found.x)) else start


def cobyqa(hunt: Hunt, start: Array, free: tuple[int, ...], reach: float) -> Array:
    """scipy's COBYQA."""

    def whole(x: Array) -> Array:
        logs = start.copy()
        logs[list(free)] = x
        return hunt.clipped(logs)

    found = minimize(
        lambda x: hunt.at(whole(x)).cost,
        start[list(free)],
        bounds=_box(hunt, free),
        constraints=NonlinearConstraint(lambda x: hunt.at(whole(x)).margins, _PUSH, np.inf),
        method="COBYQA",
        options={"initial_tr_radius": reach, "final_tr_radius": 1e-8, "maxfev": 1000},
    )
    return whole(found.x)


def linear_programs(hunt: Hunt, start: Array, free: tuple[int, ...], reach: float) -> Array:
    """min max_k (c_k + g_k d_k) + M t under m_k + J_k d_k + t >= 0 for all tangents k seen near, |d| <= reach.

    One step may lead uphill: a curved limit is missed by the first step along it, and kept again after the second.
    """
    index, here, strayed, rng = list(free), hunt.clipped(start), False, np.random.default_rng(0)
    best, value = here, hunt.merit(here)

    def tangent() -> Tangent:
        """Taken a little aside: at a corner itself, each difference may see another side of it."""
        difference = min(max(0.01 * reach, _DIFFERENCES[0]), _DIFFERENCES[1])
        aside = here.copy()
        aside[index] += 10.0 * difference * rng.uniform(-1.0, 1.0, len(free))
        aside = hunt.clipped(aside)
        return aside, hunt.at(aside), *hunt.slopes(aside, free, difference)

    seen = [tangent()]
    while reach > _LEAST_REACH:
        promised, step = _programmed(hunt, seen, here, index, reach)
        if promised > value - _LEAST_GAIN:
            here, strayed, reach = best, False, 0.25 * reach
            continue
        here = here.copy()
        here[index] += step
        here = hunt.clipped(here)
        seen.append(tangent())
        gained = (value - hunt.merit(here)) / (value - promised)
        if gained > 0.05:
            best, value, strayed = here, hunt.merit(here), False
            reach *= 2.0 if gained > 0.7 else 1.0
        elif strayed:
            here, strayed, reach = best, False, 0.3 * reach
        else:
            strayed = True
    return best


def _programmed(hunt: Hunt, seen: list[Tangent], here: Array, index: list[int], reach: float) -> tuple[float, Array]:
    """The value that the linear program promises, and its step."""
    rows, right = [], []
    for point, look, cost, margins in seen:
        if np.abs(point - here).max() > 2.0 * reach and look is not seen[-1][1]:
            continue
        apart = (here - point)[index]
        # The step d, the cost's greatest tangent, and the slack t.
        rows.append(np.concatenate([cost, [-1.0, 0.0]]))
        right.append(-look.cost - cost @ apart)
        rows += [np.concatenate([-slope, [0.0, -1.0]]) for slope in margins]
        right += list(look.margins + margins @ apart - _PUSH)
    low, high = np.log(hunt.space.lower[index]) - here[index], np.log(hunt.space.upper[index]) - here[index]
    within = np.minimum(np.maximum(low, -reach), 0.0), np.maximum(np.minimum(high, reach), 0.0)
    goal = np.concatenate([np.zeros(len(index)), [1.0, _PENALTY]])
    bounds = [*zip(*within, strict=True), (None, None), (0.0, None)]
    solved = linprog(goal, np.array(rows), np.array(right), bounds=bounds)
    return (math.inf, np.zeros(len(index))) if solved.x is None else (solved.fun, solved.x[: len(index)])


def _box(hunt: Hunt, free: tuple[int, ...]) -> list[tuple[float, float]]:
    return [(math.log(hunt.space.lower[i]), math.log(hunt.space.upper[i])) for i in free]


POLISHER = "linear programs"
WAYS: dict[str, Way] = {"SLSQP": slsqp, "COBYQA": cobyqa, POLISHER: linear_programs}


def search(hunt: Hunt, way: str, start: Array, evaluations: int, reach: float) -> None:
    """One local search; what it found is what the hunt remembers."""
    hunt.allow(evaluations, way)
    everything = tuple(i for i in range(3) if hunt.space.upper[i] > hunt.space.lower[i])
    start = hunt.clipped(start)
    with contextlib.suppress(Spent):
        hunt.at(start)
        if everything:
            WAYS[way](hunt, start, everything, reach)
    end = hunt.lead[1] if hunt.lead else start
    if everything and way != POLISHER:
        hunt.allow(evaluations // 2, f"{way}, then {POLISHER}")
        with contextlib.suppress(Spent):
            WAYS[POLISHER](hunt, end, everything, _POLISH)
        end = hunt.lead[1] if hunt.lead else end
    if hunt.space.stepped:
        hunt.allow(evaluations, f"{way}, then over the grid")
        with contextlib.suppress(Spent):
            _walk(hunt, way, end, tuple(i for i in everything if i not in hunt.space.stepped), reach)


def _walk(hunt: Hunt, way: str, start: Array, free: tuple[int, ...], reach: float) -> None:
    """Over the grid of the sizes that are not free, from the nearest to a start to its best neighbour, until there is
    none better."""
    stepped, grids = hunt.space.stepped, hunt.space.grids
    here = tuple(int(np.abs(np.log(grids[i]) - start[i]).argmin()) for i in stepped)
    done: dict[tuple[int, ...], tuple[float, Array]] = {}

    def best_at(place: tuple[int, ...], logs: Array) -> float:
        if place not in done:
            logs = logs.copy()
            for i, n in zip(stepped, place, strict=True):
                logs[i] = math.log(grids[i][n])
            end = WAYS[way](hunt, logs, free, reach) if free else logs
            done[place] = hunt.merit(end), end
        return done[place][0]

    best_at(here, start)
    while True:
        near = [tuple(n + d for n, d in zip(here, moves, strict=True)) for moves in _moves(len(stepped))]
        near = [p for p in near if all(0 <= n < grids[i].size for i, n in zip(stepped, p, strict=True))]
        best = min(near, key=lambda place: best_at(place, done[here][1]), default=here)
        if best_at(best, start) >= done[here][0]:
            return
        here = best


def _moves(count: int) -> list[tuple[int, ...]]:
    """To all neighbours, those first that differ in one size."""
    moves = [m for m in itertools.product((-1, 0, 1), repeat=count) if any(m)]
    return sorted(moves, key=lambda m: sum(map(abs, m)))
