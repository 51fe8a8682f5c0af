"""The effects an impact linkage's scene can call for, each an object with an a-priori measure and its own results.

Three of the four need something of the scene that it may not give: a drive, a stiffness, a tolerance. Without it they
cannot run, and the manifest says so. Whoever gives a drive asks how the machine runs with it: its speed is not the one
asked for by as much as the motor likes, so no share of energies bounds what would be lost. An elastic peak or an error
of the restitution that is left out is one that would be below the tolerance, of the pin force and of one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Protocol

from solvers.effects import AUTO, Choice, Demand, EffectSelection, choose
from solvers.errors import InvalidInput
from solvers.linkage.loads.coupler_elasticity import worst_elastic_peak
from solvers.linkage.loads.torque_and_pin_force import Peaks
from solvers.linkage.mechanism.closure import Window, window
from solvers.linkage.mechanism.length_tolerances import closure_error, restitution_error
from solvers.linkage.mechanism.lengths import Mechanism
from solvers.linkage.problem import Limits
from solvers.linkage.scene import Scene
from solvers.linkage.steady_state.periodic_solution import Running, steady_running
from solvers.linkage.swept_area.bounding_box import Box, least_box
from solvers.linkage.swept_area.enclosing_circle import enclosing_radius
from solvers.linkage.swept_area.outline import sweep
from solvers.outcome import EffectReport, EffectState

NO_STEADY_RUNNING = "no steady running was found: the motor stalls, or its line is far too steep for the inertias"
_ORIENTATION, _ROUNDING = 1e-13, 1e-14
"""Relative errors of the least box, so sharp since that costs microseconds, and of what is in closed form."""
_LIMIT_ROUNDING = 1e-11
_STEPS_SHARE = 0.1
"""Of the accuracy wanted, what the steps of the steady running may take."""


@dataclass(frozen=True)
class Situation:
    """A scene with its mechanism: what the measures look at, and what the effects work on.

    ``strikes`` says whether the mechanism can strike; ``peaks`` are there where its crank turns fully as well.
    """

    scene: Scene
    mechanism: Mechanism
    limits: Limits
    accuracy: float
    strikes: bool
    peaks: Peaks | None


@dataclass(frozen=True)
class EffectResults:
    """What the effects that run bring, SI units, None where none did; the greatest relative error among it; sentences
    for people."""

    box: Box | None = None
    enclosing_radius: float | None = None
    running: Running | None = None
    coupler_peak: float | None = None
    restitution_error: float | None = None
    tolerance_window: Window | None = None
    error: float = 0.0
    warnings: tuple[str, ...] = ()


class LinkageEffect(Protocol):
    """``needs`` names the field of the scene without which the effect cannot run."""

    name: str
    summary: str
    measure: str
    needs: str | None

    def influence(self, situation: Situation) -> float: ...

    def join(self, results: EffectResults, situation: Situation) -> EffectResults:
        """The results with what this effect brings in a situation."""


@dataclass(frozen=True)
class Envelope:
    name: str = "envelope"
    summary: str = "the swept box at its best orientation, and the enclosing circle"
    measure: str = "1: its results exist only when it runs"
    needs: str | None = None

    def influence(self, situation: Situation) -> float:
        return 1.0

    def join(self, results: EffectResults, situation: Situation) -> EffectResults:
        if situation.peaks is None:
            return results
        limits, outline = situation.limits, sweep(situation.mechanism.bar, situation.mechanism.crank)
        pad = limits.joint_radius
        width, height = (math.inf if v is None else v * (1.0 + _LIMIT_ROUNDING) for v in (limits.width, limits.height))
        box = least_box(outline, pad, width, height, _ORIENTATION) or least_box(outline, pad, tolerance=_ORIENTATION)
        error = max(results.error, _ORIENTATION + _ROUNDING)
        return replace(results, box=box, enclosing_radius=enclosing_radius(outline, pad), error=error)


@dataclass(frozen=True)
class ImpactDynamics:
    name: str = "impact_dynamics"
    summary: str = "steady running with a motor, a flywheel and the blow"
    measure: str = "1: its results exist only when it runs"
    needs: str | None = "drive"

    def influence(self, situation: Situation) -> float:
        return 1.0

    def join(self, results: EffectResults, situation: Situation) -> EffectResults:
        if situation.peaks is None:
            return results
        scene, bar = situation.scene, situation.mechanism.bar
        tool = scene.striking_radius(situation.mechanism)
        running = steady_running(
            bar, scene, scene.drive, tool, scene.restitution.middle, _STEPS_SHARE * situation.accuracy
        )
        if running is None:
            return replace(results, warnings=(*results.warnings, NO_STEADY_RUNNING))
        return replace(results, running=running, error=max(results.error, running.error))


@dataclass(frozen=True)
class CouplerElasticity:
    name: str = "coupler_elasticity"
    summary: str = "the pin-force peak after a blow whose restitution is not the one designed for"
    measure: str = "C sqrt(2 k_c E) |R - R_k| over the peak pin force, C = 1.82 for a small mismatch"
    needs: str | None = "coupler_stiffness"

    def influence(self, situation: Situation) -> float:
        peaks = situation.peaks
        return 1.0 if peaks is None or peaks.force == 0 else self._peak(situation) / peaks.force

    def join(self, results: EffectResults, situation: Situation) -> EffectResults:
        return replace(results, coupler_peak=self._peak(situation)) if situation.strikes else results

    def _peak(self, situation: Situation) -> float:
        scene = situation.scene
        return worst_elastic_peak(
            situation.mechanism.bar, scene.coupler_stiffness, scene.impact_energy, scene.restitution
        )


@dataclass(frozen=True)
class LengthTolerances:
    name: str = "tolerances"
    summary: str = "closure and restitution with lengths off by their tolerance"
    measure: str = "g/(g^2 - 1) times the relative errors of the lengths"
    needs: str | None = "length_tolerance"

    def influence(self, situation: Situation) -> float:
        mechanism = situation.mechanism
        return restitution_error(mechanism.bar, mechanism.crank, situation.scene.length_tolerance)

    def join(self, results: EffectResults, situation: Situation) -> EffectResults:
        if not situation.strikes:
            return results
        mechanism, tolerance = situation.mechanism, situation.scene.length_tolerance
        missed = window(mechanism.bar, -closure_error(mechanism.crank, tolerance))
        return replace(results, restitution_error=self.influence(situation), tolerance_window=missed)


EFFECTS: tuple[LinkageEffect, ...] = (Envelope(), ImpactDynamics(), CouplerElasticity(), LengthTolerances())
"""Every effect."""


def choose_for(
    situation: Situation,
    selection: EffectSelection = AUTO,
    tolerance: float = 1e-2,
    demands: tuple[Demand, ...] = (),
) -> Choice[LinkageEffect]:
    """The effects for a mechanism (see ``solvers.effects.choose``); one whose data are missing cannot run."""
    missing = [effect for effect in EFFECTS if effect.needs and getattr(situation.scene, effect.needs) is None]
    for effect in missing:
        if effect.name in selection.include:
            raise InvalidInput(effect.needs, f"the effect {effect.name!r} cannot run without it", "a value")
    if not missing:
        return choose(EFFECTS, situation, selection, tolerance, demands)
    able = tuple(effect for effect in EFFECTS if effect not in missing)
    known = {effect.name for effect in missing}
    asked = EffectSelection(selection.include, selection.exclude - known, selection.automatic)
    choice = choose(able, situation, asked, tolerance, demands)
    reports = {report.name: report for report in choice.manifest}
    for effect in missing:
        why = f"the scene does not give the {effect.needs.replace('_', ' ')} that it needs"
        reports[effect.name] = EffectReport(effect.name, EffectState.SKIPPED, lambda: 0.0, why)
    return Choice(choice.active, tuple(reports[effect.name] for effect in EFFECTS))


def compose(choice: Choice[LinkageEffect], situation: Situation) -> EffectResults:
    """What the chosen effects bring; what is not chosen is not computed."""
    results = EffectResults()
    for effect in choice.active:
        results = effect.join(results, situation)
    return results
