"""Bores that change no faster than a slope limit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.pin.optimum.program import Program
from solvers.pin.section.variables import solidity_of, wall_of
from solvers.pin.stations.lobatto_panels import Stations

Array = NDArray[np.float64]


def bore_of(program: Program, solidity: Array) -> Array:
    """A pin's bore d = D (1 - w) [m] of u."""
    return program.scene.geometry.outer_diameter * (1.0 - wall_of(solidity))


def gentle(program: Program, low: Array) -> Array:
    """The least u above ``low`` whose bore changes no faster than the slope limit: two sweeps, exact."""
    slope, x = program.limits.max_slope, program.stations.x
    if slope is None:
        return low
    diameter = program.scene.geometry.outer_diameter
    bore = bore_of(program, low)
    reach = slope * x
    # d(x) = min over y of d_max(y) + s |x - y|.
    forward = np.minimum.accumulate(bore - reach) + reach
    backward = np.minimum.accumulate((bore + reach)[::-1])[::-1] - reach
    wall = 1.0 - np.minimum(forward, backward) / diameter
    return np.maximum(low, solidity_of(wall))


def missed_by_slope(stations: Stations, diameter: Array, slope: float) -> Array:
    """What a diameter (a bushing's, or a bore with its sign turned) of limited slope misses between stations."""
    reach = slope * stations.x
    return stations.overlooked(diameter + reach) + stations.overlooked(diameter - reach, forward=False)
