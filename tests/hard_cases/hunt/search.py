"""Differential evolution that maximises the error, restarted until the time or the number of generations is used up."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
from scipy.optimize import differential_evolution

from solvers.errors import InvalidInput
from tests.hard_cases.hunt.quarry import Quarry

CROWD = 5
"""Points per dimension."""
GENERATIONS = 12
"""Generations per start: errors are rounding errors, so a population soon stops improving."""
_BROKEN = 1e18


@dataclass(frozen=True)
class Find:
    """A scene and its value with the largest error."""

    units: float
    value: str
    case: dict


@dataclass(frozen=True)
class Bag:
    """The worst value of every scene, sorted by error."""

    finds: tuple[Find, ...]

    @property
    def scenes(self) -> int:
        return len(self.finds)


def search(
    quarry: Quarry, seed: int, seconds: float, beginnings: float = math.inf, generations: int = GENERATIONS
) -> Bag:
    """Scenes judged within a time limit or, for reproducible results, within a number of starts."""
    finds: list[Find] = []
    until = time.monotonic() + seconds

    def cost(point: np.ndarray) -> float:
        case = quarry.case(point)
        if case is None or time.monotonic() > until:
            return 0.0
        try:
            worst = max(((_finite(units), name) for name, units in quarry.judge(case)), default=None)
        except InvalidInput:
            return 0.0
        if worst is None:
            return 0.0
        finds.append(Find(worst[0], worst[1], case))
        return -worst[0]

    begun = 0
    while time.monotonic() < until and begun < beginnings:
        differential_evolution(
            cost, [(0.0, 1.0)] * quarry.dimensions, maxiter=generations, popsize=CROWD, tol=0.0, polish=False,
            rng=np.random.default_rng([seed, begun]), callback=lambda *_, **__: time.monotonic() > until,
        )  # fmt: skip
        begun += 1
    return Bag(tuple(sorted(finds, key=lambda find: -find.units)))


def _finite(units: float) -> float:
    return units if math.isfinite(units) else _BROKEN
