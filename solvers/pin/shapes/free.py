"""Forms with an independent wall at every station: free, drillable, slope-limited."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from solvers.numerics.arrays import Array
from solvers.pin.optimum.conic import slope_limit_error, slope_limited, slope_limited_optimum
from solvers.pin.optimum.design_variable import design_variable_of
from solvers.pin.optimum.dual_bound import least_walls_bound, monotone_bound, pointwise_bound
from solvers.pin.optimum.lagrangian import DualSolution, minimum_volume, multiplier_evidence
from solvers.pin.optimum.program import Program, ShapeResult, least_walls_at
from solvers.pin.scene import Scene
from solvers.pin.section.criteria import Criterion
from solvers.pin.stations.between_nodes import running_maximum_error

_STRENGTH_METHOD = "every station's wall is the least that holds"
_DUAL_METHOD = "Lagrangian dual, tangents at the answer"


def _error_estimate(program: Program, solution: DualSolution, drillable: bool) -> Array:
    """Return the error estimate of the volume per panel: quadrature, maxima between stations of a drillable or
    slope-limited shape, and the deflection's error times the multiplier."""
    stations, low, missed = program.stations, program.lower, 0.0
    if drillable:
        missed = running_maximum_error(stations.x, stations.weight, low, stations.span, True)
        low = np.maximum.accumulate(low)
    if program.limits.max_slope is not None:
        missed = missed + slope_limit_error(program, low)
    found = stations.error_estimate(solution.solidity) + missed
    if program.limit is not None and 0.0 < solution.multiplier < math.inf:
        density = program.densities(solution.solidity)
        found = found + solution.multiplier / program.limit * stations.error_estimate(density)
    return found


@dataclass(frozen=True)
class Free:
    """Arbitrary wall; ``drillable``: the bore must not widen, or the outer diameter shrink, toward the middle."""

    drillable: bool = False

    @property
    def name(self) -> str:
        return "drillable" if self.drillable else "free"

    def find(self, program: Program, gap: float) -> ShapeResult | None:
        """The best shape of this form within a program, None if there is none (``ShapeResult``)."""
        low = np.maximum.accumulate(program.lower) if self.drillable else program.lower
        low = slope_limited(program, low)
        coupled = program.limits.max_slope is not None and program.limit is not None
        if coupled and program.deflection(low) > program.limit:
            return slope_limited_optimum(program, low, self.drillable, gap)
        solution = minimum_volume(program, low, self.drillable)
        if solution is None:
            return None
        if solution.multiplier == 0.0:
            proof, method = partial(least_walls_bound, program, low), _STRENGTH_METHOD
        else:
            bound = monotone_bound if self.drillable else pointwise_bound
            proof, method = partial(bound, program, low, solution.multiplier, solution.solidity), _DUAL_METHOD
        # The quadrature error of the lower bounds themselves is known to the caller.
        is_lower = solution.solidity is program.lower and program.limits.max_slope is None
        evidence = {"multiplier": multiplier_evidence(solution.multiplier), "rounds": solution.iterations}
        return ShapeResult(
            solution.solidity, program.volume(solution.solidity), proof, method, evidence,
            error_estimate=None if is_lower else _error_estimate(program, solution, self.drillable),
        )  # fmt: skip


FREE = Free()


def free_sizes(scene: Scene, criterion: Criterion, force: float, x: Array) -> Array:
    """Return the maximum bore of a pin or the minimum outer diameter of a bushing [m] at positions ``x`` for a force
    [N]: the paper's figure 5. No limits on wall and deflection; NaN where infeasible."""
    loaded = scene if force == scene.force else replace(scene, force=force)
    return design_variable_of(scene).sizes(least_walls_at(loaded, criterion, 0.0, x))
