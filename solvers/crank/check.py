"""The dynamics of a crank mechanism over its cycle: forces, torque and power, the worst instants, unbalance."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from solvers.crank.cycle.forces import Array, Cycle, Forces
from solvers.crank.cycle.textbook_error import TierErrors, brix_curve, tier_errors
from solvers.crank.cycle.worst_instants import Worst, worst_instants
from solvers.crank.effects import choose_for, compose
from solvers.crank.engine.shared_crank_pin import SharedPin, require_pairs, shared_pin
from solvers.crank.engine.speed_fluctuation import SpeedSwing, speed_swing
from solvers.crank.engine.unbalance import Balance, balance
from solvers.crank.motion.slider_crank import ExactMotion
from solvers.crank.problem import LOADS, OF_THE_ROD
from solvers.crank.scene import Curve, Scene
from solvers.effects import AUTO, EffectSelection
from solvers.errors import InvalidInput
from solvers.numerics.pieces import CANCELLED, maxima, means
from solvers.outcome import Accuracy, Outcome, Status

SERIES_ANGLES = 360
_ROUNDING = 1e-14
_TIER_TOLERANCE = 1e-6
_TEXTBOOK_RATIO = 0.5


@dataclass(frozen=True)
class CrankDynamics:
    """The results, SI units. ``torque_mean`` and ``indicated_power`` are those of one cylinder."""

    angle: Array
    series: Forces
    brix_pressure: Array | None
    reciprocating_mass: float
    rotating_mass: float
    rod_mass_at_pin: float
    rod_mass_at_crank: float
    inertia_defect: float
    torque_mean: float
    indicated_power: float
    stroke: float
    dead_centres: tuple[float, float]
    jumps: tuple[tuple[float, float], ...]
    worst: tuple[Worst, ...]
    swing: SpeedSwing
    balance: Balance | None
    shared_pin: SharedPin | None
    tiers: TierErrors
    curve: Curve
    warnings: tuple[str, ...]


def analyse(
    scene: Scene,
    effects: EffectSelection = AUTO,
    effect_tolerance: float = 1e-2,
    accuracy: float = 1e-6,
    series_angles: int = SERIES_ANGLES,
) -> Outcome[CrankDynamics]:
    """Everything about a scene's cycle; ``series_angles`` is the number of equally spaced angles of the series.

    Raises InvalidInput where the request makes no sense: pressures with a fault, phases that cannot share a crank pin.
    """
    started = time.perf_counter()
    if not 1e-12 <= accuracy <= 1e-1:
        raise InvalidInput("accuracy", "lies outside what can be asked for", "[1e-12, 1e-1]")
    if not 1 <= series_angles <= 100_000:
        raise InvalidInput("series_angles", "is too few or too many", "1 … 100000")
    require_pairs(scene.engine, scene.masses.rods_per_pin)
    given = scene.pressure.unroll(scene.mechanism.motion(), scene.cylinder)
    choice = choose_for(scene, given, effects, effect_tolerance)
    composition = compose(choice, scene, accuracy)
    in_line = ExactMotion(scene.mechanism.crank_radius, scene.mechanism.rod_length)
    framed = composition.motion if isinstance(composition.motion, ExactMotion) else in_line
    kept = composition.motion == scene.mechanism.motion()
    curve = given if kept else scene.pressure.unroll(framed, scene.cylinder, composition.motion)
    cycle = Cycle(scene, composition, curve)

    tolerance = 0.1 * accuracy
    mean = means(cycle.torque_and_power, cycle.breaks, tolerance)
    found = maxima(
        lambda a: (f := cycle.forces(a), np.stack([read(f) for _, read in LOADS]))[1], cycle.breaks, tolerance
    )
    swing = speed_swing(cycle, composition.engine, tolerance, (float(mean.value[0]), float(mean.error[0])))
    several = choice.has("engine")
    angle = np.arange(series_angles) * (scene.cylinder.period / series_angles)
    brix = brix_curve(scene, curve)
    masses, radius = scene.masses, scene.mechanism.crank_radius
    scale = np.abs(found.value)
    # Next to no tension beside a great compression is what the compression's digits leave, and the other way round.
    scale[OF_THE_ROD] = np.maximum(scale[OF_THE_ROD], CANCELLED * scale[OF_THE_ROD].max())
    scale = np.where(scale > 0, scale, 1.0)
    errors = [
        *(mean.error / np.where(mean.magnitude > 0, np.maximum(np.abs(mean.value), CANCELLED * mean.magnitude), 1.0)),
        *(found.error / scale),
        swing.error / swing.work_fluctuation if swing.work_fluctuation else 0.0,
        0.0 if isinstance(composition.motion, ExactMotion) else (radius / scene.mechanism.rod_length) ** 2,
    ]
    value = CrankDynamics(
        angle=angle,
        series=cycle.forces(angle),
        brix_pressure=None if brix is None else brix.pressure(angle),
        reciprocating_mass=masses.reciprocating,
        rotating_mass=masses.rotating(radius),
        rod_mass_at_pin=masses.rod.at_wrist_pin,
        rod_mass_at_crank=masses.rod.at_crank_pin,
        inertia_defect=masses.rod.inertia_defect,
        torque_mean=float(mean.value[0]),
        indicated_power=float(mean.value[1]),
        stroke=composition.motion.stroke,
        dead_centres=composition.motion.dead_centres,
        jumps=curve.jumps,
        worst=worst_instants(found, cycle),
        swing=swing,
        balance=balance(cycle, composition.engine) if several else None,
        shared_pin=shared_pin(cycle, composition.engine, tolerance) if several else None,
        tiers=tier_errors(scene, curve, brix, max(tolerance, _TIER_TOLERANCE)),
        curve=curve,
        warnings=_warnings(scene, swing),
    )
    settings = {
        "kinematics": "exact" if isinstance(composition.motion, ExactMotion) else "two harmonics",
        "pieces": int(cycle.breaks.size - 1),
        "nodes": mean.nodes,
    }
    return Outcome(
        status=Status.SUCCEEDED,
        value=value,
        effects=choice.manifest,
        accuracy=Accuracy(accuracy, max(max(errors), _ROUNDING), settings),
        timing={"solve_s": time.perf_counter() - started},
    )


def _warnings(scene: Scene, swing: SpeedSwing) -> tuple[str, ...]:
    out = []
    if scene.mechanism.crank_radius / scene.mechanism.rod_length > _TEXTBOOK_RATIO:
        out.append("r/L exceeds 0.5: the kinematics hold, but no usual machine is built like this")
    if swing.irregularity is not None and swing.irregularity > 0.1:
        out.append("the speed would swing by more than a tenth: forces at constant speed are not what will happen")
    return tuple(out)
