"""A stepped bore, drilled from both ends: n cylinders that narrow toward the middle."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput
from solvers.pin.form import Found
from solvers.pin.pointwise import Free, Lumped
from solvers.pin.program import Program, folded, least_walls_at, unfolded
from solvers.pin.section import solidity_of, wall_of
from solvers.pin.separable import weigh
from solvers.pin.steps.bar import Law, Sums, Walls, kinks
from solvers.pin.steps.search import lightest_steps

Array = NDArray[np.float64]

MOST_STEPS = 12


@dataclass(frozen=True)
class _Half:
    """Half a pin, as the search for steps sees it."""

    program: Program

    @cached_property
    def half(self) -> Program:
        return folded(self.program)

    @property
    def law(self) -> Law:
        law = self.program.law
        return Law(-1.0, law.a, law.b, law.knee)

    @cached_property
    def edges(self) -> Array:
        return kinks(self.program.scene.cases, self.program.scene.geometry.length, self.program.scene.reference)

    @cached_property
    def _peaks(self) -> Array:
        return np.maximum.accumulate(self.half.lower)

    def least(self, t: Array) -> Array:
        p = self.program
        middle = 0.5 * p.scene.geometry.length
        x = t * middle
        before = np.clip(np.searchsorted(self.half.stations.x, x, side="right") - 1, 0, None)
        own = solidity_of(least_walls_at(p.scene, p.criterion, p.floor, x))
        return np.maximum.accumulate(np.maximum(self._peaks[before], own))

    @cached_property
    def _sums(self) -> Sums | None:
        half = self.half
        if half.limit is None:
            return None
        return Sums(half.stations, half.bending / half.limit, half.shear / half.limit)

    def sums(self) -> Sums | None:
        return self._sums

    def weigh(self, places: Array) -> Walls | None:
        low, share = self.least(places), np.diff(places, prepend=0.0)
        sums = np.diff(self._sums.upto(np.concatenate([[0.0], places])), axis=1)
        mean = np.divide(sums, share, out=np.zeros_like(sums), where=share > 0.0) * self.half.limit
        lumped = Lumped(np.concatenate([[0.0], places[:-1]]), places, share)
        reduced = replace(
            self.half, stations=lumped, lower=low, bending=np.maximum(mean[0], 0.0), shear=np.maximum(mean[1], 0.0),
            anchor=places.size,
        )  # fmt: skip
        found = weigh(reduced, None, True)
        return None if found is None else Walls(found.solidity, reduced.volume(found.solidity), found.multiplier)


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
        half = _Half(program)
        # No steps are lighter than the bore that may narrow all the way.
        smooth = Free(drillable=True).find(program, gap) if program.limit is not None else None
        found = lightest_steps(half, self.steps, 0.0 if smooth is None else smooth.bound)
        if found is None:
            return None
        walls, bound = found.walls, found.bound
        middle = 0.5 * program.scene.geometry.length
        return self._found(
            program, half.half, found.places * middle, walls.levels, walls.volume, bound, found.method, found.evidence
        )

    def _found(
        self, program: Program, half: Program, places: Array, walls: Array, volume: float, bound: float,
        method: str, evidence: dict[str, float | int | str],
    ) -> Found:  # fmt: skip
        g = program.scene.geometry
        x = half.stations.x
        # A station on a break belongs to the side of its panel.
        inside = 0.5 * (half.stations.left + half.stations.right)
        step = np.searchsorted(places[:-1], np.repeat(inside, x.size // inside.size), side="right")
        bores = g.outer_diameter * (1.0 - wall_of(walls))
        corners = []
        begin = 0.0
        for place, bore in zip(places, bores, strict=True):
            corners += [(begin, float(bore)), (float(place), float(bore))]
            begin = float(place)
        corners += [(g.length - p, bore) for p, bore in reversed(corners)]
        return Found(
            unfolded(program, walls[np.minimum(step, walls.size - 1)]), float(volume), float(min(bound, volume)),
            method, evidence, corners=tuple(corners),
        )  # fmt: skip
