"""How high results ripple around a strip, and where among the ripples a better strip may be.

Undamped ringing makes results ripple over a percent of length: of many optima close to each other a local search finds
one. Strips spread along the directions that limits leave free are checked and judged by the Lagrangian; what a
quadratic in the offsets leaves of it is the ripple. A few strips show whether there is any.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from solvers.rod.constraints import BY_NAME, CONSTRAINTS
from solvers.rod.optimum.answer.sensitivities import Stationarity
from solvers.rod.optimum.core_optimum import within
from solvers.rod.optimum.full_model import Array
from solvers.rod.optimum.local_search import Iterate
from solvers.rod.scene import Dimensions

if TYPE_CHECKING:
    from solvers.rod.optimum.full_optimum import Context

RIPPLE_RADIUS = 0.01
"""First radius of searches among ripples, in ln b, ln h, ln l."""
_SCANNED = 0.03
"""How far to each side strips are spread, in ln b, ln h, ln l."""
_FEW, _MANY, _PROMISING = 8, 16, 2
"""Strips checked at first, and where these ripple; searches led on from the best of them."""
_SMOOTH, _KNOWN, _COARSEST = 0.3, 0.03, 1e-3
"""Share of the accuracy: ripples less high are the check's own errors; of their height, to which it need be known."""


class Ripple(NamedTuple):
    """``height`` in ln objective, and the strips from where a search may find a better one."""

    height: float
    promising: list[Dimensions]


def look_around(context: Context, best: Iterate, conditions: Stationarity) -> Ripple:
    """The ripple around an admissible iterate; its height is 0 where results are smooth or nothing is free."""
    ways = conditions.tangent
    if not len(ways):
        return Ripple(0.0, [])
    worth = {BY_NAME[a.name].row: abs(a.sensitivity) for a in conditions.active if a.name in BY_NAME}
    found: list[tuple[float, Array, Dimensions]] = []
    accuracy = context.model.accuracy
    for count in (_FEW, _MANY):
        for offset in _spread(len(ways), count):
            strip = within(context.bounds, best.x + offset @ ways)
            found.append((_lagrangian(context, strip, worth, accuracy), offset, strip))
        height = _beyond_quadratic(found)
        if height <= _SMOOTH * accuracy:
            return Ripple(0.0, [])
        accuracy = min(max(accuracy, _KNOWN * height), _COARSEST)
    better = [one for one in found if one[0] < best.log_cost - context.task.enough]
    return Ripple(height, [strip for _, _, strip in sorted(better, key=lambda one: one[0])[:_PROMISING]])


def _spread(directions: int, count: int) -> Array:
    """Steps along so many directions, evenly spread within ``_SCANNED`` to each side, shape (strips, directions)."""
    if directions == 1:
        return _SCANNED * np.linspace(-1.0, 1.0, count)[:, None]
    from scipy.stats.qmc import Sobol

    return _SCANNED * (2.0 * Sobol(directions, scramble=False).random(count) - 1.0)


def _lagrangian(context: Context, d: Dimensions, worth: Mapping[int, float], accuracy: float) -> float:
    """ln objective of a strip by its check, with what its limits are missed by, or left over, at their worth."""
    check, scene = context.model.check(d, accuracy).value, context.model.scene
    if check.stresses is None:
        return math.inf
    limits = context.task.limits
    missed = ((c.row, c.log_value(check, scene) - limits[c.row]) for c in CONSTRAINTS if c.row in worth)
    total = sum(worth[row] * by for row, by in missed if math.isfinite(by))
    return context.task.objective.log_cost(check, scene.material.density) + total


def _beyond_quadratic(found: list[tuple[float, Array, Dimensions]]) -> float:
    """The greatest that is left of the Lagrangian when a quadratic in the offsets is taken away; inf if unknown."""
    sound = [(merit, np.append(offset, 1.0)) for merit, offset, _ in found if math.isfinite(merit)]
    if not sound:
        return math.inf
    merits = np.array([merit for merit, _ in sound])
    terms = np.array([np.outer(v, v)[np.triu_indices(v.size)] for _, v in sound])
    fitted = terms @ np.linalg.lstsq(terms, merits, rcond=None)[0]
    return float(np.max(np.abs(merits - fitted)))
