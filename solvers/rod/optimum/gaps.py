"""Where damped resonances part strips from others that may be better: the gaps between them on both sides.

The strip's first mode is at a resonance wherever a harmonic of the speed meets it, at whole Omega = omega_1/omega. A
strip on the way from one gap to the next is dearer by what rings, and damping rounds what is between: a share of about
the loss factor of Omega. So optima close to a strip lie in other gaps.

The least cost of strips of a given Omega is followed over gaps, in steps that resolve them. The path is that of strips
whose limits corrections add as much to as where it begins; of each strip on it corrections are solved, and the cost of
holding the limits at the same Omega is that of a linear programme. Valleys of that cost are starts of searches.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from solvers.rod import rows
from solvers.rod.optimum.corrections import log_frequency_ratio
from solvers.rod.optimum.full_model import Array
from solvers.rod.optimum.full_strip import dimensions_of, logarithms
from solvers.rod.optimum.local_search import PENALTY, Iterate, Task
from solvers.rod.optimum.sqp import Program, program
from solvers.rod.problem import Bounds
from solvers.rod.scene import Dimensions

_GAPS, _STEPS = 2, 6
"""So many gaps are looked at to each side, in so many steps each."""
_FARTHEST, _NEAREST = 0.2, 0.05
"""In ln b, ln h, ln l: of a path, and of the strip that holds its limits from the one on the path."""
_DEARER = 0.01
"""Valleys dearer than the best strip by more than that, in ln objective, are no starts."""
_LOST = 0.1
"""A path is not followed where a whole gap is dearer by more than that."""
_PACE = 2.0
_UNSTEADY = 2e-3
_GRID, _ZOOMS = np.linspace(-1.0, 1.0, 17), 5
"""Of the plane in which a linear programme is solved; closer about the least, so many times."""
_CLOSER, _WALL = 0.2, 1e3


class Place(NamedTuple):
    """A strip of a certain ln Omega, and the ln objective at which it holds its limits; what it misses them by counts
    as much as in a search."""

    ratio: float
    x: Array
    cost: float


@dataclass
class Gaps:
    """The least cost over ln Omega as far as it has been followed, from ``low`` to ``high``."""

    task: Task
    bounds: Bounds
    low: float = math.inf
    high: float = -math.inf
    waiting: list[Place] = field(default_factory=list)
    """Valleys from where no search has begun."""

    def next(self, best: Iterate) -> Dimensions | None:
        """The most promising strip of another gap, from where a search may find a better one; None without any."""
        ratio = log_frequency_ratio(best.memory.active.home_cycle)[0]
        self.low, self.high = min(self.low, ratio), max(self.high, ratio)
        near = _GAPS * math.exp(-ratio)
        if ratio - self.low < 0.5 * near:
            self._follow(best, -1.0, ratio - near)
        if self.high - ratio < 0.5 * near:
            self._follow(best, 1.0, ratio + near)
        self.waiting = [place for place in self.waiting if place.cost < best.log_cost + _DEARER]
        if not self.waiting:
            return None
        place = min(self.waiting, key=lambda place: place.cost)
        self.waiting.remove(place)
        return dimensions_of(place.x, best.memory.active.model.scene)

    def _follow(self, best: Iterate, side: float, until: float) -> None:
        """Follow the least cost from the best strip on, up (``side`` 1) or down, and note its valleys."""
        path, end = _path(self, best, side, until)
        costs = np.array([best.log_cost] + [place.cost for place in path] + [math.inf])
        for n, place in enumerate(path, start=1):
            parted = float(np.max(costs[: n + 1])) > max(costs[0], place.cost)
            better = place.cost < costs[0] - self.task.enough
            if place.cost <= min(costs[n - 1], costs[n + 1]) and (parted or better):
                self.waiting.append(_seen(self, best, place))
        self.low, self.high = (self.low, end) if side > 0.0 else (end, self.high)


def _seen(gaps: Gaps, best: Iterate, place: Place) -> Place:
    """The same where the strip's own peaks are looked at, and its corrections where the linear programme led to."""
    before = best.memory.active
    model, box = before.model, np.log([gaps.bounds.b, gaps.bounds.h, gaps.bounds.l])
    d = dimensions_of(np.clip(place.x, box[:, 0], box[:, 1]), model.scene)
    x = logarithms(d)
    if rows.BUCKLED in (before.plain_values(x)[rows.UTILISATION], before.corrected_values(x)[rows.UTILISATION]):
        return place
    active = model.following(model.peaks(d).joined(before.peaks), d)
    p = program(gaps.task.objective, best.limits, active.layout, gaps.task.guard)
    plane = Plane.across(log_frequency_ratio(active.home_cycle)[1], box[:, 1] > box[:, 0])
    values = active.corrected_values(x)
    return Place(place.ratio, *plane.least(p, values, active.plain_slopes(x), x, box, 0.0, _NEAREST))


def _path(gaps: Gaps, best: Iterate, side: float, until: float) -> tuple[list[Place], float]:
    """The cheapest strips of rising or falling ln Omega that have not been looked at, and how far it leads: to
    infinity where no strip is left."""
    active = best.memory.active
    box = np.log([gaps.bounds.b, gaps.bounds.h, gaps.bounds.l])
    p = program(gaps.task.objective, best.limits, active.layout, gaps.task.guard)
    ratio, frequency = log_frequency_ratio(active.home_cycle)
    plane = Plane.across(frequency, box[:, 1] > box[:, 0])
    step, x, out = side * math.exp(-ratio) / _STEPS, best.x, []
    plain, added = active.taken_apart(x)
    nowhere = side * math.inf
    if plane is None:
        return [], nowhere
    slopes_of = active.plain_slopes
    slopes = slopes_of(x)
    if plane.least(p, plain + added, slopes, x, box, 0.0, _NEAREST)[1] < best.log_cost - _UNSTEADY:
        # The strip would not be the cheapest of its Omega.
        slopes_of = active.slopes_at_ratio
        slopes = slopes_of(x)
    while side * (until - ratio) > 0.0:
        # One step along the strips whose limits corrections add as much to as at the beginning.
        x, _ = plane.least(p, plain + added, slopes, x, box, step, _PACE * abs(step))
        x, before = np.clip(x, box[:, 0], box[:, 1]), ratio
        ratio = log_frequency_ratio(active.model.strip(dimensions_of(x, active.model.scene), corrected=False).cycle)[0]
        if side * (ratio - before) < 0.3 * abs(step) or np.max(np.abs(x - best.x)) > _FARTHEST:
            return out, nowhere
        if gaps.low < ratio < gaps.high:
            plain, slopes = active.plain_values(x), slopes_of(x)
            continue
        plain, more = active.taken_apart(x)
        if rows.BUCKLED in (plain[rows.UTILISATION], (plain + more)[rows.UTILISATION]):
            return out, nowhere
        slopes = slopes_of(x)
        out.append(Place(ratio, *plane.least(p, plain + more, slopes, x, box, 0.0, _NEAREST)))
        if len(out) >= _STEPS and min(place.cost for place in out[-_STEPS:]) > best.log_cost + _LOST:
            return out, nowhere
    return out, ratio


@dataclass(frozen=True)
class Plane:
    """Where ln Omega changes by a given amount, to first order: ``up`` (3,) for a unit of change, and directions within,
    (up to 2, 3)."""

    up: Array
    within: Array

    @staticmethod
    def across(frequency: Array, free: Array) -> Plane | None:
        """Of the slope of ln Omega and of the sizes that may change; None where none of them changes it."""
        slope = np.where(free, frequency, 0.0)
        size = float(np.linalg.norm(slope))
        if size == 0.0:
            return None
        axes = np.eye(3)[free]
        others = axes - np.outer(axes @ slope, slope) / size**2
        _, lengths, directions = np.linalg.svd(others)
        return Plane(slope / size**2, directions[: np.count_nonzero(lengths > 1e-9)])

    def least(
        self, p: Program, here: Array, slopes: Array, x: Array, box: Array, change: float, reach: float
    ) -> tuple[Array, float]:
        """The least of p's cost with a penalty, at rows linear about x, for a change of ln Omega: where, and that cost.

        It is convex in at most two variables: a grid closes in on it.
        """
        start = x + change * self.up
        centre, wide = np.zeros(len(self.within)), reach
        for _ in range(_ZOOMS):
            grid = np.stack(np.meshgrid(*[wide * _GRID] * centre.size, indexing="ij"), axis=-1).reshape(-1, centre.size)
            at = start + (centre + grid) @ self.within
            costs = _costs(p, here, slopes, at - x) + _WALL * _outside(at, box)
            n = int(np.argmin(costs))
            centre, wide = centre + grid[n], _CLOSER * wide
        return at[n], float(costs[n])


def _costs(p: Program, here: Array, slopes: Array, moved: Array) -> Array:
    """p's cost with the penalty of its violation, for steps (count, 3)."""
    cost = sum((weight * (here[row] + moved @ slopes[row]) for row, weight in p.linear), np.zeros(len(moved)))
    if p.top.size:
        cost = cost + p.top_weight * np.max(here[p.top] - p.offset + moved @ slopes[p.top].T, axis=1)
    if p.which.size:
        cost = cost + PENALTY * np.maximum(np.max(here[p.which] - p.limit + moved @ slopes[p.which].T, axis=1), 0.0)
    return cost


def _outside(at: Array, box: Array) -> Array:
    """The greatest distance from a box, (count,)."""
    return np.maximum(np.max(np.maximum(box[:, 0] - at, at - box[:, 1]), axis=1), 0.0)
