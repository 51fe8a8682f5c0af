"""A stepped bore, drilled from both ends: n cylinders that narrow toward the middle."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput
from solvers.pin.optimum.discretised import Program, least_walls_at
from solvers.pin.optimum.found import Found
from solvers.pin.optimum.lagrangian import rising, weigh
from solvers.pin.section.flexibility import flexibility_values, product
from solvers.pin.section.variables import solidity_of, wall_of
from solvers.pin.shapes.break_points.bar import Law, Walls
from solvers.pin.shapes.break_points.half import Half, at_stations, corners_of
from solvers.pin.shapes.break_points.search import Steps, lightest_steps
from solvers.pin.shapes.free import Free

Array = NDArray[np.float64]

MOST_STEPS = 12


_AS_SOLID = 1e-9
"""What a limit that is the solid pin's deflection but for rounding may be worth, relative to the mass."""


def half_of(program: Program, solid_from: float = math.inf) -> Half[Program]:
    """Half a pin, as the search for steps sees it, solid behind a place [m]."""
    law = program.law

    def least_at(x: Array) -> Array:
        least = solidity_of(least_walls_at(program.scene, program.criterion, program.floor, x))
        return np.where(x > solid_from, 1.0, least)

    def lightest(reduced: Program) -> Walls | None:
        found = weigh(reduced, None, True)
        return None if found is None else Walls(found.solidity, reduced.volume(found.solidity), found.multiplier)

    return Half(program, Law(-1.0, law.a, law.b), least_at, lightest)


@dataclass(frozen=True)
class Stepped:
    """``steps`` different bores from each end to the middle."""

    steps: int
    name: str = "stepped"

    def __post_init__(self) -> None:
        if not 1 <= self.steps <= MOST_STEPS:
            raise InvalidInput("form.steps", "is no number of steps this form knows", f"1 … {MOST_STEPS}")

    def find(self, program: Program, gap: float) -> Found | None:
        if program.limits.max_slope is not None and self.steps > 1:
            raise InvalidInput("limits.max_slope", "a step has no slope", "no slope limit with a stepped bore")
        # No steps are lighter than the bore that may narrow all the way.
        smooth = Free(drillable=True).find(program, gap) if program.limit is not None else None
        found = self._search(program, 0.0 if smooth is None else smooth.bound)
        if found is None:
            return None
        g, walls = program.scene.geometry, found.walls
        evidence = dict(found.evidence)
        if program.limit is not None:
            pulls = np.diff(half_of(program).sums().upto(np.concatenate([[0.0], found.places])), axis=1)
            gives = flexibility_values(walls.levels, program.law)
            total = sum(
                float(product(np.maximum(pull, 0.0), give).sum()) for pull, give in zip(pulls, gives, strict=True)
            )
            evidence["deflection_as_constrained_um"] = 1e6 * program.limit * total
        places = found.places * 0.5 * g.length
        return Found(
            at_stations(program, places, walls.levels), float(walls.volume), float(min(found.bound, walls.volume)),
            found.method, evidence,
            corners=corners_of(places, g.outer_diameter * (1.0 - wall_of(walls.levels)), g.length),
        )  # fmt: skip

    def _search(self, program: Program, known: float) -> Steps | None:
        weighed = None if program.limit is None else weigh(program, rising(program.lower, program.anchor), True)
        if weighed is None or not math.isinf(weighed.multiplier):
            return lightest_steps(half_of(program), self.steps, known)
        # Only a solid span keeps the limit: what is left to choose lies before it, and strength alone asks for walls.
        start, x = program.scene.reference.left * (1.0 + _AS_SOLID), program.stations.x
        span = (x > start) & (program.scene.geometry.length - x > start)
        held = replace(program, limit=None, lower=np.where(span, 1.0, program.lower))
        found = lightest_steps(half_of(held, start), self.steps, known)
        return None if found is None else replace(found, bound=found.bound * (1.0 - _AS_SOLID))
