"""A cycle's greatest loads, torque, work and speed in one compiled call.

Handing pressures over to a kernel takes longer than many an analysis needs for one of its questions; asked all at
once, they are handed over but once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.crank.cycle.forces import LONGEST_PIECE, Cycle, Machine
from solvers.crank.cycle.worst_instants import TEXTBOOK, TORQUE, Greatest, alone, climbed, sampled
from solvers.crank.engine.cylinders import together
from solvers.crank.engine.speed_fluctuation import CANCELLED, ShaftWork, gas_work, work_extremes
from solvers.crank.gas.unrolled_pressure import Unrolled, refined
from solvers.crank.problem import LOADS, OF_THE_ROD
from solvers.crank.scene import Engine
from solvers.numerics.jit import kernel

Array = NDArray[np.float64]
_CLOSER = 1e-2
"""Of the tolerance, to which crossings of the mean torque are found: the work there is stationary."""


class WholeCycle(NamedTuple):
    """The ``loads`` of one cylinder (``problem.LOADS``), what the cycle does to the shaft, the greatest relative error
    of all of it, and the number of pieces it was looked at in."""

    loads: Greatest
    shaft: ShaftWork
    error: float
    pieces: int


def whole_cycle(cycle: Cycle, engine: Engine, tolerance: float) -> WholeCycle:
    """A cycle of one cylinder and of the ``engine``'s together, to the relative ``tolerance``."""
    return _whole_cycle(
        cycle.machine, cycle.curve.unrolled, cycle.sharp_angles, np.array(engine.phases), tolerance
    )  # fmt: skip


@kernel
def _whole_cycle(machine: Machine, curve: Unrolled, sharp: Array, phases: Array, tolerance: float) -> WholeCycle:
    gas, single = refined(curve, sharp, LONGEST_PIECE), phases.size == 1
    group = alone(gas)
    places, samples = sampled(machine, gas, group, 0, TEXTBOOK if single else TORQUE)
    loads = climbed(machine, gas, group, 0, places, samples, tolerance)
    torque = loads
    if not single:
        group = together(gas, phases)
        places, samples = sampled(machine, gas, group, TORQUE, TEXTBOOK - TORQUE)
        torque = climbed(machine, gas, group, TORQUE, places, samples, tolerance)
    work = gas_work(machine, gas, tolerance, np.inf)
    high, low, missed = work_extremes(machine, gas, group, places, samples[-2], work, _CLOSER * tolerance)
    swing, error = max(high - low, 0.0), 2.0 * (missed + phases.size * work.error)
    if error > tolerance * swing > 0.0:
        # All cylinders together may run much more evenly than one.
        work = gas_work(machine, gas, tolerance, swing / (4.0 * phases.size))
        high, low, missed = work_extremes(machine, gas, group, places, samples[-2], work, _CLOSER * tolerance)
        swing, error = max(high - low, 0.0), 2.0 * (missed + phases.size * work.error)
    shaft = ShaftWork(
        work.before[-1], work.error, work.magnitude, torque.value[-2], -torque.value[-1],
        max(torque.error[-2], torque.error[-1]), swing, error, work.nodes,
    )  # fmt: skip
    return WholeCycle(loads, shaft, max(_of_loads(loads), _of_shaft(shaft)), gas.stroke.size)


@kernel
def _of_loads(loads: Greatest) -> float:
    """The greatest relative error of the loads."""
    most, rod = 0.0, CANCELLED * np.abs(loads.value[OF_THE_ROD]).max()
    for i in range(len(LOADS)):
        scale = abs(loads.value[i])
        if OF_THE_ROD.start <= i < OF_THE_ROD.stop:
            scale = max(scale, rod)
        most = max(most, loads.error[i] / scale if scale > 0.0 else loads.error[i])
    return most


@kernel
def _of_shaft(shaft: ShaftWork) -> float:
    """The greatest relative error of mean torque, work between the extremes of the speed, and extremes of torque."""
    whole, torque = (
        max(abs(shaft.whole), CANCELLED * shaft.magnitude),
        max(abs(shaft.torque_max), abs(shaft.torque_min)),
    )
    return max(
        shaft.error / whole if whole > 0.0 else 0.0,
        shaft.fluctuation_error / shaft.fluctuation if shaft.fluctuation > 0.0 else 0.0,
        shaft.torque_error / torque if torque > 0.0 else 0.0,
    )
