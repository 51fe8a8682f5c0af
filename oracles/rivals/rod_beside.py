"""Fast evaluation of strips for searches: the vibration is solved at the resolution found for a nearby strip.

Finding the resolution of a vibration takes three times as long as solving at a known one. Winners found with these
evaluations must be confirmed by an ordinary check.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from oracles.rivals.hunt import Array
from solvers import rod
from solvers.effects import Choice
from solvers.errors import InvalidInput
from solvers.rod.check import RodCheck, check_chosen, tolerance_of
from solvers.rod.cycle.composition import Cycle
from solvers.rod.effects import RodEffect, choose_for, compose
from solvers.rod.optimum.full_model.corrections import is_stable

_NEAR = 0.1
"""Maximum distance, in the logarithms of the sizes, at which another strip's resolution is accurate enough for a
search."""
_KEPT = 24
"""Number of strips whose resolutions are kept."""
_CONTACT = frozenset({"friction"})
"""An effect that only adds results of its own. If no objective or limit needs them, leaving it out halves the time."""


@dataclass
class Beside:
    """Checks of strips (b, h, l) [m] of a scene with given effects to about ``accuracy``; None where the vibration is
    unbounded."""

    scene: rod.Scene
    choice: Choice[RodEffect]
    accuracy: float
    _known: list[tuple[Array, Cycle]] = field(default_factory=list)

    @staticmethod
    def of(problem: rod.RodProblem, selection: rod.EffectSelection, accuracy: float) -> Beside:
        """Checks that provide what a problem's objective and requirements need."""
        demands = problem.requirements.demands() + problem.objective.demands()
        if not any(demand.effect in _CONTACT for demand in demands):
            selection = rod.EffectSelection(selection.include - _CONTACT, selection.exclude | _CONTACT)
        # The selection fixes every effect, so the choice does not depend on the strip.
        choice = choose_for(problem.scene, problem.bounds.stiffest, selection)
        return Beside(problem.scene, choice, accuracy)

    def __call__(self, sizes: Array) -> RodCheck | None:
        try:
            return check_chosen(self._cycle(sizes), self.choice, self.accuracy).value
        except InvalidInput:
            return None

    def _cycle(self, sizes: Array) -> Cycle:
        """The strip's revolution, solved at the resolution of the nearest known strip if that is applicable."""
        d, x = rod.Dimensions(*map(float, sizes)), np.log(sizes)
        sought = Cycle(self.scene, d, compose(self.choice), tolerance_of(self.accuracy))
        if not sought.composition.corrections or not is_stable(sought):
            return sought
        near = min(self._known, key=lambda known: np.abs(x - known[0]).max(), default=None)
        if near is not None and np.abs(x - near[0]).max() < _NEAR:
            beside = near[1].neighbours([d])[0]
            if beside is not None:
                return beside
        self._known = [(x, sought), *self._known[: _KEPT - 1]]
        return sought
