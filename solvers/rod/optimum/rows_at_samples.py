"""Rows of a strip from samples at its peaks, whatever the physics: each peak is a parabola through three samples."""

from __future__ import annotations

import math

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.rod.rows import BUCKLED, POWER, PRESSURE, SIDE, STRESS, UTILISATION

_MAX_OFFSET = 1.0
"""Distance of a parabola's vertex from the middle sample, in steps, up to which it is a peak."""
_SMALLEST, _GREATEST = 1e-300, 1e300


@kernel
def peak_height(left: float, middle: float, right: float) -> float:
    """Maximum of the parabola through three samples if its vertex lies near them, otherwise the maximum sample."""
    concavity = 2.0 * middle - left - right
    slope = 0.5 * (right - left)
    if concavity > 0.0 and abs(slope) <= _MAX_OFFSET * concavity:
        return middle + 0.5 * slope * slope / concavity
    return max(middle, max(left, right))


@kernel
def finite_log(value: float) -> float:
    """ln value; finite for 0 and for unbounded values."""
    return math.log(min(max(value, _SMALLEST), _GREATEST))


@kernel
def set_buckled_rows(out: Array) -> None:
    """Set the rows that are meaningless for a buckled strip."""
    for r in range(STRESS, out.size):
        out[r] = BUCKLED
    out[UTILISATION] = out[SIDE] = out[PRESSURE] = out[POWER] = BUCKLED


@kernel
def reaction_rows(reactions: Array, per_force: float, row: int, out: Array) -> None:
    """Set the rows of side force and contact pressure, and their parts from ``row`` on.

    ``reactions`` [N] has shape (2, angles), the angles in stencils; ``per_force`` [1/m^2] is the pressure per force.
    """
    side, pressure = 0.0, 0.0
    for i in range(0, reactions.shape[1], 3):
        side_peak = peak_height(reactions[0, i], reactions[0, i + 1], reactions[0, i + 2])
        pressure_peak = per_force * peak_height(reactions[1, i], reactions[1, i + 1], reactions[1, i + 2])
        side, pressure = max(side, side_peak), max(pressure, pressure_peak)
        out[row], out[row + 1] = finite_log(side_peak), finite_log(pressure_peak)
        row += 2
    if reactions.shape[1] > 0:
        out[SIDE], out[PRESSURE] = finite_log(side), finite_log(pressure)
