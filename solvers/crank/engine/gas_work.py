"""The work of the gas over a cycle: in closed form for cubics of the volume, by Gauss quadrature for those of the
angle."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solvers.crank.cycle.forces import Machine
from solvers.crank.gas.unrolled_pressure import Unrolled, pressure_of, work_at
from solvers.crank.motion.slider_crank import displacement_of, stand_at
from solvers.numerics.arrays import Array
from solvers.numerics.jit import inlined_kernel, kernel

_MIN_NODES, _MAX_NODES = 2, 64
_RULES = np.concatenate([np.stack(np.polynomial.legendre.leggauss(2**k)) for k in range(1, 7)], axis=1)
_RULES = 0.5 * (_RULES + np.array([[1.0], [0.0]]))
"""Gauss rules on (0, 1) of 2, 4, …, 64 nodes, concatenated: the rule of n nodes starts at n - 2."""
_ROUNDING = 4.0 * np.finfo(float).eps
CANCELLED = 1e-4
"""Minimum scale of a mean's relative error, as a fraction of its mean magnitude."""


class GasWork(NamedTuple):
    """The gas work [J] from the start of the cycle to every break, its absolute error, the sum of its magnitudes,
    and the number of Gauss nodes (0: closed form)."""

    before: Array
    error: float
    magnitude: float
    nodes: int


@kernel
def gas_work(machine: Machine, gas: Unrolled, tolerance: float, least: float) -> GasWork:
    """Compute the gas work, doubling the nodes until converged.

    ``tolerance`` is relative to the work of the cycle, or to ``least`` [J] if that is less.
    """
    nodes = 0 if gas.by_volume else _MIN_NODES
    before, magnitude = _gas_work(machine, gas, nodes)
    error = 0.0
    while 0 < nodes < _MAX_NODES:
        nodes, coarse = 2 * nodes, before
        before, magnitude = _gas_work(machine, gas, nodes)
        error = np.abs(before - coarse).max()
        if error <= tolerance * min(max(abs(before[-1]), CANCELLED * magnitude), least):
            break
    return GasWork(before, error + _ROUNDING * magnitude, magnitude, nodes)


@kernel
def _gas_work(machine: Machine, gas: Unrolled, nodes: int) -> tuple[Array, float]:
    """Return the work before every break, and the sum of the pieces' magnitudes."""
    before, magnitude, lost = np.zeros(gas.breaks.size), 0.0, 0.0
    for k in range(gas.stroke.size):
        done = work_since_break(gas.breaks[k + 1], k, machine, gas, nodes)
        magnitude += abs(done)
        # Compensated (Kahan) summation.
        done -= lost
        before[k + 1] = before[k] + done
        lost = (before[k + 1] - before[k]) - done
    return before, magnitude


@inlined_kernel
def work_since_break(angle: float, k: int, machine: Machine, gas: Unrolled, nodes: int) -> float:
    """Return the gas work [J] from the start of piece ``k`` to an angle of it."""
    start = gas.breaks[k]
    if gas.by_volume:
        first, last = _volume(start, gas), _volume(angle, gas)
        return work_at(last, k, gas) - work_at(first, k, gas) - machine.back * (last - first)
    total, rule = 0.0, nodes - _MIN_NODES
    for i in range(rule, rule + nodes):
        phi = start + (angle - start) * _RULES[0, i]
        at_phi = stand_at(phi, machine.frame)
        gained = pressure_of(phi, at_phi, k, gas) - machine.back
        total += _RULES[1, i] * gained * (at_phi.sine + at_phi.cosine * at_phi.tangent)
    return total * (angle - start) * machine.frame.r * machine.area


@inlined_kernel
def _volume(phi: float, gas: Unrolled) -> float:
    return gas.clearance + gas.area * displacement_of(stand_at(phi, gas.frame), gas.frame)
