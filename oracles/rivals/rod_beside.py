"""Quick evaluations of strips for searches: strips close to others are solved at the resolution that was found there.

A check of a strip that rings seeks the resolution of its vibration, which takes three times as long as to solve it at
one. What a search finds here is judged by a check of its own.
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
from solvers.rod.optimum.corrections import stands

_NEAR = 0.1
"""In ln sizes: so near a strip its resolution is enough for a search."""
_KEPT = 24
"""Strips whose resolutions are remembered."""
_CONTACT = frozenset({"friction"})
"""The effect that changes no other results; where nobody looks at its own, half of the time is saved."""


@dataclass
class Beside:
    """Checks of strips (b, h, l) [m] of a scene with given effects to about ``accuracy``; None where a strip rings
    beyond all bounds."""

    scene: rod.Scene
    choice: Choice[RodEffect]
    accuracy: float
    _known: list[tuple[Array, Cycle]] = field(default_factory=list)

    @staticmethod
    def of(problem: rod.RodProblem, selection: rod.EffectSelection, accuracy: float) -> Beside:
        """For the objective and the requirements of a problem."""
        demands = problem.requirements.demands() + problem.objective.demands()
        if not any(demand.effect in _CONTACT for demand in demands):
            selection = rod.EffectSelection(selection.include - _CONTACT, selection.exclude | _CONTACT)
        b = problem.bounds
        # With settled effects any strip will do.
        choice = choose_for(problem.scene, rod.Dimensions(b.b[1], b.h[1], b.l[0]), selection)
        return Beside(problem.scene, choice, accuracy)

    def __call__(self, sizes: Array) -> RodCheck | None:
        try:
            return check_chosen(self._cycle(sizes), self.choice, self.accuracy).value
        except InvalidInput:
            return None

    def _cycle(self, sizes: Array) -> Cycle:
        """The strip's turn, solved at the resolution of the nearest one known, if that fits."""
        d, x = rod.Dimensions(*map(float, sizes)), np.log(sizes)
        sought = Cycle(self.scene, d, compose(self.choice), tolerance_of(self.accuracy))
        if not sought.composition.corrections or not stands(sought):
            return sought
        near = min(self._known, key=lambda known: np.abs(x - known[0]).max(), default=None)
        if near is not None and np.abs(x - near[0]).max() < _NEAR:
            beside = near[1].beside([d])[0]
            if beside is not None:
                return beside
        self._known = [(x, sought), *self._known[: _KEPT - 1]]
        return sought
