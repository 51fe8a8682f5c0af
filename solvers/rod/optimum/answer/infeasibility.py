"""Why there is no strip: what each requirement could be alone, and which of them exclude each other.

The best value of a result is the optimum of a design problem of its own, found and proven like any other. The yield
safety is a fatigue safety on another Haigh diagram, that of the greatest stress; held against the true one, its best
value is bisected.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

from solvers.fatigue.kernels import GREATEST
from solvers.outcome import Shortfall
from solvers.rod.optimum.machine import Machine
from solvers.rod.optimum.proof.outer_approximation import Sizes, search
from solvers.rod.optimum.sqp import Limits
from solvers.rod.problem import OBJECTIVES, Objective, Requirements
from solvers.rod.scene import Dimensions
from solvers.rod.strip import buckling

_GAP = 1e-3
_BOXES = 3000
_UPRIGHT = 1.0 + 1e-6


@dataclass(frozen=True)
class _Requirement:
    """A requirement: the objective that serves it, the limit that states it, and what would help."""

    name: str
    objective: Objective
    limit: str
    advice: str

    def without(self, limits: Limits) -> Limits:
        return replace(limits, **{self.limit: getattr(_NOTHING, self.limit)})

    def alone(self, limits: Limits) -> Limits:
        return replace(_NOTHING, **{self.limit: getattr(limits, self.limit)})


_NOTHING = Limits(fatigue=None, stability=_UPRIGHT)
_YIELD = _Requirement(
    "min_yield_safety", OBJECTIVES["fatigue_safety"], "stress",
    "a longer strip, a smaller crank radius, a higher yield strength or a lower pressure would raise it",
)  # fmt: skip
_STABILITY = _Requirement(
    "min_stability_safety", OBJECTIVES["stability_safety"], "stability",
    "a thicker or wider strip, a smaller piston or a lower pressure would raise it",
)  # fmt: skip
_REQUIREMENTS = (
    _Requirement(
        "min_fatigue_safety", OBJECTIVES["fatigue_safety"], "fatigue",
        "a longer strip, a wider one, a smaller crank radius, a stronger material or a lower pressure would raise it",
    ),
    _STABILITY,
    _Requirement(
        "max_contact_pressure", OBJECTIVES["contact_pressure"], "pressure",
        "a longer or thinner strip, a longer skirt or a smaller crank radius would lower it",
    ),
    _Requirement(
        "max_friction_power", OBJECTIVES["friction_power"], "power",
        "a longer or thinner strip, a lower friction coefficient or a lower speed would lower it",
    ),
    # Last, so that of a pair it is the one that is held and not the one that is searched for.
    _YIELD,
)  # fmt: skip


def diagnose(machine: Machine, limits: Limits, sizes: Sizes, asked: Requirements) -> tuple[Shortfall, ...]:
    """One entry per requirement that cannot be met: alone if any cannot be met even alone, else beside the others.

    ``attainable`` is the best value with no other requirement, or, where each could be met alone, the best that all the
    others leave, or, where the others exclude each other already, the least that one of its own opponents leaves.
    """
    return _Diagnosis(machine, limits, sizes, asked).entries()


@dataclass(frozen=True)
class _Diagnosis:
    machine: Machine
    limits: Limits
    sizes: Sizes
    asked: Requirements

    def entries(self) -> tuple[Shortfall, ...]:
        wanted = [r for r in _REQUIREMENTS if getattr(self.asked, r.name) is not None]
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
            if not self.reached(r, value := self.best(r, other.alone(self.limits)))
        ]
        if not pairs:
            why = "can be met beside any other one, but not beside all of them"
            return tuple(self.entry(r, self.best(r, r.without(self.limits)), why) for r in wanted)
        found = []
        for r in wanted:
            opponents = [b if r is a else a for a, b, _ in pairs if r in (a, b)]
            if opponents:
                why = f"can be met alone, but not while {' or '.join(o.name for o in opponents)} holds"
                found.append(self.entry(r, self.beside(r, opponents), why))
        return tuple(found)

    def beside(self, r: _Requirement, opponents: Sequence[_Requirement]) -> float | None:
        """The best that all the others leave, else the least that one opponent leaves."""
        value = self.best(r, r.without(self.limits))
        if value is not None:
            return value
        values = [self.best(r, opponent.alone(self.limits)) for opponent in opponents]
        left = [v for v in values if v is not None]
        return (min(left) if r.objective.sign < 0 else max(left)) if left else None

    def best(self, r: _Requirement, limits: Limits) -> float | None:
        """The best value of the result that ``r`` limits, under ``limits``; None where they leave no strip."""
        if r is not _YIELD:
            return self.optimum(self.machine, r.objective, limits)
        if limits.fatigue is None:
            return self.strength_alone(limits)
        return self.strength(limits)

    def optimum(self, machine: Machine, objective: Objective, limits: Limits) -> float | None:
        found = search(machine, objective, limits, self.sizes, _GAP, _BOXES).best
        return None if found is None else math.exp(objective.sign * found.log_cost)

    def strength_alone(self, limits: Limits) -> float | None:
        """The greatest yield safety where fatigue is no matter, which leaves the Haigh diagram free for stress."""
        by_stress = replace(self.machine, lines=GREATEST.lines / self.yield_strength(), parabola=GREATEST.parabola)
        return self.optimum(by_stress, _YIELD.objective, limits)

    def strength(self, limits: Limits) -> float | None:
        """The greatest yield safety beside a fatigue safety, by bisection: it was the limit that nothing met."""
        if self.optimum(self.machine, OBJECTIVES["mass"], limits) is None:
            return None
        low, high = self.strength_alone(replace(limits, fatigue=None)), self.limits.stress
        low = self.yield_strength() / low if low is not None else high
        # ln of the greatest stress that can be asked for: nothing below low, and high is what was asked for in vain.
        low, high = math.log(max(low, high)), math.log(max(low, high)) + 1.0
        while self.optimum(self.machine, OBJECTIVES["mass"], replace(limits, stress=math.exp(high))) is None:
            low, high = high, high + 1.0
        while high - low > _GAP:
            middle = 0.5 * (low + high)
            none = self.optimum(self.machine, OBJECTIVES["mass"], replace(limits, stress=math.exp(middle))) is None
            low, high = (middle, high) if none else (low, middle)
        return self.yield_strength() / math.exp(high)

    def yield_strength(self) -> float:
        return self.limits.stress * self.asked.min_yield_safety

    def stoutest(self) -> float:
        """The stability safety of the strip that buckles last: as wide, thick and short as may be."""
        bounds = self.sizes.bounds
        d = Dimensions(bounds.b[1], bounds.h[1], bounds.l[0])
        size = self.sizes.around(d)
        b, h, l = size.b[1], size.h[1], size.l[0]
        modulus, rod_length = self.machine.modulus, self.machine.rod_length
        return float(buckling.critical_force(modulus, b, h, l, rod_length)) / self.machine.compression

    def reached(self, r: _Requirement, value: float | None) -> bool:
        required = getattr(self.asked, r.name)
        return value is not None and (value >= required if r.objective.sign < 0 else value <= required)

    def entry(self, r: _Requirement, attainable: float | None, why: str) -> Shortfall:
        return Shortfall(r.name, getattr(self.asked, r.name), attainable, f"{why}; {r.advice}")
