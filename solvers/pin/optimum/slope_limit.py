"""Slope-limited diameters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.pin.optimum.program import Program
from solvers.pin.section.variables import wall_of

Array = NDArray[np.float64]


def bore_of(program: Program, solidity: Array) -> Array:
    """Return a pin's bore d = D (1 - w) [m] of u."""
    return program.scene.geometry.outer_diameter * (1.0 - wall_of(solidity))


def gentle(program: Program, low: Array) -> Array:
    """Return the least u above ``low`` that satisfies the slope limit, exactly, in two sweeps.

    The thickness T = D - d has the slope of the sought diameter: T(x) = max over y of T_min(y) - s |x - y|.
    """
    slope, sought = program.limits.max_slope, program.sought
    if slope is None:
        return low
    thick, reach = sought.thickness(sought.wall_of(low)), slope * program.stations.x
    forward = np.maximum.accumulate(thick + reach) - reach
    backward = np.maximum.accumulate((thick - reach)[::-1])[::-1] + reach
    return np.maximum(low, sought.solidity_of(sought.relative(np.maximum(forward, backward))))


def missed_by_slope(program: Program, low: Array) -> Array:
    """Return the volume underestimated between stations by a slope-limited shape, per panel."""
    stations, slope, sought = program.stations, program.limits.max_slope, program.sought
    thick, reach = sought.thickness(sought.wall_of(low)), slope * stations.x
    missed = stations.overlooked(thick + reach) + stations.overlooked(thick - reach, forward=False)
    return sought.growth(float(thick.max())) * missed
