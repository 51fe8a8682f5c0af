"""The work of the gas over a cycle: in closed form for cubics of the volume, by Gauss quadrature for those of the
angle."""

from __future__ import annotations

import numpy as np

from solvers.crank.cycle.forces import Machine
from solvers.crank.gas.unrolled_pressure import Unrolled, pressure_of, work_at
from solvers.crank.motion.slider_crank import angle_functions, displacement_of
from solvers.numerics.arrays import Array
from solvers.numerics.jit import inlined_kernel, kernel

_FEW, _LONG_CRANK = 5, 0.6
_RULES = 0.5 * np.concatenate([np.polynomial.legendre.leggauss(n) for n in (_FEW, 10)], axis=1)
"""Gauss rules of half the interval (-1, 1): of five nodes, which integrate a piece to rounding if the crank is at most
0.6 rods long, and of ten, which do so up to the shortest rod that can turn."""


@inlined_kernel
def work_since_break(angle: float, k: int, machine: Machine, gas: Unrolled) -> float:
    """Return the gas work [J] from the start of piece ``k`` to an angle of it."""
    start, geometry = gas.breaks[k], machine.geometry
    if gas.by_volume:
        first, last = _volume(start, gas), _volume(angle, gas)
        return work_at(last, k, gas) - work_at(first, k, gas) - machine.back_pressure * (last - first)
    total, few = 0.0, geometry.r + abs(geometry.offset) <= _LONG_CRANK * geometry.length
    for i in range(0 if few else _FEW, _FEW if few else _RULES.shape[1]):
        phi = start + (angle - start) * (0.5 + _RULES[0, i])
        at = angle_functions(phi, geometry)
        total += (
            _RULES[1, i] * (pressure_of(phi, at, k, gas) - machine.back_pressure) * (at.sine + at.cosine * at.tangent)
        )
    return total * (angle - start) * geometry.r * machine.area


@inlined_kernel
def _volume(phi: float, gas: Unrolled) -> float:
    return gas.clearance + gas.area * displacement_of(angle_functions(phi, gas.geometry), gas.geometry)


@kernel
def work_at_breaks(machine: Machine, gas: Unrolled) -> tuple[Array, float]:
    """Return the gas work [J] from the start of the cycle to every break, and the sum of the pieces' magnitudes."""
    before, magnitude, compensation = np.zeros(gas.breaks.size), 0.0, 0.0
    for k in range(gas.stroke.size):
        work = work_since_break(gas.breaks[k + 1], k, machine, gas)
        magnitude += abs(work)
        # Compensated (Kahan) summation.
        work -= compensation
        before[k + 1] = before[k] + work
        compensation = (before[k + 1] - before[k]) - work
    return before, magnitude
