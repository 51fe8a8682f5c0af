"""Dynamics of a crank mechanism over its cycle: forces, torque and power, critical instants, unbalance."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from solvers.accuracy import require_accuracy
from solvers.crank.cycle import LOADS
from solvers.crank.cycle.forces import Cycle, Forces
from solvers.crank.cycle.worst_instants import BRIX
from solvers.crank.effects import EFFECTS, Situation
from solvers.crank.engine.speed_fluctuation import SpeedFluctuation, speed_fluctuation_of
from solvers.crank.engine.unbalance import Balance, balance
from solvers.crank.scene import Scene
from solvers.crank.whole_cycle import whole_cycle
from solvers.effects import AUTO, EffectSelection, choose
from solvers.errors import InvalidInput
from solvers.numerics.arrays import Array
from solvers.outcome import Accuracy, Outcome, Status, evaluated

SERIES_ANGLES = 360
_ROUNDING = 1e-14
_TOLERANCE_FRACTION = 0.1
"""Tolerance of searches, as a fraction of the accuracy."""
_TEXTBOOK_RATIO = 0.5


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
        return self.cycle.curve.brix_pressure(self.angle)


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
    if not 1 <= series_angles <= 100_000:
        raise InvalidInput("series_angles", "is too few or too many", "1 … 100000")
    situation = Situation(scene)
    choice = choose(EFFECTS, situation, effects, effect_tolerance)
    cycle = situation.cycle(frozenset(effect.name for effect in choice.active))
    phases, shared = np.array(cycle.engine.phases), scene.shares_pins and "engine" in cycle.effects
    found = whole_cycle(cycle.machine, cycle.pieces, phases, shared, _TOLERANCE_FRACTION * accuracy)
    torque_mean = found.gas_work / scene.cylinder.period
    torque_max, torque_min = float(found.torque.value[-2]), -float(found.torque.value[-1])
    speed_fluctuation = speed_fluctuation_of(
        cycle, found.gas_work, found.gas_work_error, found.fluctuation, torque_max, torque_min
    )
    loads = found.loads
    maxima = zip(LOADS, loads.place.tolist(), loads.value.tolist(), loads.pressure.tolist(), strict=False)
    worst = tuple(Worst(name, place % scene.cylinder.period, force, p) for name, place, force, p in maxima)
    value = CrankDynamics(
        cycle=cycle,
        series_angles=series_angles,
        torque_mean=torque_mean,
        indicated_power=torque_mean * cycle.machine.speed,
        worst=worst,
        brix_pressure_error=float(found.loads.value[BRIX]) if cycle.curve.has_brix else None,
        speed_fluctuation=speed_fluctuation,
        balance=balance(cycle) if "engine" in cycle.effects else None,
        shared_pin=tuple(found.shared_pin.value[:2].tolist()) if shared else None,
        warnings=_warnings(scene, speed_fluctuation),
    )
    return Outcome(
        status=Status.SUCCEEDED,
        value=value,
        effects=choice.manifest,
        accuracy=Accuracy(accuracy, max(found.error, _ROUNDING), {"pieces": found.pieces}),
        timing={"solve_s": time.perf_counter() - started},
    )


class Case(NamedTuple):
    """The arguments of one ``analyse``."""

    scene: Scene
    effects: EffectSelection = AUTO
    effect_tolerance: float = 1e-2
    accuracy: float = 1e-6
    series_angles: int = SERIES_ANGLES

    def evaluate(self) -> Outcome[CrankDynamics]:
        return analyse(*self)


def analyse_many(cases: Iterable[Case]) -> list[Outcome[CrankDynamics] | InvalidInput]:
    """Return one outcome per case, in input order; an invalid case yields its InvalidInput."""
    return evaluated(cases)


def _warnings(scene: Scene, speed_fluctuation: SpeedFluctuation) -> tuple[str, ...]:
    out = []
    if scene.mechanism.crank_radius / scene.mechanism.rod_length > _TEXTBOOK_RATIO:
        out.append("r/L exceeds 0.5: the kinematics hold, but no usual machine is built like this")
    if speed_fluctuation.irregularity is not None and speed_fluctuation.irregularity > 0.1:
        out.append("the speed would swing by more than a tenth: forces at constant speed are not what will happen")
    return tuple(out)
