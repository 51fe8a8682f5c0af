"""Choosing effects before the strip is known: the bounds at their worst over a box of dimensions.

Each bound is, along any one dimension, monotone or has one minimum inside, so its greatest value lies at a corner; a
strip that would not meet the required stability is no answer, so corners thinner than that are moved up to it. This is
an argument about the leading terms, not a proof: a design evaluates the bounds again at its answer (``choose_for``).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

from solvers.effects import AUTO, Choice, Demand, EffectSelection, choose
from solvers.rod.effect_bounds.situation import Situation
from solvers.rod.effects import EFFECTS, RodEffect
from solvers.rod.scene import Dimensions, Scene

_CLEAR_OF_BUCKLING = 1.05


def worst_situations(
    scene: Scene, lower: Dimensions, upper: Dimensions, least_stability_safety: float = _CLEAR_OF_BUCKLING
) -> tuple[Situation, ...]:
    """The corners of the box lower … upper, the thin ones moved up to the required stability safety.

    Never empty: where no corner is stable enough, the stoutest one stands for the box. A safety required below 1.05 is
    taken as 1.05, since the bounds grow without limit toward buckling.
    """
    wanted = max(least_stability_safety, _CLEAR_OF_BUCKLING)
    found, stoutest = [], Situation.of(scene, Dimensions(upper.b, upper.h, lower.l))
    for b, h, l in product((lower.b, upper.b), (lower.h, upper.h), (lower.l, upper.l)):
        corner = stoutest.resized(Dimensions(b, h, l))
        # P_cr grows with h^3 about the weak axis, which the crank's plane contains for b >= h.
        needed = h * max(1.0, wanted * corner.compression / corner.critical) ** (1.0 / 3.0)
        if needed <= upper.h:
            found.append(corner if needed == h else stoutest.resized(Dimensions(b, needed, l)))
    return tuple(found) or (stoutest,)


@dataclass(frozen=True)
class _AtWorst:
    """An effect whose bound is the greatest over several situations."""

    effect: RodEffect

    @property
    def name(self) -> str:
        return self.effect.name

    @property
    def summary(self) -> str:
        return self.effect.summary

    @property
    def measure(self) -> str:
        return self.effect.measure

    def influence(self, situations: tuple[Situation, ...]) -> float:
        return max(self.effect.influence(situation) for situation in situations)


def choose_over_box(
    scene: Scene,
    lower: Dimensions,
    upper: Dimensions,
    selection: EffectSelection = AUTO,
    tolerance: float = 1e-2,
    demands: tuple[Demand, ...] = (),
    least_stability_safety: float = _CLEAR_OF_BUCKLING,
) -> Choice[RodEffect]:
    """The effects for every strip of the box (see ``solvers.effects.choose``); raises what that raises."""
    situations = worst_situations(scene, lower, upper, least_stability_safety)
    choice = choose(tuple(_AtWorst(effect) for effect in EFFECTS), situations, selection, tolerance, demands)
    return Choice(tuple(worst.effect for worst in choice.active), choice.manifest)
