"""Stepped profiles: n cylindrical steps per half, a bore narrowing or an outer diameter widening toward the middle."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput
from solvers.pin.optimum.found import Found
from solvers.pin.optimum.lagrangian import weigh
from solvers.pin.optimum.program import Program, rising
from solvers.pin.section.flexibility import densities
from solvers.pin.shapes.break_points.half import Half, at_stations, corners_of
from solvers.pin.shapes.break_points.search import GAP, Steps, lightest_steps
from solvers.pin.shapes.constant import Constant
from solvers.pin.shapes.free import Free

Array = NDArray[np.float64]

MOST_STEPS = 12
_GAP_FRACTION = 0.09
"""Relative gap at convergence as a fraction of the requested gap, if that is larger than ``GAP``."""

_SOLID_TOLERANCE = 1e-9
"""Relative mass tolerance of a limit that equals the solid pin's deflection to rounding."""


@dataclass(frozen=True)
class Stepped:
    """``steps`` different diameters from each end to the middle."""

    steps: int
    name: str = "stepped"

    def __post_init__(self) -> None:
        if not 1 <= self.steps <= MOST_STEPS:
            raise InvalidInput("form.steps", "is no number of steps this form knows", f"1 … {MOST_STEPS}")

    def find(self, program: Program, gap: float) -> Found | None:
        """See ``solvers.pin.optimum.found``."""
        if self.steps == 1:
            return Constant().find(program, gap)
        if program.limits.max_slope is not None:
            raise InvalidInput("limits.max_slope", "a step has no slope", "no slope limit with steps")
        # Steps cannot be lighter than the drillable shape, which may thicken continuously.
        smooth = Free(drillable=True).find(program, gap) if program.limit is not None else None
        found = self._search(program, 0.0 if smooth is None else smooth.bound, max(GAP, _GAP_FRACTION * gap))
        if found is None:
            return None
        length, walls = program.scene.geometry.length, found.walls
        evidence = dict(found.evidence)
        if program.limit is not None:
            reached = Half(program).sums.upto(np.concatenate([[0.0], found.places]))
            pulls = np.maximum(np.diff(reached, axis=1), 0.0, order="C")
            law = program.law
            bent = densities(walls.levels, pulls[0], pulls[1], program.sought.kappa, law.a, law.b)
            evidence["deflection_as_constrained_um"] = 1e6 * program.limit * float(bent.sum())
        places = found.places * 0.5 * length
        return Found(
            at_stations(program, places, walls.levels), float(walls.volume), partial(float, found.bound),
            found.method, evidence,
            corners=corners_of(places, program.sought.sizes(program.sought.wall_of(walls.levels)), length),
        )  # fmt: skip

    def _search(self, program: Program, known: float, gap: float) -> Steps | None:
        weighed = None
        if program.limit is not None:
            weighed = weigh(program, rising(program.lower, program.anchor), True)
        if weighed is None or not math.isinf(weighed.multiplier):
            return lightest_steps(Half(program), self.steps, known, gap)
        # Only a solid span satisfies the limit: the free steps lie before it, and only strength constrains them.
        start, x = program.scene.reference.left * (1.0 + _SOLID_TOLERANCE), program.stations.x
        span = (x > start) & (program.scene.geometry.length - x > start)
        held = replace(program, limit=None, lower=np.where(span, 1.0, program.lower))
        found = lightest_steps(Half(held, start), self.steps, known, gap)
        return None if found is None else replace(found, bound=found.bound * (1.0 - _SOLID_TOLERANCE))
