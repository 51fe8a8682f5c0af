"""The best value of a result on the core under limits on the others: the optimum of a separate design problem.

The yield safety is a fatigue safety for another Haigh diagram, that of the maximum stress. Combined with a fatigue
requirement, its best value is found by bisection.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

from solvers.fatigue.kernels import GREATEST, Diagram
from solvers.rod import rows
from solvers.rod.constraints import BY_NAME, Constraint, Limits
from solvers.rod.optimum.core.cycle import CoreCycle
from solvers.rod.optimum.proof.outer_approximation import Sizes, search
from solvers.rod.problem import OBJECTIVES, Objective
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.strip import buckling

_GAP = 1e-3
_FEASIBILITY_GAP = 1.0
"""Gap of a search that only needs an admissible strip."""
_BOXES = 3000

_YIELD = BY_NAME["min_yield_safety"]


class Best(NamedTuple):
    """The best value of a result, its strip, and the relative gap by which another strip may be better."""

    value: float
    strip: Dimensions
    gap: float


@dataclass(frozen=True)
class CoreOptima:
    """Searches on the core to a relative ``accuracy``."""

    cycle: CoreCycle
    sizes: Sizes
    scene: Scene
    accuracy: float

    def best(self, r: Constraint, limits: Limits) -> Best | None:
        """The best value of the result limited by ``r`` under ``limits``; None if these are infeasible."""
        if r is not _YIELD:
            return self._search(self.cycle, OBJECTIVES[r.objective], limits)
        if rows.UTILISATION not in limits:
            return self._yield_safety_alone(limits)
        return self._yield_safety(limits)

    def is_feasible(self, limits: Limits) -> bool:
        """Whether the search finds a strip that meets the limits."""
        return self._admissible_strip(limits, _FEASIBILITY_GAP) is not None

    def max_stability_safety(self) -> float:
        """Maximum stability safety: that of maximum width and thickness and minimum length."""
        size = self.sizes.around(self.sizes.bounds.stiffest)
        b, h, l = size.b[1], size.h[1], size.l[0]
        modulus, rod_length = self.cycle.modulus, self.cycle.rod_length
        return float(buckling.critical_force(modulus, b, h, l, rod_length)) / self.cycle.compression

    def _search(self, cycle: CoreCycle, objective: Objective, limits: Limits) -> Best | None:
        proof = search(cycle, objective, limits, self.sizes, min(self.accuracy, _GAP), _BOXES)
        found = proof.best
        if found is None:
            return None
        return Best(math.exp(objective.sign * found.log_cost), found.dimensions, found.log_cost - proof.log_bound)

    def _yield_safety_alone(self, limits: Limits) -> Best | None:
        """Maximum yield safety without a fatigue requirement, so that the Haigh diagram can represent stress."""
        max_stress = Diagram(GREATEST.lines / self.scene.material.yield_strength, GREATEST.parabola)
        return self._search(replace(self.cycle, diagram=max_stress), OBJECTIVES[_YIELD.objective], limits)

    def _yield_safety(self, limits: Limits) -> Best | None:
        """Maximum yield safety under a fatigue requirement, by bisection."""
        if self._admissible_strip(limits) is None:
            return None
        alone = self._yield_safety_alone({row: limit for row, limit in limits.items() if row != rows.UTILISATION})
        # ln of the stress limit.
        low = _YIELD.log_limit(alone.value, self.scene)
        high = low + 1.0
        while (strip := self._admissible_strip({**limits, rows.STRESS: high})) is None:
            low, high = high, high + 1.0
        while high - low > _GAP:
            middle = 0.5 * (low + high)
            found = self._admissible_strip({**limits, rows.STRESS: middle})
            low, high, strip = (low, middle, found) if found is not None else (middle, high, strip)
        return Best(_YIELD.required_by(high, self.scene), strip, _GAP)

    def _admissible_strip(self, limits: Limits, gap: float = _GAP) -> Dimensions | None:
        """A strip that meets the limits."""
        found = search(self.cycle, OBJECTIVES["mass"], limits, self.sizes, gap, _BOXES).best
        return None if found is None else found.dimensions
