"""From the strip that a search found to the best one nearby on the full model.

The search's rows are tilted by the slopes of what the full model makes of them
(``solvers.rod.optimum.full_model.tilt``), and a step is taken to where the tilted problem has its optimum, at first of
no more than a seventh in any size. A step that is no better, or leads beyond buckling, is tried again from the best
strip a quarter as long, straight along the full model's own slopes (``solvers.rod.optimum.full_model.straight``) and as
tilted in turn; one that ends short of a limit is gone on from, twice at the most.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from solvers.rod.check import RodCheck
from solvers.rod.optimum import constraints as rows
from solvers.rod.optimum.full_model.found import (
    AGREED,
    BOXES,
    GUARD,
    SAFE,
    Evaluate,
    Found,
    apart,
    cost,
    meets,
    own_cost,
    shifted_limits,
)
from solvers.rod.optimum.full_model.straight import downhill
from solvers.rod.optimum.full_model.tilt import Tilt, logarithms, measured
from solvers.rod.optimum.machine import Machine
from solvers.rod.optimum.peak_model import STRESS
from solvers.rod.optimum.proof.outer_approximation import Sizes, search
from solvers.rod.optimum.sqp import Limits, Polished, matters, polish
from solvers.rod.problem import Bounds, RodProblem
from solvers.rod.scene import Dimensions

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
    start = _Stand(found.best, found.outcome.value, found.shifted)
    walk = _Walk(problem, machine, sizes, evaluate, accuracy, found, start, start)
    for _ in range(_SETTLING):
        step = walk.next_step()
        if step is None or not walk.take(step):
            break
    return walk.found if walk.home is start else walk.bounded()


@dataclass
class _Walk:
    """The way from a strip: ``home`` is the best one that will do, ``here`` the one to go on from, which may be short
    of a limit; ``reach`` is how far the next step may go, ``straight`` whether it follows the full model's own slopes.
    """

    problem: RodProblem
    machine: Machine
    sizes: Sizes
    evaluate: Evaluate
    accuracy: float
    found: Found
    home: _Stand
    here: _Stand
    reach: float = _REACH
    failures: int = 0
    short: int = 0
    straight: bool = False

    @property
    def guard(self) -> float:
        return GUARD * self.accuracy

    def next_step(self) -> Polished | None:
        """The best strip that the slopes foretell within reach; None where the way ends."""
        if self.failures >= _FAILURES:
            return None
        if self.here.tilt is None:
            strip, look = self.here.strip, lambda d: self.evaluate(d, _ROUGH).value
            self.here.tilt = measured(strip.focus, strip.dimensions, self.here.full, look, self.sizes.bounds)
        best = self._straight_step() if self.straight else None
        self.straight = best is not None
        best = best or self._tilted_step()
        # A strip that does not meet the limits yet may be short of them by less than that.
        arrived = best is not None and self._moved(best) < AGREED * self.accuracy and self.here is self.home
        return None if arrived else best

    def take(self, best: Polished) -> bool:
        """Look at a strip on the full model and go there, or not; False where the way ends with it."""
        objective, moved = self.problem.objective, self._moved(best)
        outcome = self.evaluate(best.dimensions, min(self.accuracy, 1e-6))
        full = outcome.value
        if full.stresses is None:
            self._fail(moved)
            return True
        will_do = meets(full, self.problem.requirements)
        if will_do and cost(objective, full) >= cost(objective, self.home.full):
            # Too far for slopes, or no smooth place.
            if moved <= _FAR:
                self.found = replace(self.found, rough=self._mistaken(best, full))
            self._fail(moved)
            return True
        shifted = shifted_limits(self.problem, best, full, self.guard)
        tilted = shifted if self.straight else _tilted(self.here.limits, self.here.tilt, best.dimensions)
        strip = replace(best, log_cost=own_cost(objective, best))
        tilt = self.here.tilt._replace(at=logarithms(best.dimensions)) if moved <= _FAR else None
        self.here = _Stand(strip, full, shifted, tilt)
        if will_do:
            self.found = Found(strip, outcome, tilted, self.found.proof, shifted)
            self.home, self.short = self.here, 0
            if self.straight:
                self.reach = min(_MORE * self.reach, _REACH)
            return self.straight or apart(shifted, tilted) > AGREED * self.accuracy
        self.short += 1
        if self.short > _SHORT:
            self._fail(self.reach)
            self.short = 0
        return True

    def bounded(self) -> Found:
        """The strip found with a bound of the search's physics, limits as the full model shifts them there; a little
        less where sizes that are to be had leave nothing else."""
        for guard in (self.guard, -self.guard):
            limits = shifted_limits(self.problem, self.found.best, self.found.outcome.value, guard)
            proof = search(self.machine, self.problem.objective, limits, self.sizes, self.accuracy, BOXES)
            if proof.best is not None:
                return replace(self.found, proof=proof)
        return self.found

    def _tilted_step(self) -> Polished | None:
        """The best strip of sizes that are to be had, near the best one of any size."""
        machine, objective, here, sizes = self.machine, self.problem.objective, self.here, self.sizes
        at = here.strip.dimensions
        best = polish(machine, objective, here.limits, _within(sizes.bounds, at, self.reach), at, here.tilt)
        if best is None or not sizes.discrete:
            return best
        strip = best.dimensions
        return polish(machine, objective, here.limits, sizes.around(strip), strip, here.tilt)

    def _straight_step(self) -> Polished | None:
        """Of sizes that are to be had there is no straight line."""
        if self.sizes.discrete:
            return None
        objective, here = self.problem.objective, self.here
        box = _within(self.sizes.bounds, here.strip.dimensions, self.reach)
        to = downhill(objective, self.problem.requirements, self.guard, here.tilt, here.full, box)
        if to is None:
            return None
        strip, change = to
        focus, angles = self.machine.focus_at(strip.b, strip.h, strip.l, matters(objective, here.limits))
        return Polished(strip, here.strip.log_cost + change, focus, angles)

    def _fail(self, moved: float) -> None:
        """Back home, with less reach and by the other kind of step."""
        self.here, self.reach, self.straight = self.home, _LESS * moved, not self.straight
        self.failures += 1

    def _moved(self, best: Polished) -> float:
        return float(np.max(np.abs(logarithms(best.dimensions) - self.here.tilt.at)))

    def _mistaken(self, best: Polished, full: RodCheck) -> float:
        """How far off the slopes foretold a step, in ln objective."""
        objective, density = self.problem.objective, self.problem.scene.material.density
        found_out = objective.log_cost(full, density) - objective.log_cost(self.here.full, density)
        return abs(found_out - (best.log_cost - self.here.strip.log_cost))


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
