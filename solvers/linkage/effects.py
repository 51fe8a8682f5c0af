"""Effects of the impact linkage, each with its estimated influence and its own results.

Three of the four require optional scene data: a drive, a stiffness, a tolerance. Without them they cannot run, which
the manifest states. A given drive always requires the steady running: its speed may deviate arbitrarily from the
nominal one, so no energy ratio bounds the influence. An omitted elastic peak, restitution error or blocked
angle is below the tolerance relative to the pin force, to 1 and to 1 rad respectively.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

from solvers.effects import Choice, Demand, Effect, EffectSelection, choose
from solvers.errors import InvalidInput
from solvers.linkage.limits import Limits
from solvers.linkage.loads.coupler_elasticity import worst_elastic_peak
from solvers.linkage.loads.torque_and_pin_force import Peaks
from solvers.linkage.mechanism.closure import Window, restitution_error, window
from solvers.linkage.mechanism.lengths import Mechanism
from solvers.linkage.result import EffectResults
from solvers.linkage.scene import Scene
from solvers.linkage.steady_state.periodic_solution import ROUNDING, steady_state_running
from solvers.linkage.swept_area.bounding_box import BOX_TOLERANCE, minimum_box
from solvers.linkage.swept_area.enclosing_circle import enclosing_radius
from solvers.linkage.swept_area.outline import sweep

NO_STEADY_RUNNING = "no steady running was found: the motor stalls, or its line is far too steep for the inertias"
_LIMIT_ROUNDING = 2e-10
"""Relative allowance within which the box of a design on its limits is found: twice what the search allows."""
_STEPS_SHARE = 0.1
"""Fraction of the requested accuracy allotted to the discretisation of the steady running."""


@dataclass(frozen=True)
class Situation:
    """A scene with its mechanism: the input of the influences and the effects.

    ``peaks`` is set if the mechanism can strike and its crank rotates fully.
    """

    scene: Scene
    mechanism: Mechanism
    limits: Limits
    accuracy: float
    peaks: Peaks | None


class LinkageEffect(Effect[Situation], Protocol):
    """An effect; ``needs`` names the scene field without which it cannot run."""

    needs: str | None

    def join(self, results: EffectResults, situation: Situation) -> EffectResults:
        """Add this effect's results for a situation."""


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
        width, height = (side * (1.0 + _LIMIT_ROUNDING) for side in limits.sides)
        box = minimum_box(outline, pad, width, height) or minimum_box(outline, pad)
        error = max(results.error, BOX_TOLERANCE + ROUNDING)
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
        running = steady_state_running(situation.mechanism, situation.scene, _STEPS_SHARE * situation.accuracy)
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
        if peaks is None or peaks.force == 0:
            return 1.0
        return worst_elastic_peak(situation.mechanism.bar, situation.scene) / peaks.force

    def join(self, results: EffectResults, situation: Situation) -> EffectResults:
        if not situation.mechanism.can_strike:
            return results
        return replace(results, coupler_peak=worst_elastic_peak(situation.mechanism.bar, situation.scene))


@dataclass(frozen=True)
class LengthTolerances:
    name: str = "tolerances"
    summary: str = "closure and restitution with lengths off by their tolerance"
    measure: str = "g/(g^2 - 1) times the relative errors of the lengths; the angle [rad] that they may block"
    needs: str | None = "length_tolerance"

    def influence(self, situation: Situation) -> float:
        error, tolerance_window = self._errors(situation)
        return max(error, tolerance_window.angle)

    def join(self, results: EffectResults, situation: Situation) -> EffectResults:
        if not situation.mechanism.can_strike:
            return results
        error, tolerance_window = self._errors(situation)
        return replace(results, restitution_error=error, tolerance_window=tolerance_window)

    def _errors(self, situation: Situation) -> tuple[float, Window]:
        """Relative error of the restitution, and the window with all four lengths at their worst."""
        bar, crank, tolerance = situation.mechanism.bar, situation.mechanism.crank, situation.scene.length_tolerance
        return restitution_error(bar, crank, tolerance), window(bar, -4.0 * tolerance / crank)


EFFECTS: tuple[LinkageEffect, ...] = (Envelope(), ImpactDynamics(), CouplerElasticity(), LengthTolerances())
"""All effects."""


def choose_for(
    situation: Situation, selection: EffectSelection, tolerance: float, demands: tuple[Demand, ...]
) -> Choice[LinkageEffect]:
    """Select the effects for a mechanism (see ``solvers.effects.choose``); those with missing data cannot run."""
    unable = {}
    for effect in EFFECTS:
        if effect.needs is not None and getattr(situation.scene, effect.needs) is None:
            if effect.name in selection.include:
                raise InvalidInput(effect.needs, f"the effect {effect.name!r} cannot run without it", "a value")
            unable[effect.name] = f"the scene does not give the {effect.needs.replace('_', ' ')} that it needs"
    return choose(EFFECTS, situation, selection, tolerance, demands, unable)
