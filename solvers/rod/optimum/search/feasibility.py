"""Strips that violate the requirements least, where none is known that meets them all."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from solvers.rod import rows
from solvers.rod.constraints import Limits
from solvers.rod.optimum.core.cycle import CoreCycle
from solvers.rod.optimum.core.optimum import dimensions_within
from solvers.rod.optimum.full_model.strip import logarithms
from solvers.rod.optimum.peaks import RequiredResults
from solvers.rod.optimum.search.full_optimum import Context
from solvers.rod.optimum.search.local_search import Iterate, Local, excess_of
from solvers.rod.optimum.sqp import MemoisedRows, feasibility_program, required_results, run_slsqp
from solvers.rod.problem import OBJECTIVES, Bounds
from solvers.rod.scene import Dimensions

_SPREAD = np.array([[0.5, 0.5, 0.5], [0.75, 0.25, 0.25], [0.25, 0.75, 0.75]])
"""Starts on the core beside the stoutest strip, as fractions of the bounds' logarithms: I. M. Sobol's sequence."""
_ROUNDS, _ITERATIONS, _TOLERANCE = 4, 30, 1e-3
_AGREE = 1e-2
"""Two searches have ended at the same excess."""
_CLOSE = 10.0
"""Of the accuracy of rough searches: an excess below that may be none."""


def least_violation(cycle: CoreCycle, limits: Limits, bounds: Bounds) -> tuple[float, Dimensions] | None:
    """The least excess found by which the core misses every limit at once, in logarithms, and the strip that does.

    Local searches, stability never beyond buckling, from the stoutest strip and from strips spread over the bounds,
    until two of them agree. None where every strip tried buckles.
    """
    best: tuple[float, Dimensions] | None = None
    for start in _starts(cycle, limits, bounds):
        one = _least_from(cycle, limits, bounds, start)
        if one is None:
            continue
        if best is not None and abs(one[0] - best[0]) < _AGREE:
            return min(one, best, key=lambda one: one[0])
        best = one if best is None else min(one, best, key=lambda one: one[0])
    return best


def _starts(cycle: CoreCycle, limits: Limits, bounds: Bounds) -> Iterator[Dimensions]:
    yield bounds.stiffest
    yield from _spread(cycle, limits, bounds)


def _least_from(cycle: CoreCycle, limits: Limits, bounds: Bounds, start: Dimensions) -> tuple[float, Dimensions] | None:
    """The end of one local search: its peaks are looked for anew at every end, until it stays."""
    wanted, box, strip = required_results(OBJECTIVES["mass"], limits), np.log([bounds.b, bounds.h, bounds.l]), start
    peaks, best = cycle.peaks(strip, wanted), None
    for _ in range(_ROUNDS):
        memory, x = MemoisedRows(cycle.rows_near(peaks, wanted)), logarithms(strip)
        p = feasibility_program(limits, memory.active.layout)
        if memory.values(x)[rows.STABILITY] >= 0.0:
            break
        own = p.cost(memory.values(x))
        if best is None or own < best[0]:
            best = own, strip
        step = run_slsqp(memory, p, box, x, _TOLERANCE, _ITERATIONS)
        if not step.cost < best[0] - _TOLERANCE:
            break
        strip = dimensions_within(bounds, step.x)
        peaks = cycle.peaks(strip, wanted).merged_with(peaks)
    return best


def least_violating(context: Context, start: Dimensions, hopeless: bool = False) -> Local | None:
    """The end of a local search for an admissible strip on the full model, from ``start``.

    The best admissible one of all searches, or the least violating; None where every strip tried buckles. Where it is
    ``hopeless``, ``start`` is checked and nothing else. Where a table's points set the strip ringing all but the end is
    done roughly.
    """
    if hopeless:
        at = checked_only(context, start)
        return None if at is None else Local(at, math.inf, 0)
    if not context.model.textured:
        context.search_from(start, context.bounds)
        return context.best()
    rough = context.rough or context.explored(start)
    if not rough.ends:
        rough.search_from(start, context.bounds)
    best = rough.best()
    if best is None or best.found is not None:
        return best
    strip = best.best.outcome.value.dimensions
    if best.best.excess < _CLOSE * rough.model.accuracy:
        return context.search_from(strip, context.bounds)
    at = checked_only(context, strip)
    return best if at is None else Local(at, math.inf, best.rounds)


def checked_only(context: Context, strip: Dimensions) -> Iterate | None:
    """A strip with its check and no model around it; None if it buckles."""
    outcome, task, scene = context.model.check(strip), context.task, context.model.scene
    if outcome.value.stresses is None:
        return None
    cost = task.objective.log_cost(outcome.value, scene.material.density)
    return Iterate(logarithms(strip), outcome, cost, excess_of(task, outcome.value, scene), None, task.limits)


def _spread(cycle: CoreCycle, limits: Limits, bounds: Bounds) -> Iterator[Dimensions]:
    """Strips spread evenly over the bounds, the thickness such that they stand on the core."""
    nothing = RequiredResults(False, False, False)
    low, high = np.log([bounds.b, bounds.h, bounds.l]).T
    for x in low + (high - low) * _SPREAD:
        strip = Dimensions(*np.exp(x).tolist())
        core = cycle.rows_near(cycle.peaks(strip, nothing), nothing)
        missing = core.values(logarithms(strip))[rows.STABILITY] - limits[rows.STABILITY]
        thicker = min(strip.h * math.exp(max(missing, 0.0) / 3.0) * 1.01, bounds.h[1])
        yield Dimensions(strip.b, thicker, strip.l)
