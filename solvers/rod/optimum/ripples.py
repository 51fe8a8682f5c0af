"""How high results ripple around a strip, and where among the ripples a better strip may be.

Undamped ringing makes what the strip's inertia adds to results ripple over a percent of length: of many optima close to
each other a local search finds one. Strips are spread around its end; what a quadratic in the offsets leaves of the
Lagrangian's corrections there is the ripple, and where the whole Lagrangian is less than at the end there may be a
better strip. A few strips show whether there is any ripple.
"""

from __future__ import annotations

import math
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.rod import rows
from solvers.rod.optimum.answer.sensitivities import Stationarity
from solvers.rod.optimum.core_optimum import within
from solvers.rod.optimum.full_model import Array
from solvers.rod.optimum.full_strip import logarithms
from solvers.rod.optimum.local_search import Iterate, Task
from solvers.rod.problem import Bounds, Objective
from solvers.rod.rows import Layout
from solvers.rod.scene import Dimensions

RIPPLE_RADIUS, FINE_RADIUS = 0.01, 2e-3
"""First radii of searches among ripples, and of the closer one at their end, in ln b, ln h, ln l."""
RIPPLE_ROUNDS = 6
"""Of either: what they would gain after that is less than what ripples leave unknown."""
_SCANNED = 0.03
"""How far to each side strips are spread, in ln b, ln h, ln l."""
_FEW, _MORE, _PROMISING = (8, 12, 20), 16, 1
"""Strips looked at first, by the number of directions, and further ones where these ripple; searches led on from the
best of them."""
_SPIKE = 4.0
"""Times the median of what a fit leaves: values farther above it are no part of another."""
_CLOSER, _NEAREST = 4.0, 1e-3
"""By how much strips are looked at closer where farther ones are too dear; where that ends."""
_UNSEEN = 8.0
"""Times the deepest ripple of those looked at: a rival of hundreds of checks found one 5.6 times as deep."""
_DISTANCES, _SHARE = (2e-4, 4e-4, 8e-4, 1.6e-3, 3.2e-3, 6.4e-3, 0.0128, _SCANNED), 0.5
"""At which strips are looked at around one that limits hold; how much less steep the rise may be farther away."""
_DEARER, _FLAT, _HELD = 2.0, 1e-2, 0.05
"""Times the multipliers, for violations; per ln b, ln h, ln l: a rise that is none; a multiplier that holds no size."""
_SMOOTH = 0.3
"""Share of the accuracy: ripples less high are the errors of the corrections."""


class Ripple(NamedTuple):
    """``height`` in ln objective, and the strips from where a search may find a better one."""

    height: float
    promising: list[Dimensions]


def look_around(task: Task, bounds: Bounds, best: Iterate, conditions: Stationarity) -> Ripple:
    """The ripple around an admissible iterate, in the sizes that no bound holds; of height 0 where there is none."""
    free = free_sizes(bounds, conditions)
    if not free.size:
        return Ripple(0.0, [])
    weights = of_whole_rows(conditions.weights, best.memory.active.layout, task.objective)
    own = float(weights @ best.memory.active.corrected_values(best.x))
    seen, reach = _Seen(bounds, best, weights, free, _SCANNED), _SCANNED
    height = seen.height()
    order = [n for n in np.argsort(seen.merits) if seen.merits[n] < own - task.enough]
    promising = [seen.strips[n] for n in order[:_PROMISING]] if height > 0.0 else []
    while task.enough < height < seen.least_beyond(reach / _CLOSER) - own and reach > _NEAREST:
        # No ripple that high makes up for what strips cost that far away: only those nearer count.
        reach /= _CLOSER
        seen = _Seen(bounds, best, weights, free, reach)
        height = min(height, seen.height())
    return Ripple(height, promising)


class _Seen:
    """Strips spread around an iterate as far as ``reach``: what corrections add to the Lagrangian, and it itself."""

    def __init__(self, bounds: Bounds, best: Iterate, weights: Array, free: Array, reach: float) -> None:
        self.bounds, self.best, self.weights, self.free = bounds, best, weights, free
        self.offsets = _spread(free.size) * reach
        self.added: list[float] = []
        self.merits: list[float] = []
        self.strips: list[Dimensions] = []

    def height(self) -> float:
        """How high results ripple there; a few strips show whether they do."""
        model_rows, few = self.best.memory.active, _FEW[self.free.size - 1]
        for count in (few, few + _MORE):
            for offset in self.offsets[len(self.strips) : count]:
                self._look_at(offset)
            most, depth = _beyond_quadratic(self.offsets[:count], np.array(self.added))
            if most <= _SMOOTH * model_rows.model.accuracy:
                return 0.0
        return _UNSEEN * depth

    def least_beyond(self, distance: float) -> float:
        """The least that the Lagrangian is at the strips farther away than that."""
        far = np.max(np.abs(self.offsets[: len(self.merits)]), axis=1) > distance
        return float(np.min(np.array(self.merits)[far], initial=math.inf))

    def _look_at(self, offset: Array) -> None:
        x = self.best.x.copy()
        x[self.free] += offset
        strip = within(self.bounds, x)
        plain, more = self.best.memory.active.taken_apart(logarithms(strip))
        sound = plain[rows.UTILISATION] != rows.BUCKLED
        self.added.append(float(self.weights @ more) if sound else math.nan)
        self.merits.append(self.added[-1] + float(self.weights @ plain) if sound else math.inf)
        self.strips.append(strip)


def rises_all_around(task: Task, bounds: Bounds, best: Iterate, conditions: Stationarity) -> bool:
    """Whether strips at every distance are dearer than an admissible iterate that limits hold in every direction.

    Cost and, at ``_DEARER`` times what they are worth, violations of the limits that hold it rise in proportion to the
    distance there; at no distance up to ``_SCANNED`` may they rise by less than ``_SHARE`` of the least closer by. So
    a ripple would have to be deeper than what the way to it costs.
    """
    free, model_rows = free_sizes(bounds, conditions, _HELD), best.memory.active
    if len(conditions.tangent) or not free.size:
        return not len(conditions.tangent)
    weights = of_whole_rows(conditions.weights, model_rows.layout, task.objective)
    weighed = [row for row, _ in task.objective.weights]
    worth = weights.copy()
    worth[weighed] = 0.0
    weights -= worth
    at_home = model_rows.corrected_values(best.x)

    def dearer(x: Array) -> float:
        """By how much a strip's cost and violations exceed the iterate's; inf where it buckles."""
        beyond = model_rows.corrected_values(x) - at_home
        if beyond[rows.UTILISATION] + at_home[rows.UTILISATION] == rows.BUCKLED:
            return math.inf
        return float(weights @ beyond + _DEARER * worth @ np.maximum(beyond, 0.0))

    least, close_by = _FLAT, []
    for distance in _DISTANCES:
        for way in _ways(free.size):
            x = best.x.copy()
            x[free] += distance * way
            x = logarithms(within(bounds, x))
            away = float(np.max(np.abs(x - best.x)))
            if away < 0.3 * distance:
                continue
            steep = dearer(x) / away
            if steep < least:
                return False
            close_by.append(steep)
        least = max(_FLAT, _SHARE * min(close_by, default=math.inf))
    return True


def of_whole_rows(weights: Array, layout: Layout, objective: Objective) -> Array:
    """The Lagrangian's weights with those of parts given to the greatest of them: far from home, others govern."""
    out = weights.copy()
    for row in (rows.UTILISATION, rows.STRESS, rows.SIDE, rows.PRESSURE):
        parts = layout.parts(row)
        if len(parts) > 1:
            out[row] += np.sum(weights[parts])
            out[parts] = 0.0
    for row, weight in objective.weights:
        out[row] = weight
    return out


def free_sizes(bounds: Bounds, conditions: Stationarity, least: float = 0.0) -> Array:
    """The indices of the sizes that are free within their bounds, or held there by less than ``least``."""
    ends = ("_lower", "_upper")
    held = {
        c.name.partition("_")[0] for c in conditions.active if c.name.endswith(ends) and abs(c.sensitivity) >= least
    }
    ranges = (bounds.b, bounds.h, bounds.l)
    return np.array(
        [n for n, name in enumerate("bhl") if ranges[n][0] < ranges[n][1] and name not in held], dtype=np.intp
    )


def _ways(directions: int) -> Array:
    """To all sides, to the corners of a cube and, between, to the middles of its faces; the greatest entry is 1."""
    ways = np.array(list(product((-1.0, 0.0, 1.0), repeat=directions)))
    entries = np.abs(ways).sum(axis=1)
    return ways[(entries == 1) | (entries == directions)]


def _spread(directions: int) -> Array:
    """Steps along so many directions, evenly spread within 1 to each side, shape (64, directions)."""
    from scipy.stats.qmc import Sobol

    return 2.0 * Sobol(directions, scramble=False).random(64) - 1.0


def _beyond_quadratic(offsets: Array, values: Array) -> tuple[float, float]:
    """The greatest by which values differ from a quadratic in the offsets, and by which they lie below one that does
    not bend to values far above it, as beside a resonance; inf if too few are known."""
    ones = np.hstack([offsets, np.ones((len(offsets), 1))])
    upper = np.triu_indices(ones.shape[1])
    terms, known = (ones[:, :, None] * ones[:, None, :])[:, *upper], np.isfinite(values)

    def beyond(fitted: NDArray[np.bool_]) -> Array:
        return (values - terms @ np.linalg.lstsq(terms[fitted], values[fitted], rcond=None)[0])[known]

    if np.sum(known) <= terms.shape[1]:
        return math.inf, math.inf
    left = beyond(known)
    near = known.copy()
    near[known] = left < _SPIKE * np.median(np.abs(left))
    if np.sum(near) <= terms.shape[1]:
        near = known
    return float(np.max(np.abs(left))), float(np.max(-beyond(near)))
