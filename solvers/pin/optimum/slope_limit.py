"""Profiles whose diameter varies at most with a given slope."""

from __future__ import annotations

import numpy as np

from solvers.numerics.arrays import Array
from solvers.pin.optimum.program import Program
from solvers.pin.stations.between_nodes import running_maximum_error


def slope_limited(program: Program, low: Array) -> Array:
    """Return the least u >= ``low`` that satisfies the slope limit, exactly, by a forward and a backward sweep.

    The thickness T = D - d has the slope of the unknown diameter: T(x) = max over y of T_min(y) - s |x - y|.
    """
    slope, variable = program.limits.max_slope, program.variable
    if slope is None:
        return low
    thick, ramp = variable.unit_diameter * variable.wall_of(low), slope * program.stations.x
    forward = np.maximum.accumulate(thick + ramp) - ramp
    backward = np.maximum.accumulate((thick - ramp)[::-1])[::-1] + ramp
    return np.maximum(low, variable.solidity_of(np.maximum(forward, backward) / variable.unit_diameter))


def slope_limit_error(program: Program, low: Array) -> Array:
    """Return the volume error of a slope-limited shape due to maxima of ``low`` between stations, per panel."""
    stations, slope, variable = program.stations, program.limits.max_slope, program.variable
    thick, ramp = variable.unit_diameter * variable.wall_of(low), slope * stations.x
    error = running_maximum_error(stations, thick + ramp)
    error = error + running_maximum_error(stations, thick - ramp, forward=False)
    return variable.max_derivative(float(thick.max())) * error
