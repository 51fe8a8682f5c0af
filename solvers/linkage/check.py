"""Evaluation of a given linkage: kind, rotatability, impact, loads and swept area."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from functools import lru_cache

from solvers.accuracy import require_accuracy
from solvers.effects import AUTO, Demand, EffectSelection
from solvers.errors import InvalidInput, require
from solvers.linkage.effects import Situation, choose_for
from solvers.linkage.limits import Limits
from solvers.linkage.loads.torque_and_pin_force import peaks
from solvers.linkage.mechanism.change_point import ChangePoint, Gain
from solvers.linkage.mechanism.kinematics import FourBar, of_family
from solvers.linkage.mechanism.lengths import Mechanism
from solvers.linkage.result import TRANSFER_POINTS, EffectResults, LinkageCheck, Strike
from solvers.linkage.scene import Scene
from solvers.linkage.warnings import warnings_of
from solvers.outcome import Accuracy, Outcome, Status

NO_LIMITS = Limits()


def of_ratio(scene: Scene, kind: ChangePoint, parameter: float) -> Mechanism:
    """The mechanism of a kind with this free ratio, made for the scene's restitution and sized by the scene.

    With a tool radius the rocker has that length; otherwise the crank follows from speed and frequency. Raises
    InvalidInput for a free ratio without a mechanism.
    """
    bar = _member(kind, scene.restitution.middle, parameter)
    if scene.tool_radius is None:
        crank = scene.impact_speed / (scene.crank_speed * bar.ratios.rocker * bar.u31_end)
    else:
        crank = scene.tool_radius / float(bar.ratios.rocker)
    return Mechanism(bar, crank)


@lru_cache(maxsize=32, typed=True)
def _member(kind: ChangePoint, restitution: float, parameter: float) -> FourBar:
    """``of_family`` for a valid free ratio; cached, since sweeps of speeds, loads or limits share the mechanism."""
    field, pole = f"ratios.{kind.parameter}", kind.pole(Gain(restitution))
    require(math.isfinite(parameter) and parameter > 1e-6, field, "must be positive", "(0, inf)")
    if not parameter > pole:
        raise InvalidInput(field, "gives no mechanism of this type", f"more than {pole:.6g} at this restitution")
    return of_family(kind, restitution, parameter)


def check(
    scene: Scene,
    mechanism: Mechanism,
    limits: Limits = NO_LIMITS,
    effects: EffectSelection = AUTO,
    effect_tolerance: float = 1e-2,
    accuracy: float = 1e-6,
    demands: tuple[Demand, ...] = (),
) -> Outcome[LinkageCheck]:
    """Evaluate a linkage.

    ``limits`` sets the pads of box and circle, and the box is oriented to keep within width and height if possible; no
    other limit is judged. ``accuracy`` is the requested relative numerical accuracy, 1e-12 … 1e-1; ``demands`` are the
    effects that limits require. Raises InvalidInput for an invalid request, EffectConflict for an excluded effect that
    is required.
    """
    started = time.perf_counter()
    require_accuracy(accuracy)
    loads = None
    if mechanism.can_strike and mechanism.rotatable:
        loads = peaks(mechanism.bar, mechanism.crank, scene.impact_energy)
    situation = Situation(scene, mechanism, limits, accuracy, loads)
    choice = choose_for(situation, effects, effect_tolerance, demands)
    results = EffectResults()
    for effect in choice.active:
        results = effect.join(results, situation)
    settings: dict[str, float | int | str] = {"transfer_points": TRANSFER_POINTS}
    if results.running is not None:
        settings["steps"] = results.running.steps
    strike = None
    if mechanism.can_strike:
        mismatch = max(abs(end - mechanism.bar.restitution) for end in (scene.restitution.low, scene.restitution.high))
        strike = Strike(mismatch, scene.tool_speed(mechanism), loads)
    value = LinkageCheck(mechanism=mechanism, strike=strike, **vars(results))
    return Outcome(
        status=Status.SUCCEEDED,
        value=replace(value, warnings=(*value.warnings, *warnings_of(value, scene))),
        effects=choice.manifest,
        accuracy=Accuracy(accuracy, results.error, settings),
        timing={"solve_s": time.perf_counter() - started},
    )
