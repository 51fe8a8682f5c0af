"""How high results ripple around a strip, and where among the ripples a better strip may be.

Undamped ringing makes what the strip's inertia adds to results ripple over a percent of length: of many optima close to
each other a local search finds one. Strips are spread around its end; what a quadratic in the offsets leaves of the
Lagrangian's corrections there is the ripple, and where the whole Lagrangian is less than at the end there may be a
better strip. A few strips show whether there is any ripple.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from solvers.rod import rows
from solvers.rod.optimum.answer.sensitivities import Stationarity
from solvers.rod.optimum.core_optimum import within
from solvers.rod.optimum.full_model import Array, logarithms
from solvers.rod.optimum.local_search import Iterate
from solvers.rod.problem import Bounds
from solvers.rod.scene import Dimensions

if TYPE_CHECKING:
    from solvers.rod.optimum.full_optimum import Context

RIPPLE_RADIUS = 0.01
"""First radius of searches among ripples, in ln b, ln h, ln l."""
_SCANNED = 0.03
"""How far to each side strips are spread, in ln b, ln h, ln l."""
_FEW, _MORE, _PROMISING = (8, 12, 20), 16, 2
"""Strips looked at first, by the number of directions, and further ones where these ripple; searches led on from the
best of them."""
_SMOOTH = 0.3
"""Share of the accuracy: ripples less high are the errors of the corrections."""


class Ripple(NamedTuple):
    """``height`` in ln objective, and the strips from where a search may find a better one."""

    height: float
    promising: list[Dimensions]


def look_around(context: Context, best: Iterate, conditions: Stationarity) -> Ripple:
    """The ripple around an admissible iterate, in the sizes that no bound holds; of height 0 where there is none."""
    free = _free(context.bounds, conditions)
    if not free.size:
        return Ripple(0.0, [])
    model_rows, weights = best.memory.active, conditions.weights
    own = float(weights @ model_rows.corrected_values(best.x))
    added, merits, strips, spread = [], [], [], _spread(free.size)
    few = _FEW[free.size - 1]
    for count in (few, few + _MORE):
        for offset in spread[len(strips) : count]:
            x = best.x.copy()
            x[free] += offset
            strip = within(context.bounds, x)
            plain, more = model_rows.taken_apart(logarithms(strip))
            sound = plain[rows.UTILISATION] != rows.BUCKLED
            added.append(float(weights @ more) if sound else math.nan)
            merits.append(added[-1] + float(weights @ plain) if sound else math.inf)
            strips.append(strip)
        height = _beyond_quadratic(spread[:count], np.array(added))
        if height <= _SMOOTH * context.model.accuracy:
            return Ripple(0.0, [])
    order = [n for n in np.argsort(merits) if merits[n] < own - context.task.enough]
    return Ripple(height, [strips[n] for n in order[:_PROMISING]])


def _free(bounds: Bounds, conditions: Stationarity) -> Array:
    """The indices of the sizes that are free within their bounds."""
    held = {constraint.name.partition("_")[0] for constraint in conditions.active}
    ranges = (bounds.b, bounds.h, bounds.l)
    return np.array(
        [n for n, name in enumerate("bhl") if ranges[n][0] < ranges[n][1] and name not in held], dtype=np.intp
    )


def _spread(directions: int) -> Array:
    """Steps along so many directions, evenly spread within ``_SCANNED`` to each side, shape (64, directions)."""
    from scipy.stats.qmc import Sobol

    return _SCANNED * (2.0 * Sobol(directions, scramble=False).random(64) - 1.0)


def _beyond_quadratic(offsets: Array, values: Array) -> float:
    """The greatest that is left of values when a quadratic in the offsets is taken away; inf if too few are known."""
    sound = np.isfinite(values)
    ones = np.hstack([offsets[sound], np.ones((np.sum(sound), 1))])
    upper = np.triu_indices(ones.shape[1])
    terms = (ones[:, :, None] * ones[:, None, :])[:, *upper]
    if len(terms) <= terms.shape[1]:
        return math.inf
    fitted = terms @ np.linalg.lstsq(terms, values[sound], rcond=None)[0]
    return float(np.max(np.abs(values[sound] - fitted)))
