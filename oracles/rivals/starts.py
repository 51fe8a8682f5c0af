"""Starts and effort of the local searches: from the answer, from parts along its active limits, and from other
parts."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from oracles.rivals.hunt import Array, Hunt, Spent
from oracles.rivals.search import WAYS, search

NEAR, FAR = 0.01, 0.1
"""Initial steps of searches from near and far starts, in the logarithms of the sizes."""
_ACTIVE = 1e-3
"""Logarithmic margin below which a limit is active, and logarithmic distance below which a size lies on its bound."""
_ON_BOUND = 1e-6
_STEPS = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
"""Lengths of the steps along a limit, as logarithms of the sizes."""


@dataclass(frozen=True)
class Strength:
    """Effort of a competition: number of starts, search methods, and checks per search (not counting its polishing or
    descent over a grid).

    No search is begun after ``most`` checks.
    """

    starts: int
    evaluations: int = 120
    ways: tuple[str, ...] = tuple(WAYS)
    most: int = 100_000

    def __str__(self) -> str:
        return f"{', '.join(self.ways)} from {self.starts} starts, {self.evaluations} checks each at first"


def compete(hunt: Hunt, near: Sequence[Array], far: Sequence[Array], strength: Strength) -> None:
    """Run every method from every start, with shorter initial steps from starts near the answer."""
    numbered = list(enumerate([*near, *far][: strength.starts]))
    searches = [(way, number, start) for number, start in numbered for way in strength.ways]
    if hunt.rough:
        # Method by method: the fast one runs first, and its end points stop most searches of the other early.
        searches.sort(key=lambda one: strength.ways.index(one[0]))
    for way, number, start in searches:
        # If only feasibility is in question, one feasible part is enough.
        if hunt.evaluations < strength.most and (hunt.seeking or hunt.best is None):
            search(hunt, way, start, strength.evaluations, NEAR if number < len(near) else FAR)


def along(hunt: Hunt, here: Array, rng: np.random.Generator, count: int) -> list[Array]:
    """Parts a few per cent away, in directions that leave the active limits unchanged, if such directions exist."""
    free = hunt.space.free
    held = np.vstack([_slopes(hunt, here)[1], _bounds_held(hunt, here)])
    out = []
    for _ in range(count):
        direction = rng.standard_normal(len(free))
        inside = _within(direction, held)
        if np.linalg.norm(inside) < 1e-6:
            inside = direction
        moved = here.copy()
        moved[list(free)] += 10 ** rng.uniform(-2.5, -1.0) * inside / np.linalg.norm(inside)
        out.append(hunt.clipped(moved))
    return out


def step_along_limits(hunt: Hunt, here: Array) -> None:
    """Evaluate growing steps along each active limit, to both sides, in the direction of steepest descent of the cost;
    slightly infeasible ones are pulled back."""
    free = hunt.space.free
    cost, limits = _slopes(hunt, here)
    for limit in limits:
        downhill = _within(-cost, np.vstack([limit, _bounds_held(hunt, here)]))
        if (length := float(np.linalg.norm(downhill))) < 1e-9:
            continue
        for step in _STEPS:
            for way in (1.0, -1.0):
                moved = here.copy()
                moved[list(free)] += way * step * downhill / length
                hunt.allow(8, "a step along a limit")
                with contextlib.suppress(Spent):
                    hunt.at(hunt.clipped(moved))
                    hunt.pull_in()


def _slopes(hunt: Hunt, here: Array) -> tuple[Array, Array]:
    """Gradients of the cost and of the active limits."""
    free = hunt.space.free
    hunt.allow(len(free) + 1, "")
    try:
        cost, margins = hunt.slopes(here, free)
        return cost, margins[hunt.at(here).margins < _ACTIVE]
    except Spent:
        return np.zeros(len(free)), np.zeros((0, len(free)))


def _bounds_held(hunt: Hunt, here: Array) -> Array:
    """Directions of the sizes that lie on a bound."""
    space, free = hunt.space, list(hunt.space.free)
    room = np.minimum(here - np.log(space.lower), np.log(space.upper) - here)[free]
    return np.eye(len(free))[room < _ON_BOUND]


def _within(direction: Array, held: Array) -> Array:
    """Project a direction onto the subspace that leaves ``held`` unchanged."""
    return direction - np.linalg.pinv(held) @ (held @ direction) if held.size else direction
