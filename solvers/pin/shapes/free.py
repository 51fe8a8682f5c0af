"""Forms with an independent wall at every station: free, drillable, slope-limited."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from solvers.pin.optimum.conic import sloped
from solvers.pin.optimum.dual_bound import least_walls_bound, monotone_bound, pointwise_bound
from solvers.pin.optimum.found import Found
from solvers.pin.optimum.lagrangian import weigh
from solvers.pin.optimum.program import Program, Weighed, rising
from solvers.pin.optimum.slope_limit import gentle, missed_by_slope
from solvers.pin.stations.between_nodes import overlooked
from solvers.pin.stations.lobatto_panels import Stations

Array = NDArray[np.float64]
_STRENGTH_METHOD, _DUAL_METHOD = (
    "every station's wall is the least that holds",
    "Lagrangian dual, tangents at the answer",
)


def missed_by_order(stations: Stations, lower: Array, anchor: int) -> Array:
    """Return the underestimate between stations of values non-decreasing toward the middle, per panel."""
    first = np.arange(lower.size) < anchor
    most = float(lower.max()) + 1.0
    missed = overlooked(stations, np.where(first, lower, most))
    if anchor < lower.size:
        missed = missed + overlooked(stations, np.where(first, most, lower), forward=False)
    return missed


def _missed(program: Program, drillable: bool) -> Array:
    """Return the volume underestimated between stations by a drillable or slope-limited shape, per panel."""
    missed, low = np.zeros(program.stations.left.size), program.lower
    if drillable:
        missed, low = missed_by_order(program.stations, low, program.anchor), rising(low, program.anchor)
    if program.limits.max_slope is not None:
        missed = missed + missed_by_slope(program, low)
    return missed


def _doubt(program: Program, weighed: Weighed, drillable: bool) -> Array:
    """Return the error estimate of the volume per panel, including that of the deflection times its multiplier."""
    doubt = program.stations.doubt(weighed.solidity) + _missed(program, drillable)
    if program.limit is not None and 0.0 < weighed.multiplier < math.inf:
        density = program.densities(weighed.solidity)
        doubt = doubt + weighed.multiplier / program.limit * program.stations.doubt(density)
    return doubt


@dataclass(frozen=True)
class Free:
    """Arbitrary wall; ``drillable``: the bore must not widen, or the outer diameter shrink, toward the middle."""

    drillable: bool = False

    @property
    def name(self) -> str:
        return "drillable" if self.drillable else "free"

    def find(self, program: Program, gap: float) -> Found | None:
        """See ``solvers.pin.optimum.found``."""
        low = rising(program.lower, program.anchor) if self.drillable else program.lower
        low = gentle(program, low)
        if (
            program.limits.max_slope is not None
            and program.limit is not None
            and program.deflection(low) > program.limit
        ):
            return sloped(program, low, self.drillable, gap)
        weighed = weigh(program, low, self.drillable)
        if weighed is None:
            return None
        if weighed.multiplier == 0.0:
            proof, method = partial(least_walls_bound, program, low), _STRENGTH_METHOD
        else:
            bound = monotone_bound if self.drillable else pointwise_bound
            proof, method = partial(bound, program, low, weighed.multiplier, weighed.solidity), _DUAL_METHOD
        evidence = {
            "multiplier": weighed.multiplier if math.isfinite(weighed.multiplier) else "unbounded: only the solid span",
            "rounds": weighed.rounds,
        }
        return Found(
            weighed.solidity, program.volume(weighed.solidity), proof, method, evidence,
            doubt=_doubt(program, weighed, self.drillable),
        )  # fmt: skip


FREE = Free()
