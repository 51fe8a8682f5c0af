"""The effects that a design selects at its strips, as a check of each would."""

from __future__ import annotations

from dataclasses import dataclass, field

from solvers.effects import Choice, EffectSelection
from solvers.outcome import EffectReport, EffectState
from solvers.rod.effects import EFFECTS, RodEffect, choose_for
from solvers.rod.influences.situation import Situation
from solvers.rod.problem import RodProblem
from solvers.rod.scene import Dimensions

_ON_THE_WAY = "needed by a strip that the search evaluated"


@dataclass
class EffectsAtStrips:
    """Effects selected for a problem at any strip, to an effect ``tolerance``."""

    problem: RodProblem
    selection: EffectSelection
    tolerance: float
    _choices: dict[Dimensions, Choice[RodEffect]] = field(default_factory=dict)

    def at(self, strip: Dimensions) -> frozenset[str]:
        """Names of the effects selected at a strip."""
        return frozenset(effect.name for effect in self._choice(strip).active)

    def influence(self, strip: Dimensions, names: tuple[str, ...]) -> float:
        """Sum of the bounds of some effects at a strip."""
        if strip in self._choices:
            return sum(report.influence for report in self._choices[strip].manifest if report.name in names)
        situation = Situation(self.problem.scene, strip, self.selection.exclude)
        return sum(effect.influence(situation) for effect in EFFECTS if effect.name in names)

    def probably_at(self, strip: Dimensions, name: str) -> bool:
        """Whether a strip selects an effect, judged by the influence of this one alone."""
        s = self.selection
        if s.automatic and name not in s.include | s.exclude:
            return self.influence(strip, (name,)) > self.tolerance
        return name not in s.exclude

    def manifest(self, strip: Dimensions, chosen: frozenset[str]) -> tuple[EffectReport, ...]:
        """The effects of an answer found with those ``chosen``, some of them perhaps at strips on the way only."""
        return tuple(
            report._replace(state=EffectState.ACTIVE, why=_ON_THE_WAY)
            if report.name in chosen and report.state is EffectState.SKIPPED
            else report
            for report in self._choice(strip).manifest
        )

    def _choice(self, strip: Dimensions) -> Choice[RodEffect]:
        if strip not in self._choices:
            p = self.problem
            demands = p.objective.demands() + p.requirements.demands()
            self._choices[strip] = choose_for(p.scene, strip, self.selection, self.tolerance, demands)
        return self._choices[strip]
