"""From the strip that a search found to the best one nearby on the full model.

The search's rows are tilted by the slopes of what the full model makes of them (``solvers.rod.tilt``), and a step is
taken to where the tilted problem has its optimum, at first of no more than a seventh in any size. A step that is no
better, or leads beyond buckling, is tried again from the best strip a quarter as long, straight along the full model's
own slopes (``solvers.rod.straight``) and as tilted in turn; one that ends short of a limit is gone on from, twice at
the most.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from solvers.rod import rows
from solvers.rod.certificate import Sizes, search
from solvers.rod.check import RodCheck
from solvers.rod.focus import STRESS
from solvers.rod.found import AGREED, BOXES, GUARD, SAFE, Evaluate, Found, apart, cost, meets, own_cost, shifted_limits
from solvers.rod.machine import Machine
from solvers.rod.polish import Limits, Polished, matters, polish
from solvers.rod.problem import Bounds, RodProblem
from solvers.rod.scene import Dimensions
from solvers.rod.straight import downhill
from solvers.rod.tilt import Tilt, logarithms, measured

_SETTLING, _FAILURES, _SHORT, _REACH, _LESS, _MORE, _FAR, _ROUGH = 24, 6, 2, 0.15, 0.25, 2.0, 0.02, 1e-5
"""Settling: looks at the full model, how many of them may be no better, how many in a row short of a limit, how far one
may go in logarithms, by what less after a step that failed, and more after a straight one that did not, how far slopes
hold, and how exact the looks are that they come from."""


@dataclass
class _Stand:
    """A strip to go on from: what the full model says of it, the limits that shifts to, and the tilt, once measured."""

    strip: Polished
    full: RodCheck
    limits: Limits
    tilt: Tilt | None = None


def settled(
    problem: RodProblem, machine: Machine, sizes: Sizes, found: Found, evaluate: Evaluate, accuracy: float
) -> Found:
    """The strip moved to where the full model's own slopes balance, as far as that makes it better."""
    if math.isinf(cost(problem.objective, found.outcome.value)):
        return found
    objective, density = problem.objective, problem.scene.material.density
    reach, failures, short = _REACH, 0, 0

    def tilted_step(here: _Stand) -> Polished | None:
        """The best strip of sizes that are to be had, near the best one of any size."""
        at, tilt = here.strip.dimensions, here.tilt
        best = polish(machine, objective, here.limits, _within(sizes.bounds, at, reach), at, tilt)
        if best is None or not sizes.discrete:
            return best
        strip = best.dimensions
        return polish(machine, objective, here.limits, sizes.around(strip), strip, tilt)

    def straight_step(here: _Stand) -> Polished | None:
        """Of sizes that are to be had there is no straight line."""
        box = _within(sizes.bounds, here.strip.dimensions, reach)
        to = None if sizes.discrete else downhill(objective, problem.requirements, guard, here.tilt, here.full, box)
        if to is None:
            return None
        strip, change = to
        focus, angles = machine.focus_at(strip.b, strip.h, strip.l, matters(objective, here.limits))
        return Polished(strip, here.strip.log_cost + change, focus, angles)

    guard = GUARD * accuracy
    start, here = found, _Stand(found.best, found.outcome.value, found.shifted)
    home, straight = here, False
    for _ in range(_SETTLING):
        if here.tilt is None:
            strip, look = here.strip, lambda d: evaluate(d, _ROUGH).value
            here.tilt = measured(strip.focus, strip.dimensions, here.full, look, sizes.bounds)
        best = straight_step(here) if straight and failures < _FAILURES else None
        straight = best is not None
        if not straight:
            best = tilted_step(here) if failures < _FAILURES else None
        moved = 0.0 if best is None else float(np.max(np.abs(logarithms(best.dimensions) - here.tilt.at)))
        # A strip that does not meet the limits yet may be short of them by less than that.
        if best is None or (moved < AGREED * accuracy and here is home):
            break
        outcome = evaluate(best.dimensions, min(accuracy, 1e-6))
        full = outcome.value
        if full.stresses is None:
            here, reach, failures, straight = home, _LESS * moved, failures + 1, not straight
            continue
        will_do = meets(full, problem.requirements)
        if will_do and cost(objective, full) >= cost(objective, home.full):
            # Too far for slopes, or no smooth place.
            if moved <= _FAR:
                foretold = best.log_cost - here.strip.log_cost
                found_out = objective.log_cost(full, density) - objective.log_cost(here.full, density)
                found = replace(found, rough=abs(found_out - foretold))
            here, reach, failures, straight = home, _LESS * moved, failures + 1, not straight
            continue
        shifted = shifted_limits(problem, best, full, guard)
        tilted = shifted if straight else _tilted(here.limits, here.tilt, best.dimensions)
        strip = replace(best, log_cost=own_cost(objective, best))
        tilt = here.tilt._replace(at=logarithms(best.dimensions)) if moved <= _FAR else None
        found = Found(strip, outcome, tilted, found.proof, shifted) if will_do else found
        here = _Stand(strip, full, shifted, tilt)
        home, short = (here, 0) if will_do else (home, short + 1)
        if straight and will_do:
            reach = min(_MORE * reach, _REACH)
        if short > _SHORT:
            here, reach, failures, short, straight = home, _LESS * reach, failures + 1, 0, not straight
        if will_do and not straight and apart(shifted, tilted) <= AGREED * accuracy:
            break
    if home.strip is start.best:
        return found
    # The bound is one of the search's physics with limits as the full model shifts them at the answer; a little less
    # where sizes that are to be had leave nothing else.
    for side in (guard, -guard):
        limits = shifted_limits(problem, found.best, found.outcome.value, side)
        proof = search(machine, objective, limits, sizes, accuracy, BOXES)
        if proof.best is not None:
            return replace(found, proof=proof)
    return found


def _within(box: Bounds, d: Dimensions, reach: float) -> Bounds:
    """The part of a box that lies no further from a strip, in logarithms."""
    return Bounds(
        *(
            (max(low, min(size * math.exp(-reach), high)), min(high, max(size * math.exp(reach), low)))
            for (low, high), size in zip((box.b, box.h, box.l), (d.b, d.h, d.l), strict=True)
        )
    )


def _tilted(limits: Limits, tilt: Tilt, d: Dimensions) -> Limits:
    """Limits of a strip's own rows that are those of tilted ones."""
    change = tilt.change(logarithms(d))

    def moved(limit: float | None, row: int, sign: float) -> float | None:
        return None if limit is None else limit * math.exp(sign * change[row])

    return Limits(
        moved(limits.fatigue, rows.UTILISATION, 1.0),
        max(moved(limits.stability, rows.STABILITY, 1.0), SAFE),
        moved(limits.stress, STRESS, -1.0),
        moved(limits.pressure, rows.PRESSURE, -1.0),
        moved(limits.power, rows.POWER, -1.0),
    )
