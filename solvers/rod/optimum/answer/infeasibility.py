"""Diagnosis of infeasibility: the attainable value of each requirement alone, and conflicting requirements.

The best value of a result is the optimum of a separate design problem, found and proven like any other. The yield
safety is a fatigue safety with another Haigh diagram, that of the maximum stress; combined with a fatigue requirement,
its best value is found by bisection.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

from solvers.fatigue.kernels import GREATEST, Diagram
from solvers.outcome import Shortfall
from solvers.rod import rows
from solvers.rod.constraints import BY_NAME, Constraint, Limits
from solvers.rod.optimum.core_cycle import CoreCycle
from solvers.rod.optimum.proof.outer_approximation import Sizes, search
from solvers.rod.problem import OBJECTIVES, Objective, Requirements
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.strip import buckling

_GAP = 1e-3
_BOXES = 3000


_NOTHING: Limits = {rows.STABILITY: -math.log(1.0 + 1e-6)}
_STABILITY, _YIELD = BY_NAME["min_stability_safety"], BY_NAME["min_yield_safety"]


def diagnose(
    cycle: CoreCycle, limits: Limits, sizes: Sizes, asked: Requirements, scene: Scene
) -> tuple[Shortfall, ...]:
    """One entry per requirement that cannot be met: alone if any is infeasible by itself, otherwise with the others.

    ``attainable`` is the best value without other requirements; if each is feasible alone, the best value under all
    others; if the others conflict among themselves, the worst under any single opponent.
    ``limits`` are the requirements in terms of the search's physics: if these are not the full model's, they differ
    from ``asked`` by the effects' change, and the attainable value is corrected by the same change.
    """
    return _Diagnosis(cycle, limits, sizes, asked, scene).entries()


@dataclass(frozen=True)
class _Diagnosis:
    cycle: CoreCycle
    limits: Limits
    sizes: Sizes
    asked: Requirements
    scene: Scene

    def entries(self) -> tuple[Shortfall, ...]:
        wanted = [constraint for constraint, _ in self.asked.asked()]
        if self.best(_STABILITY, _NOTHING) is None:
            why = f"no strip within the bounds stands at all; {_STABILITY.advice}"
            return (Shortfall(_STABILITY.name, self.asked.min_stability_safety, self.stoutest(), why),)
        alone = [(r, self.best(r, _NOTHING)) for r in wanted]
        beyond = [(r, value) for r, value in alone if not self.reached(r, value)]
        if beyond:
            return tuple(self.entry(r, value, "out of reach even with no other requirement") for r, value in beyond)
        pairs = [
            (r, other, value)
            for r, other in combinations(wanted, 2)
            if not self.reached(r, value := self.best(r, self.alone(other)))
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
            opponents = [b if r is a else a for a, b, _ in pairs if r in (a, b)]
            if opponents:
                why = f"can be met alone, but not while {' or '.join(o.name for o in opponents)} holds"
                found.append(self.entry(r, self.beside(r, opponents), why))
        return tuple(found)

    def beside(self, r: Constraint, opponents: Sequence[Constraint]) -> float | None:
        """The best value under all others, else the worst under a single opponent."""
        value = self.best(r, self.without(r))
        if value is not None:
            return value
        values = [self.best(r, self.alone(opponent)) for opponent in opponents]
        left = [v for v in values if v is not None]
        return (min(left) if r.least else max(left)) if left else None

    def best(self, r: Constraint, limits: Limits) -> float | None:
        """The best value of the result limited by ``r`` under ``limits``; None if these are infeasible."""
        if r is not _YIELD:
            return self.optimum(self.cycle, OBJECTIVES[r.serves], limits)
        if rows.UTILISATION not in limits:
            return self.strength_alone(limits)
        return self.strength(limits)

    def optimum(self, cycle: CoreCycle, objective: Objective, limits: Limits) -> float | None:
        found = search(cycle, objective, limits, self.sizes, _GAP, _BOXES).best
        return None if found is None else math.exp(objective.sign * found.log_cost)

    def strength_alone(self, limits: Limits) -> float | None:
        """Maximum yield safety without a fatigue requirement, so that the Haigh diagram can represent stress."""
        greatest = Diagram(GREATEST.lines / self.scene.material.yield_strength, GREATEST.parabola)
        return self.optimum(replace(self.cycle, diagram=greatest), OBJECTIVES[_YIELD.serves], limits)

    def strength(self, limits: Limits) -> float | None:
        """Maximum yield safety under a fatigue requirement, by bisection; the required value is infeasible."""
        if not self.leaves_any(limits):
            return None
        alone = self.strength_alone({row: limit for row, limit in limits.items() if row != rows.UTILISATION})
        low = self.limits[rows.STRESS]
        # ln of the stress limit: values below low are known to be infeasible.
        low = max(low, _YIELD.log_limit(alone, self.scene)) if alone is not None else low
        high = low + 1.0
        while not self.leaves_any({**limits, rows.STRESS: high}):
            low, high = high, high + 1.0
        while high - low > _GAP:
            middle = 0.5 * (low + high)
            low, high = (low, middle) if self.leaves_any({**limits, rows.STRESS: middle}) else (middle, high)
        return _YIELD.required_by(high, self.scene)

    def leaves_any(self, limits: Limits) -> bool:
        """Whether a strip that meets the limits is found."""
        return self.optimum(self.cycle, OBJECTIVES["mass"], limits) is not None

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

    def reached(self, r: Constraint, value: float | None) -> bool:
        return value is not None and r.log_limit(value, self.scene) <= self.limits[r.row]

    def entry(self, r: Constraint, attainable: float | None, why: str) -> Shortfall:
        if attainable is not None:
            # Convert to the full model.
            changed = self.limits[r.row] - r.log_limit(getattr(self.asked, r.name), self.scene)
            attainable = r.required_by(r.log_limit(attainable, self.scene) - changed, self.scene)
        return Shortfall(r.name, getattr(self.asked, r.name), attainable, f"{why}; {r.advice}")
