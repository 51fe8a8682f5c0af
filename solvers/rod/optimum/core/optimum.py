"""From a good strip to the best one nearby, on the core's physics.

After each run of the optimizer the governing angles and sections are looked for again and join the earlier ones, until
the strip stays where it is: an exchange as E. Remez's (1934), which cannot go round in circles between strips whose
worst sections are each other's harmless ones. What a strip is said to cost, it costs at its own worst sections.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from solvers.rod.constraints import Limits
from solvers.rod.optimum.core.cycle import CoreCycle, CoreRows
from solvers.rod.optimum.peaks import Peaks
from solvers.rod.optimum.sqp import Memory, program, restored, run, wanted_of
from solvers.rod.problem import Bounds, Objective
from solvers.rod.scene import Dimensions

_VIOLATION = 0.9e-9
_SAFE_SIDE = 1e-9
_STILL = 1e-4
_ROUNDS = 12
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Polished:
    """A strip, the logarithm of its objective as made small (1/n for a safety; mass per density), and what governs it:
    its peaks and the rows near it."""

    dimensions: Dimensions
    log_cost: float
    peaks: Peaks
    active: CoreRows


def polish(
    cycle: CoreCycle, objective: Objective, limits: Limits, bounds: Bounds, start: Dimensions
) -> Polished | None:
    """The best strip near ``start`` that meets the limits, to the safe side by 1e-9, or None if none is reached.

    Not worse than ``start``.
    """
    box = np.log([bounds.b, bounds.h, bounds.l])
    x = np.clip(np.log([start.b, start.h, start.l]), box[:, 0], box[:, 1])
    wanted = wanted_of(objective, limits)
    peaks = cycle.peaks(Dimensions(*np.exp(x).tolist()), wanted)
    memory = Memory(cycle.following(peaks, wanted))
    p = program(objective, limits, memory.active.layout, _SAFE_SIDE)
    values = memory.values(x)
    unmoved, cost, violation = (x, peaks, memory.active), p.cost(values), p.violation(values)
    least = cost if violation <= _VIOLATION else math.inf
    for _ in range(_ROUNDS):
        step = run(memory, p, box, x)
        if step.violation > _VIOLATION and math.isfinite(step.violation):
            step = restored(memory, p, box, step.x)
        still = float(np.max(np.abs(step.x - x))) < _STILL
        x, cost, violation = step.x, step.cost, step.violation
        if still:
            break
        peaks = cycle.peaks(Dimensions(*np.exp(x).tolist()), wanted).joined(peaks)
        memory = Memory(cycle.following(peaks, wanted))
        p = program(objective, limits, memory.active.layout, _SAFE_SIDE)
    else:
        values = memory.values(x)
        cost, violation = p.cost(values), p.violation(values)
    active = memory.active
    if violation > _VIOLATION or cost > least:
        if least == math.inf:
            return None
        (x, peaks, active), cost = unmoved, least
    return Polished(within(bounds, x), cost, peaks, active)


def within(bounds: Bounds, x: np.ndarray) -> Dimensions:
    """The strip of the logarithms x, within the bounds; a size that differs from a bound by rounding is that bound."""
    ranges = (bounds.b, bounds.h, bounds.l)
    return Dimensions(*(_held(math.exp(v), low, high) for v, (low, high) in zip(x, ranges, strict=True)))


def _held(size: float, low: float, high: float) -> float:
    if size <= low * (1.0 + _ROUNDING):
        return low
    return high if size >= high * (1.0 - _ROUNDING) else size
