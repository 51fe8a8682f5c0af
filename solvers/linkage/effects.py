"""The effects an impact linkage's scene can call for, each an object with an a-priori measure.

Three of the four need something of the scene that it may not give: a drive, a stiffness, a tolerance. Without it they
cannot run, and the manifest says so. Whoever gives a drive asks how the machine runs with it: its speed is not the one
asked for by as much as the motor likes, so no share of energies bounds what would be lost. An elastic peak or an error
of the restitution that is left out is one that would be below the tolerance, of the pin force and of one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from solvers.effects import AUTO, Choice, Demand, EffectSelection, choose
from solvers.errors import InvalidInput
from solvers.linkage.elasticity import worst_elastic_peak
from solvers.linkage.four_bar import FourBar
from solvers.linkage.loads import Peaks
from solvers.linkage.scene import Scene
from solvers.linkage.tolerances import restitution_error
from solvers.outcome import EffectReport, EffectState


@dataclass(frozen=True)
class Situation:
    """A scene with its mechanism: what the measures look at."""

    scene: Scene
    bar: FourBar
    crank: float
    peaks: Peaks | None


@dataclass(frozen=True)
class LinkageEffect:
    """``needs`` names the field of the scene without which the effect cannot run."""

    name: str
    summary: str
    measure: str
    bound: Callable[[Situation], float]
    needs: str | None = None

    def influence(self, situation: Situation) -> float:
        return self.bound(situation)

    def can_run(self, scene: Scene) -> bool:
        return self.needs is None or getattr(scene, self.needs) is not None


def _elastic_share(situation: Situation) -> float:
    scene = situation.scene
    if situation.peaks is None or situation.peaks.force == 0:
        return 1.0
    peak = worst_elastic_peak(situation.bar, scene.coupler_stiffness, scene.impact_energy, scene.restitution)
    return peak / situation.peaks.force


def _tolerance_share(situation: Situation) -> float:
    return restitution_error(situation.bar, situation.crank, situation.scene.length_tolerance)


EFFECTS: tuple[LinkageEffect, ...] = (
    LinkageEffect(
        "envelope",
        "the swept box at its best orientation, and the enclosing circle",
        "1: its results exist only when it runs",
        lambda _: 1.0,
    ),
    LinkageEffect(
        "impact_dynamics",
        "steady running with a motor, a flywheel and the blow",
        "1: its results exist only when it runs",
        lambda _: 1.0,
        "drive",
    ),
    LinkageEffect(
        "coupler_elasticity",
        "the pin-force peak after a blow whose restitution is not the one designed for",
        "C sqrt(2 k_c E) |R - R_k| over the peak pin force, C = 1.82 for a small mismatch",
        _elastic_share,
        "coupler_stiffness",
    ),
    LinkageEffect(
        "tolerances",
        "closure and restitution with lengths off by their tolerance",
        "g/(g^2 - 1) times the relative errors of the lengths",
        _tolerance_share,
        "length_tolerance",
    ),
)
"""Every effect."""


def choose_for(
    situation: Situation,
    selection: EffectSelection = AUTO,
    tolerance: float = 1e-2,
    demands: tuple[Demand, ...] = (),
) -> Choice[LinkageEffect]:
    """The effects for a mechanism (see ``solvers.effects.choose``); one whose data are missing cannot run."""
    scene = situation.scene
    missing = [effect for effect in EFFECTS if not effect.can_run(scene)]
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
