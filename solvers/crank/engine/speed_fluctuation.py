"""Summed torque of all cylinders, and the speed fluctuation at nearly constant speed (irregularity below 0.1).

The work of one cylinder's torque above its mean, since the start of the cycle, is

    w(phi) = W_gas(phi) - M_mean phi - m_j v^2/2 + Delta J (omega beta')^2/2, W_gas = A int (p - p_0) dx:

the masses do no net work, so the mean torque is that of the gas, whose work is in closed form for cubics of the volume
and by Gauss quadrature for those of the angle. The speed has its extremes where the summed torque
crosses its mean.

Source: any text on engine balance, e.g. C. F. Taylor, The Internal Combustion Engine in Theory and Practice II; the
flywheel from the work between the speed's extremes, Delta W = J omega^2 delta.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.crank.cycle.forces import Cycle, Machine, kinetic_energy
from solvers.crank.cycle.group import CylinderGroup
from solvers.crank.cycle.worst_instants import SUBINTERVALS, instant_of
from solvers.crank.gas.unrolled_pressure import Unrolled, piece_of, pressure_of, volume_of, work_at, wrapped
from solvers.crank.motion.slider_crank import angle_functions
from solvers.numerics.arrays import Array
from solvers.numerics.jit import inlined_kernel, kernel

_MAX_ROUNDS = 60
_FEW, _LONG_CRANK = 5, 0.6
_RULES = 0.5 * np.concatenate([np.polynomial.legendre.leggauss(n) for n in (_FEW, 10)], axis=1)
"""Gauss rules of half the interval (-1, 1): of five nodes, which integrate a piece to rounding if the crank is at most
0.6 rods long, and of ten, which do so up to the shortest rod that can turn."""


@dataclass(frozen=True)
class SpeedFluctuation:
    """The work [J] between the extremes of the speed, and the resulting speed fluctuation.

    ``irregularity`` is (omega_max - omega_min)/omega for the existing inertia, None without any;
    ``torque_irregularity`` is (M_max - M_min)/M_mean, None for a mean torque of zero.
    """

    work_fluctuation: float
    inertia: float
    irregularity: float | None
    torque_max: float
    torque_min: float
    torque_mean: float
    torque_irregularity: float | None
    flywheel_inertia_wanted: float | None


@inlined_kernel
def work_since_break(angle: float, k: int, machine: Machine, gas: Unrolled) -> float:
    """Return the gas work [J] from the start of piece ``k`` to an angle of it."""
    start, geometry = gas.breaks[k], machine.geometry
    if gas.by_volume:
        first = volume_of(angle_functions(start, gas.geometry), gas)
        last = volume_of(angle_functions(angle, gas.geometry), gas)
        return work_at(last, k, gas) - work_at(first, k, gas) - machine.back_pressure * (last - first)
    total, few = 0.0, geometry.r + abs(geometry.offset) <= _LONG_CRANK * geometry.length
    for i in range(0 if few else _FEW, _FEW if few else _RULES.shape[1]):
        phi = start + (angle - start) * (0.5 + _RULES[0, i])
        at = angle_functions(phi, geometry)
        total += (
            _RULES[1, i] * (pressure_of(phi, at, k, gas) - machine.back_pressure) * (at.sine + at.cosine * at.tangent)
        )
    return total * (angle - start) * geometry.r * machine.area


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


@kernel
def _surplus_work(
    angle: float, n: int, machine: Machine, gas: Unrolled, group: CylinderGroup, before: Array
) -> float:  # fmt: skip
    """Return the sum of all cylinders' w at a shaft angle of the group's piece ``n`` [J], from the gas work ``before``
    each break."""
    total, mean = 0.0, before[-1] / (gas.breaks[-1] - gas.breaks[0])
    for cylinder in range(group.shift.shape[1]):
        phi, k = angle + group.shift[n, cylinder], group.piece[n, cylinder]
        if k < 0:
            phi = wrapped(phi, gas.breaks)
            k = piece_of(phi, gas.breaks)
        at = angle_functions(phi, machine.geometry)
        total += before[k] + work_since_break(phi, k, machine, gas) - mean * phi
        total -= kinetic_energy(at, machine)
    return total


@kernel
def work_extremes(
    machine: Machine, gas: Unrolled, group: CylinderGroup, places: Array, torque: Array, before: Array, tolerance: float
) -> tuple[float, float]:
    """Return the difference of the extremes of the summed w, and its error [J].

    ``torque`` is the summed torque at the ``places``, SUBINTERVALS + 1 per piece. A crossing of the mean between two
    samples of a piece is bisected until the work between its two sides is small; one at a break is the break.
    """
    cylinders = group.shift.shape[1]
    mean, magnitude = cylinders * before[-1] / (gas.breaks[-1] - gas.breaks[0]), 0.0
    for i in range(places.size - 1):
        magnitude += abs(torque[i] - mean) * (places[i + 1] - places[i])
    greatest, least, error, previous = -np.inf, np.inf, 0.0, torque[-1] - mean
    for i in range(places.size):
        excess, angle, n = torque[i] - mean, places[i], i // (SUBINTERVALS + 1)
        if (previous > 0.0) != (excess > 0.0):
            if i % (SUBINTERVALS + 1) > 0:
                low, high = places[i - 1], angle
                for _ in range(_MAX_ROUNDS):
                    angle, found = 0.5 * (low + high), -mean
                    for cylinder in range(cylinders):
                        at = instant_of(angle, n, cylinder, machine, gas, group)
                        found += at.tangential * machine.geometry.r
                    missed = abs(found) * (high - low)
                    if missed <= tolerance * magnitude:
                        break
                    low, high = (low, angle) if (found > 0.0) == (excess > 0.0) else (angle, high)
                error = max(error, missed)
            surplus = _surplus_work(angle, n, machine, gas, group, before)
            greatest, least = max(greatest, surplus), min(least, surplus)
        previous = excess
    return max(greatest - least, 0.0), 2.0 * error


def speed_fluctuation_of(
    cycle: Cycle, gas_work: float, gas_work_error: float, work_fluctuation: float, torque_max: float, torque_min: float
) -> SpeedFluctuation:
    """Return the speed fluctuation and the flywheel inertia required for the wanted irregularity, from one cylinder's
    gas work [J] and its error, the work between the extremes of the speed [J] and those of the summed torque [N m]."""
    engine, speed, masses = cycle.engine, cycle.machine.speed, cycle.scene.masses
    # J of flywheel, throws, and the rods' shares at the crank pins; a single cylinder with two rods turns both.
    flywheel_inertia, radius, rods = cycle.scene.engine.flywheel_inertia, cycle.motion.crank_radius, masses.rods_per_pin
    throws = max(len(cycle.scene.engine.phases) // rods, 1)
    inertia = flywheel_inertia + throws * (masses.throw.inertia(radius) + rods * masses.rod.at_crank_pin * radius**2)
    per_work = len(engine.phases) / cycle.scene.cylinder.period
    mean_torque, wanted = per_work * gas_work, engine.wanted_irregularity
    torque_irregularity = flywheel = None
    if abs(mean_torque) > per_work * gas_work_error:
        torque_irregularity = (torque_max - torque_min) / abs(mean_torque)
    if wanted is not None:
        flywheel = max(work_fluctuation / (wanted * speed**2) - (inertia - engine.flywheel_inertia), 0.0)
    return SpeedFluctuation(
        work_fluctuation=work_fluctuation,
        inertia=inertia,
        irregularity=work_fluctuation / (inertia * speed**2) if inertia > 0 else None,
        torque_max=torque_max,
        torque_min=torque_min,
        torque_mean=mean_torque,
        torque_irregularity=torque_irregularity,
        flywheel_inertia_wanted=flywheel,
    )
