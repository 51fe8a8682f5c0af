"""The work of the gas over a cycle: in closed form for cubics of the volume, by Gauss quadrature for those of the
angle."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solvers.crank.cycle.forces import Machine
from solvers.crank.gas.unrolled_pressure import Unrolled, pressure_of, work_at
from solvers.crank.motion.slider_crank import angle_functions, displacement_of
from solvers.numerics.arrays import Array
from solvers.numerics.jit import inlined_kernel, kernel

_MIN_NODES, _MAX_NODES = 2, 64
_RULES = np.concatenate([np.stack(np.polynomial.legendre.leggauss(2**k)) for k in range(1, 7)], axis=1)
_RULES = 0.5 * (_RULES + np.array([[1.0], [0.0]]))
"""Gauss rules on (0, 1) of 2, 4, …, 64 nodes, concatenated: the rule of n nodes starts at n - 2."""
_ROUNDING = 4.0 * np.finfo(float).eps
MIN_MEAN_FRACTION = 1e-4
"""Minimum reference of a mean's relative error, as a fraction of the mean magnitude."""


class GasWork(NamedTuple):
    """The gas work [J] from the start of the cycle to every break, its absolute error, the sum of its magnitudes,
    and the number of Gauss nodes (0: closed form)."""

    before: Array
    error: float
    magnitude: float
    nodes: int


@kernel
def gas_work(machine: Machine, gas: Unrolled, tolerance: float, reference: float) -> GasWork:
    """Compute the gas work, doubling the nodes until converged.

    ``tolerance`` is relative to the work of the cycle, or to ``reference`` [J] if that is less.
    """
    nodes = 0 if gas.by_volume else _MIN_NODES
    before, magnitude = _gas_work(machine, gas, nodes)
    error = 0.0
    while 0 < nodes < _MAX_NODES:
        nodes, coarse = 2 * nodes, before
        before, magnitude = _gas_work(machine, gas, nodes)
        error = np.abs(before - coarse).max()
        if error <= tolerance * min(max(abs(before[-1]), MIN_MEAN_FRACTION * magnitude), reference):
            break
    return GasWork(before, error + _ROUNDING * magnitude, magnitude, nodes)


@kernel
def _gas_work(machine: Machine, gas: Unrolled, nodes: int) -> tuple[Array, float]:
    """Return the work before every break, and the sum of the pieces' magnitudes."""
    before, magnitude, compensation = np.zeros(gas.breaks.size), 0.0, 0.0
    for k in range(gas.stroke.size):
        piece_work = work_since_break(gas.breaks[k + 1], k, machine, gas, nodes)
        magnitude += abs(piece_work)
        # Compensated (Kahan) summation.
        piece_work -= compensation
        before[k + 1] = before[k] + piece_work
        compensation = (before[k + 1] - before[k]) - piece_work
    return before, magnitude


@inlined_kernel
def work_since_break(angle: float, k: int, machine: Machine, gas: Unrolled, nodes: int) -> float:
    """Return the gas work [J] from the start of piece ``k`` to an angle of it."""
    start = gas.breaks[k]
    if gas.by_volume:
        first, last = _volume(start, gas), _volume(angle, gas)
        return work_at(last, k, gas) - work_at(first, k, gas) - machine.back_pressure * (last - first)
    total, rule = 0.0, nodes - _MIN_NODES
    for i in range(rule, rule + nodes):
        phi = start + (angle - start) * _RULES[0, i]
        at_phi = angle_functions(phi, machine.geometry)
        pressure = pressure_of(phi, at_phi, k, gas) - machine.back_pressure
        total += _RULES[1, i] * pressure * (at_phi.sine + at_phi.cosine * at_phi.tangent)
    return total * (angle - start) * machine.geometry.r * machine.area


@inlined_kernel
def _volume(phi: float, gas: Unrolled) -> float:
    return gas.clearance + gas.area * displacement_of(angle_functions(phi, gas.geometry), gas.geometry)
