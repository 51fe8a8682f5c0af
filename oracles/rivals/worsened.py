"""Deliberately worsened answers of rod designs: a competition that does not beat them proves nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from oracles.rivals.rod import log_cost, looker, settled, space_of
from solvers import rod
from solvers.outcome import Outcome

_ACCURACY = 1e-8
_FARTHEST, _TRIES = 0.3, 200
"""Maximum step in the logarithms of the sizes, and number of random directions."""


def worsened(
    problem: rod.RodProblem, outcome: Outcome[rod.RodDesign], by: float, seed: int = 0
) -> Outcome[rod.RodDesign] | None:
    """The answer moved in a random direction, within bounds and limits, until its logarithmic objective is worse by
    ``by``; None if no such strip is found, and for sizes in steps."""
    space, rng = space_of(problem), np.random.default_rng(seed)
    selection = settled(outcome.effects)
    look, free = looker(problem, selection, _ACCURACY), np.array(space.free)
    d = outcome.value.check.dimensions
    x, low, high = np.log([d.b, d.h, d.l]), np.log(space.lower), np.log(space.upper)
    if space.stepped:
        return None
    wanted = log_cost(problem, outcome.value.check) + by
    for _ in range(_TRIES):
        way = np.zeros(3)
        way[free] = rng.standard_normal(free.size)
        # A size on a bound stays there or moves inside.
        way = np.where((x - low < 1e-9) & (way < 0.0) | (high - x < 1e-9) & (way > 0.0), 0.0, way)
        if not way.any():
            continue
        way /= np.abs(way).max()

        def excess(step: float, way: np.ndarray = way) -> float:
            return look(np.exp(np.clip(x + step * way, low, high))).cost - wanted

        # Grow the step until the strip is bad enough, which brackets the first crossing.
        step = 1e-5
        while step < _FARTHEST and excess(step) < 0.0:
            step *= 2.0
        if not (step < _FARTHEST and np.isfinite(excess(step))):
            continue
        found = np.exp(np.clip(x + brentq(excess, 0.0, step, rtol=1e-6) * way, low, high))
        if look(found).violation == 0.0:
            check = rod.check(problem.scene, rod.Dimensions(*found.tolist()), selection, accuracy=_ACCURACY).value
            return replace(outcome, value=replace(outcome.value, check=check))
    return None
