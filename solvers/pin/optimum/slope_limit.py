"""Slope-limited diameters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.pin.optimum.program import Program
from solvers.pin.stations.between_nodes import overlooked

Array = NDArray[np.float64]


def gentle(program: Program, low: Array) -> Array:
    """Return the least u above ``low`` that satisfies the slope limit, exactly, in two sweeps.

    The thickness T = D - d has the slope of the sought diameter: T(x) = max over y of T_min(y) - s |x - y|.
    """
    slope, sought = program.limits.max_slope, program.sought
    if slope is None:
        return low
    thick, reach = sought.unit_diameter * sought.wall_of(low), slope * program.stations.x
    forward = np.maximum.accumulate(thick + reach) - reach
    backward = np.maximum.accumulate((thick - reach)[::-1])[::-1] + reach
    return np.maximum(low, sought.solidity_of(np.maximum(forward, backward) / sought.unit_diameter))


def missed_by_slope(program: Program, low: Array) -> Array:
    """Return the volume underestimated between stations by a slope-limited shape, per panel."""
    stations, slope, sought = program.stations, program.limits.max_slope, program.sought
    thick, reach = sought.unit_diameter * sought.wall_of(low), slope * stations.x
    missed = overlooked(stations, thick + reach) + overlooked(stations, thick - reach, forward=False)
    return sought.growth(float(thick.max())) * missed
