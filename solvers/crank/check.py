"""Dynamics of a crank mechanism over its cycle: forces, torque and power, critical instants, unbalance."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from solvers.accuracy import require_accuracy
from solvers.crank.cycle import LOADS
from solvers.crank.cycle.forces import LONGEST_PIECE, Cycle, Forces, Machine
from solvers.crank.cycle.group import cylinder_group, equal_pieces
from solvers.crank.cycle.worst_instants import BRIX, ROWS, TORQUE, Maxima, refined_maxima, sampled_rows
from solvers.crank.effects import EFFECTS, Situation
from solvers.crank.engine.speed_fluctuation import SpeedFluctuation, speed_fluctuation_of, work_at_breaks, work_extremes
from solvers.crank.engine.unbalance import Balance, balance
from solvers.crank.gas.unrolled_pressure import Unrolled, refined
from solvers.crank.scene import Scene
from solvers.effects import AUTO, EffectSelection, choose
from solvers.errors import require
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.outcome import Accuracy, Outcome, Status

SERIES_ANGLES = 360
_ROUNDING = 1e-14
_TOLERANCE_FRACTION = 0.1
"""Tolerance of searches, as a fraction of the accuracy."""
_OTHER_PIECES, _HIDDEN = 0.7, 4.0
"""A second look at several cylinders: its number of pieces, relative to that of the first, and the error, relative to
the difference of what the two find."""
_TEXTBOOK_RATIO = 0.5
_CROSSING_TOLERANCE = 1e-2
"""Tolerance of crossings of the mean torque relative to that of the work, which is stationary there."""
_COMPRESSION, _TENSION = 1, 2
_MIN_FRACTION = 1e-4
"""Minimum reference of relative errors: of the mean torque as a fraction of its magnitude, of the rod's tension and
compression as a fraction of the larger one."""
_WORK_ROUNDING = 4.0 * np.finfo(float).eps
"""Rounding of the gas work relative to the sum of its magnitudes."""


class Worst(NamedTuple):
    """The instant at which a force is greatest: its name, angle [rad], value [N] and the pressure [Pa] there."""

    name: str
    angle: float
    force: float
    pressure: float


@dataclass(frozen=True)
class CrankDynamics:
    """Results, SI units; ``torque_mean`` and ``indicated_power`` are those of one cylinder.

    ``brix_pressure_error`` is the maximum error of the pressure by Brix's construction, None as for ``brix_pressure``;
    ``shared_pin`` has the loads of the first crank pin and its bearings from both rods, None if every rod has its own.
    Angle-resolved series (``angle``, ``series``, ``brix_pressure``) are computed on first access.
    """

    cycle: Cycle
    series_angles: int
    torque_mean: float
    indicated_power: float
    worst: tuple[Worst, ...]
    brix_pressure_error: float | None
    speed_fluctuation: SpeedFluctuation
    balance: Balance | None
    shared_pin: tuple[float, float] | None
    warnings: tuple[str, ...]

    @cached_property
    def angle(self) -> Array:
        """Equally spaced angles [rad] of one period, starting at 0."""
        return np.arange(self.series_angles) * (self.cycle.scene.cylinder.period / self.series_angles)

    @cached_property
    def series(self) -> Forces:
        """All forces at these angles."""
        return self.cycle.forces(self.angle)

    @cached_property
    def brix_pressure(self) -> Array | None:
        """p [Pa] by Brix's construction; None for table pressures, or with an offset."""
        return None if self.brix_pressure_error is None else self.cycle.curve.pressure(self.angle, brix=True)


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
    one crank pin, to the relative ``tolerance``.

    In one compiled call: passing pressures to a kernel takes longer than many a single evaluation.
    """
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
    if group.piece[0, 0] < 0:
        # Breaks within the pieces may hide extremes: the error is a multiple of what other pieces find otherwise.
        group = equal_pieces(gas, phases, int(_OTHER_PIECES * group.piece.shape[0]))
        places, samples = sampled_rows(machine, gas, group, False)
        again = refined_maxima(machine, gas, group, places, samples, 2, 4, tolerance)
        other, _ = work_extremes(machine, gas, group, places, samples[-2], before, crossing)
        missed += _HIDDEN * abs(other - fluctuation)
        for i in range(2):
            torque.error[i] += _HIDDEN * abs(again.value[i] - torque.value[i])
            torque.value[i] = max(again.value[i], torque.value[i])
    work, work_error = before[-1], _WORK_ROUNDING * magnitude
    highest = max(abs(torque.value[-2]), abs(torque.value[-1]))
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


def analyse(
    scene: Scene,
    effects: EffectSelection = AUTO,
    effect_tolerance: float = 1e-2,
    accuracy: float = 1e-6,
    series_angles: int = SERIES_ANGLES,
) -> Outcome[CrankDynamics]:
    """Analyse a scene's cycle; ``series_angles`` is the number of equally spaced angles of the series.

    Raises InvalidInput for an invalid request: faulty pressures, phases that cannot share a crank pin.
    """
    started = time.perf_counter()
    require_accuracy(accuracy)
    require(1 <= series_angles <= 100_000, "series_angles", "is too few or too many", "1 … 100000")
    situation = Situation(scene)
    choice = choose(EFFECTS, situation, effects, effect_tolerance)
    cycle = situation.cycle(frozenset(effect.name for effect in choice.active))
    phases, shared = np.array(cycle.engine.phases), scene.shares_pins and "engine" in cycle.effects
    found = whole_cycle(cycle.machine, cycle.pieces, phases, shared, _TOLERANCE_FRACTION * accuracy)
    torque_mean = found.gas_work / scene.cylinder.period
    extremes = float(found.torque.value[-2]), -float(found.torque.value[-1])
    speed_fluctuation = speed_fluctuation_of(cycle, found.gas_work, found.gas_work_error, found.fluctuation, *extremes)
    loads, g = found.loads, cycle.motion.geometry
    # Where the rod is hardly longer than the crank, rounding of the lengths changes its angle by far more.
    rounding = max(_ROUNDING, np.finfo(float).eps * g.length / (g.length - g.r - abs(g.offset)))
    maxima = zip(LOADS, loads.place.tolist(), loads.value.tolist(), loads.pressure.tolist(), strict=False)
    worst = tuple(Worst(name, place % scene.cylinder.period, force, p) for name, place, force, p in maxima)
    value = CrankDynamics(
        cycle=cycle,
        series_angles=series_angles,
        torque_mean=torque_mean,
        indicated_power=torque_mean * cycle.machine.speed,
        worst=worst,
        brix_pressure_error=float(loads.value[BRIX]) if cycle.curve.by_volume and g.offset == 0.0 else None,
        speed_fluctuation=speed_fluctuation,
        balance=balance(cycle) if "engine" in cycle.effects else None,
        shared_pin=tuple(found.shared_pin.value[:2].tolist()) if shared else None,
        warnings=_warnings(scene, speed_fluctuation),
    )
    return Outcome(
        status=Status.SUCCEEDED,
        value=value,
        effects=choice.manifest,
        accuracy=Accuracy(accuracy, max(found.error, float(rounding)), {"pieces": found.pieces}),
        timing={"solve_s": time.perf_counter() - started},
    )


def _warnings(scene: Scene, speed_fluctuation: SpeedFluctuation) -> tuple[str, ...]:
    out = []
    if scene.mechanism.crank_radius / scene.mechanism.rod_length > _TEXTBOOK_RATIO:
        out.append("r/L exceeds 0.5: the kinematics hold, but no usual machine is built like this")
    if speed_fluctuation.irregularity is not None and speed_fluctuation.irregularity > 0.1:
        out.append("the speed would swing by more than a tenth: forces at constant speed are not what will happen")
    return tuple(out)
