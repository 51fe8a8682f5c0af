"""Steps from both ends: a bore of n cylinders that narrow toward the middle, or an outside that widens."""

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
from solvers.pin.shapes.break_points.half import Half, at_stations, corners_of
from solvers.pin.shapes.break_points.search import GAP, Steps, lightest_steps
from solvers.pin.shapes.constant import Constant
from solvers.pin.shapes.free import Free

Array = NDArray[np.float64]

MOST_STEPS = 12
_SHARE = 0.09
"""Of the gap asked for: how close bound and best come where that is more than ``GAP``."""

_AS_SOLID = 1e-9
"""What a limit that is the solid pin's deflection but for rounding may be worth, relative to the mass."""


@dataclass(frozen=True)
class Stepped:
    """``steps`` different diameters from each end to the middle."""

    steps: int
    name: str = "stepped"

    def __post_init__(self) -> None:
        if not 1 <= self.steps <= MOST_STEPS:
            raise InvalidInput("form.steps", "is no number of steps this form knows", f"1 … {MOST_STEPS}")

    def find(self, program: Program, gap: float) -> Found | None:
        """See ``solvers.pin.shapes.shape.Form``."""
        if self.steps == 1:
            return Constant().find(program, gap)
        if program.limits.max_slope is not None:
            raise InvalidInput("limits.max_slope", "a step has no slope", "no slope limit with steps")
        # No steps are lighter than the shape that may thicken all the way.
        smooth = Free(drillable=True).find(program, gap) if program.limit is not None else None
        found = self._search(program, 0.0 if smooth is None else smooth.bound, max(GAP, _SHARE * gap))
        if found is None:
            return None
        length, walls = program.scene.geometry.length, found.walls
        evidence = dict(found.evidence)
        if program.limit is not None:
            reached = Half(program).sums().upto(np.concatenate([[0.0], found.places]))
            pulls = np.maximum(np.diff(reached, axis=1), 0.0, order="C")
            bent = program.sought.densities(walls.levels, pulls[0], pulls[1], program.law)
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
        # Only a solid span keeps the limit: what is left to choose lies before it, and strength alone asks for walls.
        start, x = program.scene.reference.left * (1.0 + _AS_SOLID), program.stations.x
        span = (x > start) & (program.scene.geometry.length - x > start)
        held = replace(program, limit=None, lower=np.where(span, 1.0, program.lower))
        found = lightest_steps(Half(held, start), self.steps, known, gap)
        return None if found is None else replace(found, bound=found.bound * (1.0 - _AS_SOLID))
