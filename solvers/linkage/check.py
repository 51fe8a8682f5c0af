"""Evaluation of a given linkage: kind, rotatability, impact, loads and swept area."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from solvers.accuracy import require_accuracy
from solvers.effects import AUTO, Demand, EffectSelection
from solvers.errors import InvalidInput, require
from solvers.linkage.effects import Situation, choose_for, compose
from solvers.linkage.loads.torque_and_pin_force import SHARP, TORQUE, Peaks, peaks_of, unit_peaks
from solvers.linkage.mechanism.change_point import ChangePoint
from solvers.linkage.mechanism.closure import Closure, window
from solvers.linkage.mechanism.kinematics import of_family
from solvers.linkage.mechanism.lengths import Mechanism
from solvers.linkage.problem import Limits
from solvers.linkage.result import TRANSFER_POINTS, LinkageCheck, Strike
from solvers.linkage.scene import Scene
from solvers.linkage.warnings import warnings_of
from solvers.outcome import Accuracy, Outcome, Status

_ROUNDING = 1e-14
"""Relative error of closed-form results."""
PLAIN = Limits()


def of_ratio(scene: Scene, kind: ChangePoint, parameter: float) -> Mechanism:
    """The mechanism of a kind with this free ratio, made for the scene's restitution and sized by the scene.

    With a tool radius the rocker has that length; otherwise the crank follows from speed and frequency. Raises
    InvalidInput for a free ratio without a mechanism.
    """
    field = f"ratios.{kind.parameter}"
    require(math.isfinite(parameter) and parameter > 1e-6, field, "must be positive", "(0, inf)")
    pole = kind.pole(scene.restitution.gain)
    if not parameter > pole:
        raise InvalidInput(field, "gives no mechanism of this type", f"above g² = {pole:.6g}")
    bar = of_family(kind, scene.restitution.middle, parameter)
    if scene.tool_radius is None:
        crank = scene.impact_speed / (scene.crank_speed * bar.ratios.rocker * bar.end)
    else:
        crank = scene.tool_radius / float(bar.ratios.rocker)
    return Mechanism(bar, crank, Closure(kind, 0.0, 0.0))


def check(
    scene: Scene,
    mechanism: Mechanism,
    limits: Limits = PLAIN,
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
    return Case(scene, mechanism, limits, effects, effect_tolerance, accuracy, demands).alone()


@dataclass(frozen=True)
class Case:
    """Arguments of one call of ``check``."""

    scene: Scene
    mechanism: Mechanism
    limits: Limits = PLAIN
    effects: EffectSelection = AUTO
    effect_tolerance: float = 1e-2
    accuracy: float = 1e-6
    demands: tuple[Demand, ...] = ()

    def alone(self) -> Outcome[LinkageCheck]:
        """Evaluate this case by ``check``."""
        return check_case(self, ratio_results([self.mechanism])[0])


@dataclass(frozen=True)
class RatioResults:
    """Results that depend on the ratios only: whether the mechanism can strike, whether its crank rotates fully, and if
    both, the row of ``unit_peaks`` and the maximum |u31| over the cycle."""

    strikes: bool
    rotatable: bool
    peaks: tuple[float, ...] | None = None
    greatest: float = math.inf


def ratio_results(mechanisms: Sequence[Mechanism]) -> list[RatioResults]:
    """Results of many mechanisms, in one call of each kernel."""
    found = [RatioResults(mechanism.can_strike, mechanism.rotatable) for mechanism in mechanisms]
    full = [i for i, results in enumerate(found) if results.strikes and results.rotatable]
    if full:
        bars = [mechanisms[i].bar for i in full]
        rows, ends = np.stack([bar.coefficients for bar in bars]), np.array([bar.end for bar in bars])
        peaks = unit_peaks(rows, ends, TORQUE, 3, SHARP).tolist()
        for i, bar, row in zip(full, bars, peaks, strict=True):
            found[i] = RatioResults(True, True, tuple(row), max(row[4], bar.start, bar.end))
    return found


def check_case(case: Case, own: RatioResults) -> Outcome[LinkageCheck]:
    """``check`` of a case whose mechanism has these ratio results."""
    started = time.perf_counter()
    require_accuracy(case.accuracy)
    scene, mechanism = case.scene, case.mechanism
    loads = peaks_of(own.peaks, mechanism.crank, scene.impact_energy) if own.peaks else None
    situation = Situation(scene, mechanism, case.limits, case.accuracy, own.strikes, loads)
    choice = choose_for(situation, case.effects, case.effect_tolerance, case.demands)
    brought = compose(choice, situation)
    confined, closure = mechanism.confined, mechanism.closure
    settings: dict[str, float | int | str] = {"transfer_points": TRANSFER_POINTS}
    if brought.running is not None:
        settings["steps"] = brought.running.steps
    value = LinkageCheck(
        mechanism=mechanism,
        rotatable=own.rotatable,
        confined=confined,
        strike=_strike(scene, mechanism, loads, confined, own.greatest) if own.strikes else None,
        box=brought.box,
        enclosing_radius=brought.enclosing_radius,
        window=None if closure.closes else window(mechanism.bar, closure.surplus),
        restitution_error=brought.restitution_error,
        tolerance_window=brought.tolerance_window,
        coupler_peak=brought.coupler_peak,
        running=brought.running,
        warnings=brought.warnings,
    )
    return Outcome(
        status=Status.SUCCEEDED,
        value=replace(value, warnings=(*value.warnings, *warnings_of(value, scene))),
        effects=choice.manifest,
        accuracy=Accuracy(case.accuracy, max(_ROUNDING, brought.error), settings),
        timing={"solve_s": time.perf_counter() - started},
    )


def _strike(scene: Scene, mechanism: Mechanism, loads: Peaks | None, confined: float | None, greatest: float) -> Strike:
    bar = mechanism.bar
    made = bar.restitution
    return Strike(
        mechanism=mechanism,
        confined=confined,
        start=bar.start,
        end=bar.end,
        restitution=made,
        mismatch=max(abs(scene.restitution.low - made), abs(scene.restitution.high - made)),
        impact_speed=scene.tool_speed(mechanism),
        transmission_angle=bar.middle_transmission_angle,
        peaks=loads,
        greatest=greatest if confined is None else math.inf,
    )
