"""Diagnosis of infeasibility: the attainable value of each requirement alone, and conflicting requirements.

The best value of a result is the optimum of a separate design problem, found and proven like any other, and what its
strip reaches on the full model. The yield safety is a fatigue safety with another Haigh diagram, that of the maximum
stress; combined with a fatigue requirement, its best value is found by bisection.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

from solvers.errors import InvalidInput
from solvers.fatigue.kernels import GREATEST, Diagram
from solvers.outcome import Outcome, Shortfall
from solvers.rod import rows
from solvers.rod.check import RodCheck
from solvers.rod.constraints import BY_NAME, Constraint, Limits
from solvers.rod.optimum.core_cycle import CoreCycle
from solvers.rod.optimum.proof.outer_approximation import Sizes, search
from solvers.rod.problem import OBJECTIVES, Objective, Requirements
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.strip import buckling
from solvers.watch import OutOfTime

_GAP = 1e-3
_BOXES = 3000
_PROVEN_BOXES = 1200
"""Of a search to the accuracy of the answer, which a search for friction power mostly misses."""
Check = Callable[[Dimensions], Outcome[RodCheck]]
"""The full model's check of a strip."""


_NOTHING: Limits = {rows.STABILITY: -math.log(1.0 + 1e-6)}
_STABILITY, _YIELD = BY_NAME["min_stability_safety"], BY_NAME["min_yield_safety"]


class Best(NamedTuple):
    """The best value of a result, its strip, and by how much (relative) another one may be better."""

    value: float
    strip: Dimensions
    gap: float


def diagnose(
    cycle: CoreCycle, limits: Limits, sizes: Sizes, asked: Requirements, scene: Scene, check: Check, accuracy: float
) -> tuple[tuple[Shortfall, ...], float]:
    """One entry per requirement that cannot be met: alone if any is infeasible by itself, otherwise with the others;
    and the estimated relative error of what is attainable.

    ``attainable`` is the best value without other requirements; if each is feasible alone, the best value under all
    others; if the others conflict among themselves, the worst under any single opponent.
    ``limits`` are the requirements in terms of the search's physics: if these are not the full model's, they differ
    from ``asked`` by the effects' change. The search's strip is then checked on the full model: the value is what that
    strip reaches, and how far that is from what the search knows of it is part of the error. That another strip may be
    better by as much as effects change results is not.
    """
    diagnosis = _Diagnosis(cycle, limits, sizes, asked, scene, check, accuracy)
    entries = diagnosis.entries()
    return entries, diagnosis.error


@dataclass
class _Diagnosis:
    cycle: CoreCycle
    limits: Limits
    sizes: Sizes
    asked: Requirements
    scene: Scene
    check: Check
    accuracy: float
    error: float = 0.0
    """The greatest of the entries."""

    def entries(self) -> tuple[Shortfall, ...]:
        wanted = [constraint for constraint, _ in self.asked.asked()]
        if self.best(_STABILITY, _NOTHING) is None:
            why = f"no strip within the bounds stands at all; {_STABILITY.advice}"
            self.error = self.accuracy
            return (Shortfall(_STABILITY.name, self.asked.min_stability_safety, self.stoutest(), why),)
        alone = [(r, self.best(r, _NOTHING)) for r in wanted]
        beyond = [(r, best) for r, best in alone if not self.reached(r, best)]
        if beyond:
            return tuple(self.entry(r, best, "out of reach even with no other requirement") for r, best in beyond)
        pairs = [
            (r, other) for r, other in combinations(wanted, 2) if not self.reached(r, self.best(r, self.alone(other)))
        ]
        if not pairs:
            why = "can be met together with any other one, but not with all of them"
            if len(wanted) == 2:
                why = (
                    "can be met together with the other one only to within the search's accuracy: a slightly lower "
                    "requirement would do"
                )
            return tuple(self.entry(r, self.best(r, self.without(r)), why) for r in wanted)
        found = []
        for r in wanted:
            opponents = [b if r is a else a for a, b in pairs if r in (a, b)]
            if opponents:
                why = f"can be met alone, but not while {' or '.join(o.name for o in opponents)} holds"
                found.append(self.entry(r, self.beside(r, opponents), why))
        return tuple(found)

    def beside(self, r: Constraint, opponents: Sequence[Constraint]) -> Best | None:
        """The best value under all others, else the worst under a single opponent."""
        found = self.best(r, self.without(r))
        if found is not None:
            return found
        left = [one for opponent in opponents if (one := self.best(r, self.alone(opponent))) is not None]
        return (min if r.least else max)(left, key=lambda one: one.value, default=None)

    def best(self, r: Constraint, limits: Limits) -> Best | None:
        """The best value of the result limited by ``r`` under ``limits``; None if these are infeasible."""
        if r is not _YIELD:
            return self.optimum(self.cycle, OBJECTIVES[r.serves], limits)
        if rows.UTILISATION not in limits:
            return self.strength_alone(limits)
        return self.strength(limits)

    def optimum(self, cycle: CoreCycle, objective: Objective, limits: Limits) -> Best | None:
        proof = search(cycle, objective, limits, self.sizes, _GAP, _BOXES)
        if proof.best is not None and proof.best.log_cost - proof.log_bound > self.accuracy:
            proof = search(cycle, objective, limits, self.sizes, self.accuracy, _PROVEN_BOXES, proof)
        found = proof.best
        if found is None:
            return None
        return Best(math.exp(objective.sign * found.log_cost), found.dimensions, found.log_cost - proof.log_bound)

    def strength_alone(self, limits: Limits) -> Best | None:
        """Maximum yield safety without a fatigue requirement, so that the Haigh diagram can represent stress."""
        greatest = Diagram(GREATEST.lines / self.scene.material.yield_strength, GREATEST.parabola)
        return self.optimum(replace(self.cycle, diagram=greatest), OBJECTIVES[_YIELD.serves], limits)

    def strength(self, limits: Limits) -> Best | None:
        """Maximum yield safety under a fatigue requirement, by bisection; the required value is infeasible."""
        if self.admissible(limits) is None:
            return None
        alone = self.strength_alone({row: limit for row, limit in limits.items() if row != rows.UTILISATION})
        low = self.limits[rows.STRESS]
        # ln of the stress limit: values below low are known to be infeasible.
        low = max(low, _YIELD.log_limit(alone.value, self.scene)) if alone is not None else low
        high = low + 1.0
        while (strip := self.admissible({**limits, rows.STRESS: high})) is None:
            low, high = high, high + 1.0
        while high - low > _GAP:
            middle = 0.5 * (low + high)
            found = self.admissible({**limits, rows.STRESS: middle})
            low, high, strip = (low, middle, found) if found is not None else (middle, high, strip)
        return Best(_YIELD.required_by(high, self.scene), strip, _GAP)

    def admissible(self, limits: Limits) -> Dimensions | None:
        """A strip that meets the limits."""
        found = search(self.cycle, OBJECTIVES["mass"], limits, self.sizes, _GAP, _BOXES).best
        return None if found is None else found.dimensions

    def alone(self, r: Constraint) -> Limits:
        return {**_NOTHING, r.row: self.limits[r.row]}

    def without(self, r: Constraint) -> Limits:
        left = {row: limit for row, limit in self.limits.items() if row != r.row}
        return {**_NOTHING, **left}

    def stoutest(self) -> float:
        """Stability safety of the strip that buckles last: maximum width and thickness, minimum length."""
        bounds = self.sizes.bounds
        d = Dimensions(bounds.b[1], bounds.h[1], bounds.l[0])
        size = self.sizes.around(d)
        b, h, l = size.b[1], size.h[1], size.l[0]
        modulus, rod_length = self.cycle.modulus, self.cycle.rod_length
        return float(buckling.critical_force(modulus, b, h, l, rod_length)) / self.cycle.compression

    def reached(self, r: Constraint, best: Best | None) -> bool:
        return best is not None and r.log_limit(best.value, self.scene) <= self.limits[r.row]

    def entry(self, r: Constraint, best: Best | None, why: str) -> Shortfall:
        required = getattr(self.asked, r.name)
        return Shortfall(r.name, required, None if best is None else self.on_full_model(r, best), f"{why}; {r.advice}")

    def on_full_model(self, r: Constraint, best: Best) -> float:
        """What the strip of the best value reaches there; adds to the error."""
        required = getattr(self.asked, r.name)
        changed = self.limits[r.row] - r.log_limit(required, self.scene)
        expected = r.required_by(r.log_limit(best.value, self.scene) - changed, self.scene)
        try:
            outcome = self.check(best.strip)
        except (InvalidInput, OutOfTime):
            outcome = None
        if outcome is None or outcome.value.stresses is None:
            self.error = max(self.error, 1.0)
            return expected
        reached = r.read(outcome.value)
        apart = abs(reached / expected - 1.0)
        self.error = max(self.error, float(best.gap + outcome.accuracy.estimated + apart))
        # What fulfils the requirement breaks another one, by less than the search can tell.
        return expected if r.meets(outcome.value, required) else reached
