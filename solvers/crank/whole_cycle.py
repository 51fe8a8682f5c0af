"""Maximum loads, torque, work and speed fluctuation of a cycle in one compiled call.

Passing pressures to a kernel takes longer than many a single evaluation; one call passes them only once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solvers.crank.cycle.forces import LONGEST_PIECE, Machine
from solvers.crank.cycle.group import cylinder_group
from solvers.crank.cycle.worst_instants import BRIX, ROWS, TORQUE, Maxima, refined_maxima, sampled_rows
from solvers.crank.engine.speed_fluctuation import work_at_breaks, work_extremes
from solvers.crank.gas.unrolled_pressure import Unrolled, refined
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel

_CROSSING_TOLERANCE = 1e-2
"""Tolerance of crossings of the mean torque relative to that of the work, which is stationary there."""
_COMPRESSION, _TENSION = 1, 2
_MIN_FRACTION = 1e-4
"""Minimum reference of relative errors: of the mean torque as a fraction of its magnitude, of the rod's tension and
compression as a fraction of the larger one."""
_ROUNDING = 4.0 * np.finfo(float).eps


class WholeCycle(NamedTuple):
    """Results of a cycle.

    The loads of one cylinder (``LOADS``) and the error of Brix's pressure; the loads of crank pin and bearing from the
    two rods on one pin; of all cylinders together the maxima of the torque and its negative, and the work between the
    extremes of the speed [J]; one cylinder's gas work and its rounding error [J]; the maximum relative error; and the
    number of pieces.
    """

    loads: Maxima
    shared_pin: Maxima
    torque: Maxima
    fluctuation: float
    gas_work: float
    gas_work_error: float
    error: float
    pieces: int


@kernel
def whole_cycle(machine: Machine, curve: Unrolled, phases: Array, shared: bool, tolerance: float) -> WholeCycle:
    """Analyse one cylinder, those with these ``phases`` [rad] together and, if they are ``shared``, the first two on
    one crank pin, to the relative ``tolerance``."""
    gas, single = refined(curve, LONGEST_PIECE), phases.size == 1
    group = cylinder_group(gas, np.zeros(1))
    places, samples = sampled_rows(machine, gas, group, True)
    loads = refined_maxima(machine, gas, group, places, samples, 0, ROWS if single else TORQUE, tolerance)
    torque = pins = loads
    if shared:
        group = cylinder_group(gas, phases[:2])
        places, samples = sampled_rows(machine, gas, group, False)
        pins = refined_maxima(machine, gas, group, places, samples, 0, 2, tolerance)
    if not single:
        group = cylinder_group(gas, phases)
        places, samples = sampled_rows(machine, gas, group, False)
        torque = refined_maxima(machine, gas, group, places, samples, 2, 4, tolerance)
    before, magnitude = work_at_breaks(machine, gas)
    crossing = _CROSSING_TOLERANCE * tolerance
    fluctuation, missed = work_extremes(machine, gas, group, places, samples[-2], before, crossing)
    work, work_error, highest = before[-1], _ROUNDING * magnitude, max(abs(torque.value[-2]), abs(torque.value[-1]))
    error, rod = 0.0, _MIN_FRACTION * max(abs(loads.value[_COMPRESSION]), abs(loads.value[_TENSION]))
    for i in range(BRIX):
        least = rod if i in (_COMPRESSION, _TENSION) else 0.0
        error = max(error, _relative(loads.error[i], abs(loads.value[i]), least))
    error = max(
        error,
        _relative(work_error, abs(work), _MIN_FRACTION * magnitude),
        _relative(missed + 2.0 * phases.size * work_error, fluctuation, 0.0),
        _relative(max(torque.error[-2], torque.error[-1]), highest, 0.0),
    )
    return WholeCycle(loads, pins, torque, fluctuation, work, work_error, error, gas.stroke.size)


@kernel
def _relative(error: float, value: float, least: float) -> float:
    """Return an error relative to a value or ``least``; the error itself if both are zero."""
    return error / max(value, least) if max(value, least) > 0.0 else error
