"""A stepped bore, drilled from both ends: n cylinders that narrow toward the middle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput
from solvers.pin.flexibility import flexibility_values, product
from solvers.pin.form import Found
from solvers.pin.pointwise import Free
from solvers.pin.program import Program, least_walls_at
from solvers.pin.section import solidity_of, wall_of
from solvers.pin.separable import weigh
from solvers.pin.steps.bar import Law, Walls
from solvers.pin.steps.half import Half, at_stations, corners_of
from solvers.pin.steps.search import lightest_steps

Array = NDArray[np.float64]

MOST_STEPS = 12


def half_of(program: Program) -> Half[Program]:
    """Half a pin, as the search for steps sees it."""
    law = program.law

    def least_at(x: Array) -> Array:
        return solidity_of(least_walls_at(program.scene, program.criterion, program.floor, x))

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
        half = half_of(program)
        found = lightest_steps(half, self.steps, 0.0 if smooth is None else smooth.bound)
        if found is None:
            return None
        g, walls = program.scene.geometry, found.walls
        evidence = dict(found.evidence)
        if program.limit is not None:
            pulls = np.diff(half.sums().upto(np.concatenate([[0.0], found.places])), axis=1)
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
