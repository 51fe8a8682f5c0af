"""Start points in other gaps between damped resonances, where better strips may lie.

A strip's first mode is resonant at an integer frequency ratio Omega (``frequency_ratio``). Vibration raises the cost of
strips close to a resonance; damping rounds the peaks of cost, over a share of about the loss factor in Omega. Local
optima similar to a strip therefore lie in other gaps.

The minimum cost of strips of a given Omega is followed over gaps in steps that resolve them. On the path the
contribution of the corrections to the rows is that at its origin, with its derivatives at constant Omega; at each of
its strips corrections are then solved, and the cost of meeting the limits at the same Omega is that of a linear
programme (``at_ratio``). That cost is rough, and a gap may contain several minima: every point of the path that costs
less than the best strip is a possible start, and every minimum of the path that costs about as much, the cheapest
first, away from starts and results of earlier searches. Along a ridge of nearly equal cost strips of the same Omega may
be far from each other: a result about as good as the best, but elsewhere, starts a path of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from solvers.numerics.arrays import Array
from solvers.rod import rows
from solvers.rod.optimum.full_model.frequency_ratio import log_frequency_ratio, log_frequency_ratio_gradient
from solvers.rod.optimum.full_model.model import FullRows
from solvers.rod.optimum.full_model.strip import dimensions_of, logarithms
from solvers.rod.optimum.search.at_ratio import PENALTY, AtRatio
from solvers.rod.optimum.search.local_search import Iterate, Task
from solvers.rod.optimum.sqp import program
from solvers.rod.problem import Bounds
from solvers.rod.scene import Dimensions

MIN_DISTANCE = 0.15
"""Minimum distance in Omega of a start from the starts and results of earlier searches, with continuous sizes."""
_GAPS, _STEPS = 2, 6
"""Number of gaps followed to each side, and of steps per gap."""
_MAX_PATH_DISTANCE, _MAX_RESTORATION = 0.2, 0.05
"""Maximum distances in ln b, ln h, ln l: of a path from its origin, and of a strip that meets the limits from the path.
"""
_SAME_BRANCH = 0.03
"""Distance in ln b, ln h, ln l beyond which strips of the same Omega belong to different paths."""
_MAX_TANGENT_RATE = 2.0
"""Maximum change of ln b, ln h, ln l at constant Omega per unit change of ln Omega."""
MAX_EXTRA_COST, _ABANDON_COST = 0.015, 0.1
"""Excess in ln objective over the best strip above which a strip is no start; and above which, over a whole gap, a path
is abandoned."""
_RIDGE = 1e-3
"""Rise in ln objective from the origin of a path to its first point that may hide a ridge between them."""
_MIN_STEP_SHARE = 0.3
"""Share of a step in ln Omega; if less is achieved, sizes have reached their bounds."""


class PathPoint(NamedTuple):
    """A strip x on the path at Omega = ``ratio``, the strip ``restored`` to the limits at that ratio, to first order,
    its ln objective with a penalty for the remaining violation, and whether none of its neighbours on the path costs
    less."""

    ratio: float
    x: Array
    restored: Array
    cost: float
    is_minimum: bool = True

    def possible_gain(self, best_cost: float) -> float:
        """The gain over the best strip's ln objective that a search from here may bring, if positive: the point costs
        less, or about as much at a minimum of its path. From the slope between two minima a search leads to one of
        these."""
        return best_cost - self.cost + (MAX_EXTRA_COST if self.is_minimum else 0.0)


@dataclass
class Gaps:
    """Possible starts of searches in other gaps.

    min_distance    minimum distance of a start from all tried ratios, in Omega
    candidates      points that have not been tried
    tried_ratios    Omega of the starts and results of searches
    path_points     Omega and x of all points of the paths
    origins         iterates through which paths have been followed
    """

    task: Task
    bounds: Bounds
    min_distance: float = MIN_DISTANCE
    candidates: list[PathPoint] = field(default_factory=list)
    tried_ratios: list[float] = field(default_factory=list)
    path_points: list[tuple[float, Array]] = field(default_factory=list)
    origins: list[Iterate] = field(default_factory=list)

    @property
    def range(self) -> tuple[float, float] | None:
        """Minimum and maximum Omega of the paths and searches; None without any."""
        ratios = [*self.tried_ratios, *(ratio for ratio, _ in self.path_points)]
        return (min(ratios), max(ratios)) if ratios else None

    def next_start(self, best: Iterate, is_untried: Callable[[Dimensions], bool]) -> Dimensions | None:
        """The most promising start in another gap; None if there is none."""
        if all(best is not origin for origin in self.origins):
            self.exclude(best)
            self._add_path(best)
        self.candidates = [p for p in self.candidates if self._is_away(p.ratio)]
        while promising := [p for p in self.candidates if p.possible_gain(best.log_cost) > self.task.negligible_gain]:
            point = min(promising, key=lambda point: point.cost)
            # By identity, since arrays have no equality.
            self.candidates = [p for p in self.candidates if p is not point]
            for x in self._start_points(best, point):
                d = dimensions_of(x, best.rows.model.scene)
                if is_untried(d):
                    self.tried_ratios.append(point.ratio)
                    return d
        return None

    def remaining_gain(self, best: Iterate) -> float:
        """The gain over the best strip that searches from the candidates left may bring."""
        gains = (p.possible_gain(best.log_cost) for p in self.candidates if self._is_away(p.ratio))
        return max(0.0, max(gains, default=0.0))

    def add_path(self, strip: Iterate) -> None:
        """Follow the path through a strip about as good as the best, unless one passes near it."""
        if all(np.max(np.abs(strip.x - origin.x)) > _SAME_BRANCH for origin in self.origins):
            self._add_path(strip)

    def exclude(self, iterate: Iterate) -> None:
        """Exclude starts near the result of a search."""
        self.tried_ratios.append(math.exp(log_frequency_ratio(iterate.rows.base_cycle)))

    def _add_path(self, strip: Iterate) -> None:
        self.origins.append(strip)
        for direction in (-1.0, 1.0):
            self.candidates += with_minima(self._path(strip, direction), strip.log_cost)

    def _start_points(self, best: Iterate, point: PathPoint) -> list[Array]:
        """The strip on the path, the one restored to the limits, and the one restored by the model at its own peaks and
        corrections, the best first."""
        previous = best.rows
        d = dimensions_of(point.x, previous.model.scene)
        active = previous.model.rows_near(previous.model.peaks(d).merged_with(previous.peaks), d)
        p = program(self.task.problem.objective, best.limits, active.layout, self.task.margin)
        x = logarithms(d)
        values, jacobian = active.corrected_values(x), active.uncorrected_jacobian(x)
        restored = self._at_ratio(best, active)(values, jacobian, x, 0.0, _MAX_RESTORATION)[0]

        def merit(x: Array) -> float:
            values = active.corrected_values(x)
            return p.cost(values) + PENALTY * max(p.violation(values), 0.0)

        return sorted((point.x, point.restored, restored), key=merit)

    def _is_away(self, ratio: float) -> bool:
        """Whether no search has started or ended near an Omega."""
        return all(abs(ratio - tried) > self.min_distance for tried in self.tried_ratios)

    def _is_new(self, ratio: float, x: Array) -> bool:
        """Whether the cost of strips near x at an Omega is unknown and required."""
        branch = (other_ratio for other_ratio, other in self.path_points if np.max(np.abs(x - other)) < _SAME_BRANCH)
        return self._is_away(ratio) and all(abs(ratio - other_ratio) > 0.5 / _STEPS for other_ratio in branch)

    def _path(self, best: Iterate, direction: float) -> list[PathPoint]:
        """The cheapest strips of increasing (``direction`` 1) or decreasing Omega at ratios not followed before."""
        active, x, out = best.rows, best.x, []
        ratio = log_frequency_ratio(active.base_cycle)
        last_ratio, step = ratio + direction * _GAPS * math.exp(-ratio), direction * math.exp(-ratio) / _STEPS
        least_cost = self._at_ratio(best, active)
        if least_cost is None:
            return out
        uncorrected, slopes = active.uncorrected_values(x), active.jacobian_at_ratio(x)
        corrections = active.values(x) - uncorrected
        while direction * (last_ratio - ratio) > 0.0:
            previous, radius = ratio, _MAX_TANGENT_RATE * abs(step)
            x = least_cost(uncorrected + corrections, slopes, x, step, radius)[0]
            strip = active.model.strip(dimensions_of(x, active.model.scene), corrected=False)
            ratio = log_frequency_ratio(strip.cycle)
            blocked = direction * (ratio - previous) < _MIN_STEP_SHARE * abs(step)
            if blocked or np.max(np.abs(x - best.x)) > _MAX_PATH_DISTANCE:
                return out
            uncorrected, slopes = active.uncorrected_values(x), active.jacobian_at_ratio(x)
            if not self._is_new(math.exp(ratio), x):
                continue
            self.path_points.append((math.exp(ratio), x))
            values = active.corrected_values(x)
            if rows.BUCKLED in (uncorrected[rows.UTILISATION], values[rows.UTILISATION]):
                return out
            out.append(PathPoint(math.exp(ratio), x, *least_cost(values, slopes, x, 0.0, _MAX_RESTORATION)))
            if len(out) >= _STEPS and min(point.cost for point in out[-_STEPS:]) > best.log_cost + _ABANDON_COST:
                return out
        return out

    def _at_ratio(self, best: Iterate, active: FullRows) -> AtRatio | None:
        """The linear programme for rows, with limits shifted to the best strip's exact check."""
        p = program(self.task.problem.objective, best.limits, active.layout, self.task.margin)
        box = self.bounds.logarithms
        return AtRatio.of(p, box, log_frequency_ratio_gradient(active.base_cycle))


def with_minima(path: list[PathPoint], origin_cost: float) -> list[PathPoint]:
    """The points of a path from a strip of cost ``origin_cost``, its minima marked."""
    if not path:
        return path
    # Behind a steep rise the first point may lie in another valley than the origin, which costs less in any case.
    before_first = origin_cost if path[0].cost < origin_cost + _RIDGE else math.inf
    costs = [before_first, *(point.cost for point in path), math.inf]
    return [point._replace(is_minimum=point.cost <= min(costs[i], costs[i + 2])) for i, point in enumerate(path)]
