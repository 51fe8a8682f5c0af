"""Dynamics of a crank mechanism over its cycle: forces, torque and power, critical instants, unbalance."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.accuracy import require_accuracy
from solvers.crank.cycle.forces import Cycle, Forces
from solvers.crank.cycle.textbook_error import TierErrors, tier_errors
from solvers.crank.cycle.worst_instants import Worst, worst_instants
from solvers.crank.effects import choose_for, compose
from solvers.crank.engine.shared_crank_pin import SharedPin, require_pairs, shared_pin
from solvers.crank.engine.speed_fluctuation import SpeedFluctuation, speed_fluctuation_of
from solvers.crank.engine.unbalance import Balance, balance
from solvers.crank.scene import SINGLE, Scene
from solvers.crank.whole_cycle import whole_cycle
from solvers.effects import AUTO, EffectSelection
from solvers.errors import InvalidInput
from solvers.numerics.arrays import Array
from solvers.outcome import Accuracy, Outcome, Status

SERIES_ANGLES = 360
_ROUNDING = 1e-14
_TOLERANCE_FRACTION = 0.1
"""Tolerance of searches and sums, as a fraction of the accuracy."""
_TIER_TOLERANCE = 1e-6
_TEXTBOOK_RATIO = 0.5


@dataclass(frozen=True)
class CrankDynamics:
    """Results, SI units; ``torque_mean`` and ``indicated_power`` are those of one cylinder.

    Angle-resolved series (``angle``, ``series``, ``brix_pressure``) and the errors of textbook approximations
    (``tiers``) are computed on first access.
    """

    cycle: Cycle
    series_angles: int
    tier_tolerance: float
    torque_mean: float
    indicated_power: float
    worst: tuple[Worst, ...]
    speed_fluctuation: SpeedFluctuation
    balance: Balance | None
    shared_pin: SharedPin | None
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

    @cached_property
    def tiers(self) -> TierErrors:
        """Errors of the textbook approximations."""
        return tier_errors(self.cycle, self.tier_tolerance)

    @property
    def jumps(self) -> tuple[tuple[float, float], ...]:
        """Pressure jumps at the dead centres: (angle [rad], p after minus p before [Pa])."""
        return self.cycle.curve.jumps

    @property
    def stroke(self) -> float:
        """Stroke [m]."""
        return self.cycle.motion.stroke

    @property
    def dead_centres(self) -> tuple[float, float]:
        """Angles of the upper dead centre and of the following lower one [rad]."""
        return self.cycle.motion.dead_centres


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
    require_pairs(scene.engine, scene.masses.rods_per_pin)
    curve = scene.pressure.unroll(scene.mechanism.motion, scene.cylinder)
    choice = choose_for(scene, curve, effects, effect_tolerance)
    composition = compose(choice, scene)
    if composition.offset != scene.mechanism.offset:
        curve = scene.pressure.unroll(scene.mechanism.motion_in_line, scene.cylinder)
    cycle, tolerance = Cycle(scene, composition, curve), _TOLERANCE_FRACTION * accuracy
    engine = composition.engine or SINGLE
    found = whole_cycle(cycle.machine, curve, cycle.sharp_angles, np.array(engine.phases), tolerance)
    torque_mean = found.shaft.gas_work / scene.cylinder.period
    speed_fluctuation = speed_fluctuation_of(cycle, engine, found.shaft)
    value = CrankDynamics(
        cycle=cycle,
        series_angles=series_angles,
        tier_tolerance=max(tolerance, _TIER_TOLERANCE),
        torque_mean=torque_mean,
        indicated_power=torque_mean * cycle.machine.speed,
        worst=worst_instants(found.loads, scene.cylinder.period),
        speed_fluctuation=speed_fluctuation,
        balance=None if composition.engine is None else balance(cycle, engine),
        shared_pin=shared_pin(cycle, engine, tolerance),
        warnings=_warnings(scene, speed_fluctuation),
    )
    return Outcome(
        status=Status.SUCCEEDED,
        value=value,
        effects=choice.manifest,
        accuracy=Accuracy(
            accuracy, max(found.error, _ROUNDING), {"pieces": found.pieces, "nodes": int(found.shaft.nodes)}
        ),
        timing={"solve_s": time.perf_counter() - started},
    )


def _warnings(scene: Scene, speed_fluctuation: SpeedFluctuation) -> tuple[str, ...]:
    out = []
    if scene.mechanism.crank_radius / scene.mechanism.rod_length > _TEXTBOOK_RATIO:
        out.append("r/L exceeds 0.5: the kinematics hold, but no usual machine is built like this")
    if speed_fluctuation.irregularity is not None and speed_fluctuation.irregularity > 0.1:
        out.append("the speed would swing by more than a tenth: forces at constant speed are not what will happen")
    return tuple(out)
