"""Where damped resonances part strips from others that may be better: the gaps between them on both sides.

The strip's first mode is at a resonance wherever a harmonic of the speed meets it, at whole Omega = omega_1/omega. A
strip on the way from one gap to the next is dearer by what rings, and damping rounds what is between: a share of about
the loss factor of Omega. So optima close to a strip lie in other gaps. The Lagrangian is looked at along the way on
which Omega changes with least cost, in steps that resolve the gaps, and its valleys beyond the resonances are starts.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.rod import rows
from solvers.rod.optimum.answer.sensitivities import Stationarity
from solvers.rod.optimum.core_optimum import within
from solvers.rod.optimum.corrections import log_frequency_ratio
from solvers.rod.optimum.full_model import Array
from solvers.rod.optimum.local_search import PENALTY, Iterate, Task
from solvers.rod.optimum.ripples import of_whole_rows
from solvers.rod.problem import Bounds
from solvers.rod.scene import Dimensions

_GAPS, _STEPS = 2, 6
"""So many gaps are looked at to each side, in so many steps each."""
_FARTHEST = 0.2
"""In ln b, ln h, ln l."""
_STARTS, _DEARER = 2, 0.01
"""So many valleys are starts, if they are dearer than the strip by no more than that, in ln objective."""
_STEEPEST = 1e3
"""Where strips buckle, in ln objective."""
_STEEP = 0.05
"""Change of ln Omega per unit of the way, under which there are no gaps on it."""


def other_gaps(task: Task, bounds: Bounds, best: Iterate, conditions: Stationarity) -> list[Dimensions]:
    """Strips in other gaps from where a search may find a better one, the most promising first."""
    weights = of_whole_rows(conditions.weights, best.memory.active.layout, task.objective)
    ways, pace = _ways(bounds, best, conditions)
    found = [one for way in ways for one in _valleys(task, bounds, best, weights, way, pace)]
    return [strip for _, strip in sorted(found, key=lambda one: one[0])[:_STARTS]]


def _valleys(
    task: Task, bounds: Bounds, best: Iterate, weights: Array, way: Array, pace: float
) -> list[tuple[float, Dimensions]]:
    """The Lagrangian's valleys along a way that lie beyond a resonance or deeper than the strip's own, by how much
    dearer they are."""
    places = np.arange(-_GAPS * _STEPS, _GAPS * _STEPS + 1) / (_STEPS * pace)
    strips, home, own = [], 0, float(weights @ best.memory.active.corrected_values(best.x))
    for place in places:
        strip = within(bounds, best.x + place * way)
        if np.max(np.abs(place * way)) < _FARTHEST and (not strips or strip != strips[-1]):
            home = len(strips) if place <= 0.0 else home
            strips.append(strip)
    merits = np.minimum([_merit(task, best, weights, strip) - own for strip in strips], _STEEPEST)
    around = np.concatenate([[math.inf], merits, [math.inf]])
    valleys = [n for n in range(merits.size) if merits[n] <= min(around[n], around[n + 2]) and merits[n] < _DEARER]
    # What parts a strip from a better one may be narrower than the steps.
    apart = [n for n in valleys if n != home and (merits[n] < -task.enough or _barrier(merits, n, home) > 0.0)]
    return [(merits[n], strips[n]) for n in apart]


def _barrier(merits: Array, n: int, home: int) -> float:
    """By how much the greatest on the way lies above both ends."""
    low, high = sorted((n, home))
    return float(np.max(merits[low : high + 1]) - max(merits[n], merits[home]))


def _merit(task: Task, best: Iterate, weights: Array, strip: Dimensions) -> float:
    """The Lagrangian, and what limits that do not hold the best strip are missed by."""
    values = best.memory.active.corrected_values(np.log([strip.b, strip.h, strip.l]))
    if values[rows.UTILISATION] == rows.BUCKLED:
        return math.inf
    idle = [row for row in best.limits if weights[row] == 0.0]
    missed = sum(max(values[row] - best.limits[row], 0.0) for row in idle)
    return float(weights @ values) + PENALTY * missed


def _ways(bounds: Bounds, best: Iterate, conditions: Stationarity) -> tuple[list[Array], float]:
    """Steps in ln(b, h, l) per ln Omega, and Omega: along what limits leave free; where that is more than one
    direction, or none, thickness and length each by itself."""
    here, slope = log_frequency_ratio(best.memory.active.home_cycle)
    tangent, ranges = conditions.tangent, (bounds.b, bounds.h, bounds.l)
    free = [np.eye(3)[v] for v in (1, 2) if ranges[v][0] < ranges[v][1]]
    units = [tangent[0]] if len(tangent) == 1 else free
    return [unit / (unit @ slope) for unit in units if abs(unit @ slope) > _STEEP], math.exp(here)
