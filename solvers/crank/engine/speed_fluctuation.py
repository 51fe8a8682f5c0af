"""Summed torque of all cylinders, and the fluctuation of the speed, taken as nearly constant (irregularity below 0.1).

The work of one cylinder's torque above its mean, since the start of the cycle, is
w(phi) = W_gas(phi) - M_mean phi - m_j v^2/2 + Delta J (omega beta')^2/2, W_gas = A int (p - p_0) dx: the masses do no
net work, so the mean torque is that of the gas. The speed has its extremes where the summed torque crosses its mean.
W_gas is closed form for cubics of the volume, by Gauss's rule for cubics of the angle.

Source: any text on engine balance, e.g. C. F. Taylor, The Internal Combustion Engine in Theory and Practice II; the
flywheel from the work between the speed's extremes, Delta W = J omega^2 delta.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from solvers.crank.cycle.forces import Cycle, Machine
from solvers.crank.cycle.worst_instants import Greatest, Group, instant_of
from solvers.crank.gas.unrolled_pressure import Unrolled, piece_of, pressure_of, within, work_at
from solvers.crank.motion.slider_crank import displacement_of, stand_at
from solvers.crank.scene import Engine
from solvers.numerics.jit import inlined_kernel, kernel

Array = NDArray[np.float64]

_FEWEST_NODES, _MOST_NODES = 2, 64
_MOST_ROUNDS = 60
_ROUNDING = 4.0 * np.finfo(float).eps
CANCELLED = 1e-4
"""Where a mean cancels to less than this of its mean magnitude, that share of the magnitude is what counts."""


@dataclass(frozen=True)
class GasWork:
    """The gas's work [J] from the start of the cycle to every break, its absolute error, the sum of its magnitudes, and
    Gauss's rule for it with its number of nodes (none for cubics of the volume)."""

    before: Array
    error: float
    magnitude: float
    rule: tuple[Array, Array]
    nodes: int

    @property
    def whole(self) -> float:
        return float(self.before[-1])


@dataclass(frozen=True)
class SpeedSwing:
    """The work [J] between the extremes of the speed, and what follows for the shaft.

    ``irregularity`` is (omega_max - omega_min)/omega for the inertia there is, None without any;
    ``torque_irregularity`` is (M_max - M_min)/M_mean, None for a mean torque of zero. ``error`` [J] is that of the
    work, ``torque_error`` [N m] that of the extremes of the torque.
    """

    work_fluctuation: float
    inertia: float
    irregularity: float | None
    torque_max: float
    torque_min: float
    torque_mean: float
    torque_irregularity: float | None
    flywheel_inertia_wanted: float | None
    error: float
    torque_error: float


def gas_work(cycle: Cycle, tolerance: float, least: float = math.inf) -> GasWork:
    """By as many nodes as it takes: ``tolerance`` is relative to the work of the cycle, or to ``least`` [J] if that is
    less."""
    rule = _rule(_FEWEST_NODES)
    before, magnitude = _gas_work(cycle.machine, cycle.gas, *rule)
    error = 0.0
    while not cycle.gas.by_volume and rule[0].size < _MOST_NODES:
        rule = _rule(2 * rule[0].size)
        coarse, (before, magnitude) = before, _gas_work(cycle.machine, cycle.gas, *rule)
        error = float(np.max(np.abs(before - coarse)))
        if error <= tolerance * min(max(abs(float(before[-1])), CANCELLED * magnitude), least):
            break
    return GasWork(before, error + _ROUNDING * magnitude, magnitude, rule, 0 if cycle.gas.by_volume else rule[0].size)


@cache
def _rule(nodes: int) -> tuple[Array, Array]:
    """Gauss's rule on (0, 1)."""
    at, weight = np.polynomial.legendre.leggauss(nodes)
    return 0.5 + 0.5 * at, 0.5 * weight


@inlined_kernel
def _by_rule(low: float, high: float, k: int, machine: Machine, gas: Unrolled, at: Array, weight: Array) -> float:
    """The gas's work between two angles of a piece, over the angle."""
    total = 0.0
    for i in range(at.size):
        phi = low + (high - low) * at[i]
        at_phi = stand_at(phi, machine.frame)
        gained = pressure_of(phi, at_phi, k, gas) - machine.back
        total += weight[i] * gained * (at_phi.sine + at_phi.cosine * at_phi.tangent)
    return total * (high - low) * machine.frame.r * machine.area


@kernel
def _done(phi: float, k: int, machine: Machine, gas: Unrolled, at: Array, weight: Array) -> float:
    """The gas's work from the beginning of piece ``k`` to an angle of it."""
    if not gas.by_volume:
        return _by_rule(gas.breaks[k], phi, k, machine, gas, at, weight)
    first = gas.clearance + gas.area * displacement_of(stand_at(gas.breaks[k], gas.frame), gas.frame)
    last = gas.clearance + gas.area * displacement_of(stand_at(phi, gas.frame), gas.frame)
    return work_at(last, k, gas) - work_at(first, k, gas) - machine.back * (last - first)


@kernel
def _gas_work(machine: Machine, gas: Unrolled, at: Array, weight: Array) -> tuple[Array, float]:
    """The work before every break, and the sum of the pieces' magnitudes."""
    before, magnitude, lost = np.zeros(gas.breaks.size), 0.0, 0.0
    for k in range(gas.stroke.size):
        done = _done(gas.breaks[k + 1], k, machine, gas, at, weight)
        magnitude += abs(done)
        # What a sum loses by rounding is added with the next.
        done -= lost
        before[k + 1] = before[k] + done
        lost = (before[k + 1] - before[k]) - done
    return before, magnitude


@kernel
def _surplus_work(
    angle: float, n: int, machine: Machine, gas: Unrolled, group: Group, before: Array, at: Array, weight: Array
) -> float:
    """The sum of all cylinders' w at a shaft angle of the group's piece ``n`` [J]."""
    total, mean = 0.0, before[-1] / (gas.breaks[-1] - gas.breaks[0])
    for cylinder in range(group.shift.shape[1]):
        phi, k = angle + group.shift[n, cylinder], group.piece[n, cylinder]
        if k < 0:
            phi = within(phi, gas.breaks)
            k = piece_of(phi, gas.breaks)
        stands = stand_at(phi, machine.frame)
        tip = machine.speed * machine.frame.r
        moved = tip * (stands.sine + stands.cosine * stands.tangent)
        turned = tip / machine.frame.length * stands.cosine * stands.secant
        total += before[k] + _done(phi, k, machine, gas, at, weight) - mean * phi
        total += 0.5 * (machine.defect * turned * turned - machine.reciprocating * moved * moved)
    return total


@inlined_kernel
def _torque(angle: float, n: int, machine: Machine, gas: Unrolled, group: Group) -> float:
    total = 0.0
    for cylinder in range(group.shift.shape[1]):
        total += instant_of(angle, n, cylinder, machine, gas, group).tangential
    return total * machine.frame.r


@kernel
def _extremes(
    machine: Machine, gas: Unrolled, group: Group, places: Array, samples: Array, before: Array, at: Array,
    weight: Array, tolerance: float,
) -> tuple[float, float, float]:  # fmt: skip
    """The greatest and the least of the summed w, and what rounds of the search may have left of them [J].

    The torque is the last but one row of the ``samples`` at the ``places``. A crossing between two samples of a piece
    is closed in on by false position (Illinois) until the work between its two sides is small; one at a break is the
    break.
    """
    mean = group.shift.shape[1] * before[-1] / (gas.breaks[-1] - gas.breaks[0])
    greatest, least, missed, size = -np.inf, np.inf, 0.0, 0.0
    for n in range(samples.shape[0]):
        for j in range(places.shape[1] - 1):
            size += abs(samples[n, -2, j] - mean) * (places[n, j + 1] - places[n, j])
    last = samples[-1, -2, -1] - mean
    for n in range(samples.shape[0]):
        for j in range(places.shape[1]):
            here, angle = samples[n, -2, j] - mean, places[n, j]
            if (last > 0.0) != (here > 0.0):
                if j > 0:
                    a, fa, b, fb, side = places[n, j - 1], last, angle, here, 0
                    for _ in range(_MOST_ROUNDS):
                        angle = (a * fb - b * fa) / (fb - fa)
                        if not a < angle < b:
                            angle = 0.5 * (a + b)
                        f = _torque(angle, n, machine, gas, group) - mean
                        if abs(f) * (b - a) <= tolerance * size or b - a <= 1e-15 * (1.0 + abs(b)):
                            missed = max(missed, abs(f) * (b - a))
                            break
                        if (f > 0.0) == (fa > 0.0):
                            a, fa, fb, side = angle, f, 0.5 * fb if side == 1 else fb, 1
                        else:
                            b, fb, fa, side = angle, f, 0.5 * fa if side == 2 else fa, 2
                found = _surplus_work(angle, n, machine, gas, group, before, at, weight)
                greatest, least = max(greatest, found), min(least, found)
            last = here
    return greatest, least, missed


def shaft_inertia(cycle: Cycle) -> float:
    """J [kg m2] of everything that turns: flywheel, throws, and the rods' shares at the crank pins."""
    scene, engine, radius = cycle.scene, cycle.scene.engine, cycle.motion.crank_radius
    rods = len(engine.phases)
    throws = max(rods // scene.masses.rods_per_pin, 1)
    rotating = throws * scene.masses.throw.inertia(radius) + rods * scene.masses.rod.at_crank_pin * radius**2
    return engine.flywheel_inertia + rotating


def speed_swing(
    cycle: Cycle, engine: Engine, group: Group, torque: Greatest, work: GasWork, tolerance: float
) -> SpeedSwing:
    """The swing of the speed; ``torque`` has the greatest of the summed torque and of its negative as its last rows."""
    machine, gas, count = cycle.machine, cycle.gas, len(engine.phases)
    high, low, missed = _extremes(
        machine, gas, group, torque.places, torque.samples, work.before, *work.rule, 1e-2 * tolerance
    )
    fluctuation, period = max(high - low, 0.0), cycle.scene.cylinder.period
    average, doubt = count * work.whole / period, count * work.error / period
    inertia, wanted, speed = shaft_inertia(cycle), engine.wanted_irregularity, machine.speed
    most, least = float(torque.value[-2]), -float(torque.value[-1])
    return SpeedSwing(
        work_fluctuation=fluctuation,
        inertia=inertia,
        irregularity=fluctuation / (inertia * speed**2) if inertia > 0 else None,
        torque_max=most,
        torque_min=least,
        torque_mean=average,
        torque_irregularity=(most - least) / abs(average) if abs(average) > doubt else None,
        flywheel_inertia_wanted=None
        if wanted is None
        else max(fluctuation / (wanted * speed**2) - (inertia - engine.flywheel_inertia), 0.0),
        error=2.0 * (missed + count * work.error),
        torque_error=float(np.max(torque.error[-2:])),
    )
