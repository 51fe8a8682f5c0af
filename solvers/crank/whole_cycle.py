"""Maximum loads, torque, work and speed fluctuation of a cycle in one compiled call.

Passing pressures to a kernel takes longer than many a single evaluation; one call passes them only once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solvers.crank.cycle.forces import LONGEST_PIECE, Machine
from solvers.crank.cycle.group import together
from solvers.crank.cycle.loads import LOADS
from solvers.crank.cycle.worst_instants import BRIX, OF_THE_ROD, TORQUE, Greatest, climbed, sampled
from solvers.crank.engine.gas_work import CANCELLED, gas_work
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

    loads: Greatest
    shaft: ShaftWork
    error: float
    pieces: int


@kernel
def whole_cycle(machine: Machine, curve: Unrolled, sharp: Array, phases: Array, tolerance: float) -> WholeCycle:
    """Analyse one cylinder, and those with these ``phases`` [rad] together, to the relative ``tolerance``.

    ``sharp``: angles [rad] at which pieces are divided (``Cycle.sharp_angles``).
    """
    gas, single = refined(curve, sharp, LONGEST_PIECE), phases.size == 1
    group = together(gas, np.zeros(1))
    places, samples = sampled(machine, gas, group, 0, BRIX if single else TORQUE)
    loads = climbed(machine, gas, group, 0, places, samples, tolerance)
    torque = loads
    if not single:
        group = together(gas, phases)
        places, samples = sampled(machine, gas, group, TORQUE, BRIX - TORQUE)
        torque = climbed(machine, gas, group, TORQUE, places, samples, tolerance)
    crossing, least = _CROSSING_TOLERANCE * tolerance, np.inf
    for _ in range(2):
        work = gas_work(machine, gas, tolerance, least)
        high, low, missed = work_extremes(machine, gas, group, places, samples[-2], work, crossing)
        swing, error = max(high - low, 0.0), 2.0 * (missed + phases.size * work.error)
        if not error > tolerance * swing > 0.0:
            break
        # The summed work of all cylinders may fluctuate far less than that of one.
        least = swing / (4.0 * phases.size)
    shaft = ShaftWork(
        work.before[-1], work.error, work.magnitude, torque.value[-2], -torque.value[-1],
        max(torque.error[-2], torque.error[-1]), swing, error, work.nodes,
    )  # fmt: skip
    return WholeCycle(loads, shaft, max(_load_error(loads), _shaft_error(shaft)), gas.stroke.size)


@kernel
def _load_error(loads: Greatest) -> float:
    """Return the maximum relative error of the loads."""
    most, rod = 0.0, CANCELLED * np.abs(loads.value[OF_THE_ROD]).max()
    for i in range(len(LOADS)):
        scale = abs(loads.value[i])
        if OF_THE_ROD.start <= i < OF_THE_ROD.stop:
            scale = max(scale, rod)
        most = max(most, loads.error[i] / scale if scale > 0.0 else loads.error[i])
    return most


@kernel
def _shaft_error(shaft: ShaftWork) -> float:
    """Return the maximum relative error of mean torque, work between the extremes of the speed, and torque extremes."""
    whole, torque = (
        max(abs(shaft.whole), CANCELLED * shaft.magnitude),
        max(abs(shaft.torque_max), abs(shaft.torque_min)),
    )
    return max(
        shaft.error / whole if whole > 0.0 else 0.0,
        shaft.fluctuation_error / shaft.fluctuation if shaft.fluctuation > 0.0 else 0.0,
        shaft.torque_error / torque if torque > 0.0 else 0.0,
    )
