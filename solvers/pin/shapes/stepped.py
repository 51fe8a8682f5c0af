"""Stepped profiles: n cylindrical steps per half, a bore narrowing or an outer diameter widening toward the middle."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from solvers.errors import InvalidInput
from solvers.pin.optimum.lagrangian import minimum_volume
from solvers.pin.optimum.program import Program, ShapeResult
from solvers.pin.shapes.break_points.half import Half, Steps, at_stations, step_vertices
from solvers.pin.shapes.break_points.search import GAP, Evidence, lightest_steps
from solvers.pin.shapes.constant import Constant

MOST_STEPS = 12
_GAP_FRACTION = 0.09
"""Relative gap at convergence as a fraction of the requested gap, if that is larger than ``GAP``."""

_METHOD = "dynamic programming through cells of the break points, cut until bound and best meet"
_DUAL = "; Lagrangian dual of the deflection limit"
_SOLID_TOLERANCE = 1e-9
"""Part of the boss that is solid, too, where the deflection limit equals the solid pin's deflection to rounding."""


@dataclass(frozen=True)
class Stepped:
    """Profile with ``steps`` cylindrical steps from each end to the middle."""

    steps: int
    name: str = "stepped"

    def __post_init__(self) -> None:
        if not 1 <= self.steps <= MOST_STEPS:
            raise InvalidInput("form.steps", "is no number of steps this form knows", f"1 … {MOST_STEPS}")

    def find(self, program: Program, gap: float) -> ShapeResult | None:
        """The best shape of this form within a program, None if there is none (``ShapeResult``)."""
        if self.steps == 1:
            return Constant().find(program, gap)
        found = self._search(program, max(GAP, _GAP_FRACTION * gap))
        if found is None:
            return None
        best, bound, evidence = found
        length, sizes = program.scene.geometry.length, program.variable.sizes(program.variable.wall_of(best.walls))
        method = _METHOD + (_DUAL if best.multiplier > 0.0 else "")
        return ShapeResult(
            at_stations(program, best), best.volume, partial(float, bound), method, evidence,
            corners=step_vertices(best.places * 0.5 * length, sizes, length),
        )  # fmt: skip

    def _search(self, program: Program, gap: float) -> tuple[Steps, float, Evidence] | None:
        solution = None
        if program.limit is not None:
            solution = minimum_volume(program, np.maximum.accumulate(program.lower), True)
        if solution is None or not math.isinf(solution.multiplier):
            return lightest_steps(Half(program), self.steps, gap)
        # Only a pin that is solid between the reference points satisfies the limit: the steps outside are constrained
        # by strength alone.
        g = program.scene.geometry
        start = g.boss_length * (1.0 - _SOLID_TOLERANCE)
        constrained = replace(program, limit=None, lower=np.where(program.stations.x > start, 1.0, program.lower))
        found = lightest_steps(Half(constrained, start), self.steps, gap)
        if found is None:
            return None
        best, bound, evidence = found
        return best, bound - 2.0 * (g.boss_length - start) / g.length, evidence
