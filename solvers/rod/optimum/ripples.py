"""How high results ripple around a strip, and where among the ripples a better strip may be.

Undamped ringing makes what the strip's inertia adds to results ripple over a percent of length: of many optima close to
each other a local search finds one. Strips are spread around its end; what a quadratic in the offsets leaves of the
Lagrangian's corrections there is the ripple, and where the whole Lagrangian is less than at the end there may be a
better strip. A few strips show whether there is any ripple.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.rod import rows
from solvers.rod.optimum.answer.sensitivities import Stationarity
from solvers.rod.optimum.core_optimum import within
from solvers.rod.optimum.full_model import Array, logarithms
from solvers.rod.optimum.local_search import Iterate, Task
from solvers.rod.problem import Bounds, Objective
from solvers.rod.rows import Layout
from solvers.rod.scene import Dimensions

RIPPLE_RADIUS = 0.01
"""First radius of searches among ripples, in ln b, ln h, ln l."""
_SCANNED = 0.03
"""How far to each side strips are spread, in ln b, ln h, ln l."""
_FEW, _MORE, _PROMISING = (8, 12, 20), 16, 1
"""Strips looked at first, by the number of directions, and further ones where these ripple; searches led on from the
best of them."""
_SPIKE = 4.0
"""Times the median of what a fit leaves: values farther above it are no part of another."""
_UNSEEN = 8.0
"""Times the deepest ripple of those looked at: a rival of hundreds of checks found one 5.6 times as deep."""
_SMOOTH = 0.3
"""Share of the accuracy: ripples less high are the errors of the corrections."""


class Ripple(NamedTuple):
    """``height`` in ln objective, and the strips from where a search may find a better one."""

    height: float
    promising: list[Dimensions]


def look_around(task: Task, bounds: Bounds, best: Iterate, conditions: Stationarity) -> Ripple:
    """The ripple around an admissible iterate, in the sizes that no bound holds; of height 0 where there is none."""
    free = _free(bounds, conditions)
    if not free.size:
        return Ripple(0.0, [])
    model_rows = best.memory.active
    weights = _of_whole_rows(conditions.weights, model_rows.layout, task.objective)
    own = float(weights @ model_rows.corrected_values(best.x))
    added, merits, strips, spread = [], [], [], _spread(free.size)
    few = _FEW[free.size - 1]
    for count in (few, few + _MORE):
        for offset in spread[len(strips) : count]:
            x = best.x.copy()
            x[free] += offset
            strip = within(bounds, x)
            plain, more = model_rows.taken_apart(logarithms(strip))
            sound = plain[rows.UTILISATION] != rows.BUCKLED
            added.append(float(weights @ more) if sound else math.nan)
            merits.append(added[-1] + float(weights @ plain) if sound else math.inf)
            strips.append(strip)
        most, depth = _beyond_quadratic(spread[:count], np.array(added))
        if most <= _SMOOTH * model_rows.model.accuracy:
            return Ripple(0.0, [])
    order = [n for n in np.argsort(merits) if merits[n] < own - task.enough]
    return Ripple(_UNSEEN * depth, [strips[n] for n in order[:_PROMISING]])


def _of_whole_rows(weights: Array, layout: Layout, objective: Objective) -> Array:
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


def _free(bounds: Bounds, conditions: Stationarity) -> Array:
    """The indices of the sizes that are free within their bounds."""
    held = {c.name.partition("_")[0] for c in conditions.active if c.name.endswith(("_lower", "_upper"))}
    ranges = (bounds.b, bounds.h, bounds.l)
    return np.array(
        [n for n, name in enumerate("bhl") if ranges[n][0] < ranges[n][1] and name not in held], dtype=np.intp
    )


def _spread(directions: int) -> Array:
    """Steps along so many directions, evenly spread within ``_SCANNED`` to each side, shape (64, directions)."""
    from scipy.stats.qmc import Sobol

    return _SCANNED * (2.0 * Sobol(directions, scramble=False).random(64) - 1.0)


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
