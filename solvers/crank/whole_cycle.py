"""Maximum loads, torque, work and speed fluctuation of a cycle in one compiled call.

Passing pressures to a kernel takes longer than many a single evaluation; one call passes them only once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solvers.crank.cycle.forces import LONGEST_PIECE, Machine
from solvers.crank.cycle.group import cylinder_group
from solvers.crank.cycle.loads import LOADS
from solvers.crank.cycle.worst_instants import BRIX, ROD_ROWS, TORQUE, Maxima, refined_maxima, sampled_rows
from solvers.crank.engine.gas_work import MIN_MEAN_FRACTION, gas_work
from solvers.crank.engine.speed_fluctuation import ShaftWork, work_extremes
from solvers.crank.gas.unrolled_pressure import Unrolled, refined
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel

_CROSSING_TOLERANCE = 1e-2
"""Tolerance of crossings of the mean torque relative to that of the work, which is stationary there."""


class WholeCycle(NamedTuple):
    """Results of a cycle.

    The loads of one cylinder (``LOADS``), the effect on the shaft, the maximum relative error, and the
    number of pieces evaluated.
    """

    loads: Maxima
    shaft: ShaftWork
    error: float
    pieces: int


@kernel
def whole_cycle(machine: Machine, curve: Unrolled, extra_breaks: Array, phases: Array, tolerance: float) -> WholeCycle:
    """Analyse one cylinder, and those with these ``phases`` [rad] together, to the relative ``tolerance``.

    ``extra_breaks``: angles [rad] at which pieces are divided (``Cycle.sharp_angles``).
    """
    gas, single = refined(curve, extra_breaks, LONGEST_PIECE), phases.size == 1
    group = cylinder_group(gas, np.zeros(1))
    places, samples = sampled_rows(machine, gas, group, 0, BRIX if single else TORQUE)
    loads = refined_maxima(machine, gas, group, 0, places, samples, tolerance)
    torque = loads
    if not single:
        group = cylinder_group(gas, phases)
        places, samples = sampled_rows(machine, gas, group, TORQUE, BRIX - TORQUE)
        torque = refined_maxima(machine, gas, group, TORQUE, places, samples, tolerance)
    crossing, reference = _CROSSING_TOLERANCE * tolerance, np.inf
    for _ in range(2):
        work = gas_work(machine, gas, tolerance, reference)
        work_max, work_min, search_error = work_extremes(machine, gas, group, places, samples[-2], work, crossing)
        fluctuation, error = max(work_max - work_min, 0.0), 2.0 * (search_error + phases.size * work.error)
        if not error > tolerance * fluctuation > 0.0:
            break
        # The summed work of all cylinders may fluctuate far less than that of one.
        reference = fluctuation / (4.0 * phases.size)
    shaft = ShaftWork(
        work.before[-1], work.error, work.magnitude, torque.value[-2], -torque.value[-1],
        max(torque.error[-2], torque.error[-1]), fluctuation, error, work.nodes,
    )  # fmt: skip
    return WholeCycle(loads, shaft, max(_load_error(loads), _shaft_error(shaft)), gas.stroke.size)


@kernel
def _load_error(loads: Maxima) -> float:
    """Return the maximum relative error of the loads."""
    largest, rod = 0.0, MIN_MEAN_FRACTION * np.abs(loads.value[ROD_ROWS]).max()
    for i in range(len(LOADS)):
        scale = abs(loads.value[i])
        if ROD_ROWS.start <= i < ROD_ROWS.stop:
            scale = max(scale, rod)
        largest = max(largest, loads.error[i] / scale if scale > 0.0 else loads.error[i])
    return largest


@kernel
def _shaft_error(shaft: ShaftWork) -> float:
    """Return the maximum relative error of mean torque, work between the extremes of the speed, and torque extremes."""
    mean_work, torque = (
        max(abs(shaft.gas_work), MIN_MEAN_FRACTION * shaft.magnitude),
        max(abs(shaft.torque_max), abs(shaft.torque_min)),
    )
    return max(
        shaft.error / mean_work if mean_work > 0.0 else 0.0,
        shaft.fluctuation_error / shaft.fluctuation if shaft.fluctuation > 0.0 else 0.0,
        shaft.torque_error / torque if torque > 0.0 else 0.0,
    )
