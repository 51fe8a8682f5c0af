"""The best value of a result on the core under limits on the others: the optimum of a separate design problem."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from solvers.rod.constraints import Constraint, Limits
from solvers.rod.objectives import MASS
from solvers.rod.optimum.core.cycle import CoreCycle
from solvers.rod.optimum.proof.outer_approximation import search
from solvers.rod.optimum.sizes import Sizes
from solvers.rod.scene import Dimensions, Scene

_GAP, _BOXES = 1e-3, 3000
"""Greatest gap in ln objective of a search, and its number of boxes."""
_FEASIBILITY_GAP = 1.0
"""Gap of a search that only needs an admissible strip."""


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
        proof = search(self.cycle, r.result, limits, self.sizes, min(self.accuracy, _GAP), _BOXES)
        found = proof.best
        if found is None:
            return None
        # The logarithmic cost is the row that the requirement limits.
        value = r.result.value_at(found.log_cost, self.scene)
        return Best(value, found.dimensions, found.log_cost - proof.log_bound)

    def is_feasible(self, limits: Limits) -> bool:
        """Whether the search finds a strip that meets the limits."""
        proof = search(self.cycle, MASS, limits, self.sizes, _FEASIBILITY_GAP, _BOXES)
        return proof.best is not None

    @property
    def stiffest(self) -> Dimensions:
        """The strip of maximum width and thickness and minimum length."""
        size = self.sizes.around(self.sizes.bounds.stiffest)
        return Dimensions(size.b[1], size.h[1], size.l[0])
