"""Forms of a bushing's outside: turned freely, turned from both ends, one diameter, steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput
from solvers.pin.bushing.dual import bound, strength_bound, weigh
from solvers.pin.bushing.program import BushingProgram, assemble, refined
from solvers.pin.bushing.section import least_gaps
from solvers.pin.effects import Physics
from solvers.pin.optimum.found import Found
from solvers.pin.optimum.lagrangian import rising
from solvers.pin.optimum.slope_limit import missed_by_slope
from solvers.pin.shapes.break_points.bar import Law, Walls
from solvers.pin.shapes.break_points.half import Half, at_stations, corners_of
from solvers.pin.shapes.break_points.paths import flexibilities
from solvers.pin.shapes.break_points.search import lightest_steps
from solvers.pin.shapes.free import missed_by_order
from solvers.pin.shapes.stepped import MOST_STEPS
from solvers.pin.stations.between_nodes import risen

Array = NDArray[np.float64]
_PASSES = 40


def gentle(program: BushingProgram, low: Array) -> Array:
    """The least y above ``low`` whose outer diameter changes no faster than the slope limit: two sweeps, exact."""
    slope, x = program.limits.max_slope, program.stations.x
    if slope is None:
        return low
    gap, reach = program.gap_of(low), slope * x
    # t(x) = max over x' of t_min(x') - s |x - x'|.
    forward = np.maximum.accumulate(gap + reach) - reach
    backward = np.maximum.accumulate((gap - reach)[::-1])[::-1] + reach
    return np.maximum(low, program.y_of(np.maximum(forward, backward)))


@dataclass(frozen=True)
class Turned:
    """Any outside; ``one_way`` keeps it from shrinking toward the middle."""

    one_way: bool = False

    @property
    def name(self) -> str:
        return "drillable" if self.one_way else "free"

    def find(self, program: BushingProgram, gap: float) -> Found:
        low = rising(program.lower, program.anchor) if self.one_way else program.lower
        low = gentle(program, low)
        found = weigh(program, low, self.one_way)
        if found.multiplier > 0.0 and program.limits.max_slope is not None:
            raise InvalidInput(
                "limits.max_slope", "stands beside a deflection limit that shapes the bushing", "one of the two"
            )
        volume = program.volume(found.y)
        if found.multiplier == 0.0:
            least, method = strength_bound(program, low), "every station's wall is the least that holds"
        else:
            least = bound(program, low, found.multiplier, found.y, self.one_way)
            method = "Lagrangian dual, tangents at the answer"
        doubt = program.stations.doubt(found.y) + self._missed(program)
        if program.limit is not None and found.multiplier > 0.0:
            doubt = doubt + found.multiplier / program.limit * program.stations.doubt(program.densities(found.y))
        evidence = {"multiplier": found.multiplier, "rounds": found.rounds}
        return Found(found.y, volume, min(least, volume), method, evidence, doubt=doubt)

    def _missed(self, program: BushingProgram) -> Array:
        """What running extremes miss between stations, as volume."""
        missed, low = np.zeros(program.stations.left.size), program.lower
        if self.one_way:
            missed, low = missed_by_order(program.stations, low, program.anchor), rising(low, program.anchor)
        if program.limits.max_slope is not None:
            gap = program.gap_of(low)
            # y = t (2d + t)/l^2 changes by at most 2 (d + t)/l^2 of what t changes.
            scale = 2.0 * (program.scene.geometry.bore + float(gap.max())) / program.unit**2
            missed = missed + scale * missed_by_slope(program.stations, gap, program.limits.max_slope)
        return missed


def _one_size(program: BushingProgram, least: float) -> float:
    """The least y of one diameter all along that keeps the deflection limit."""
    ones = np.ones_like(program.lower)
    if program.limit is None or program.deflection(least * ones) <= program.limit:
        return least
    low, high = least, 2.0 * max(least, 1e-12)
    while program.deflection(high * ones) > program.limit:
        low, high = high, 4.0 * high
    while high - low > 4e-16 * high:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        low, high = (middle, high) if program.deflection(middle * ones) > program.limit else (low, middle)
    return high


@dataclass(frozen=True)
class Constant:
    """One outer diameter all along."""

    name: str = "constant"

    def find(self, program: BushingProgram, gap: float) -> Found:
        y = _one_size(program, float(program.lower.max()))
        outer, length = program.scene.geometry.bore + float(program.gap_of(np.array([y]))[0]), _length(program)
        return Found(
            np.full_like(program.lower, y), y, y * (1.0 - 1e-12), "one unknown",
            corners=((0.0, outer), (length, outer)),
            doubt=risen(program.stations, program.lower[None]) * (y if y == program.lower.max() else 0.0),
        )  # fmt: skip


def lightest_constant(program: BushingProgram, physics: Physics, accuracy: float) -> Found:
    """The lightest bushing of one outer diameter, on the program's panels and halves of those that may hold its weakest
    section between stations."""
    for _ in range(_PASSES):
        found = Constant().find(program, accuracy)
        between = found.doubt > 0.1 * accuracy * found.volume
        if not between.any():
            break
        program = assemble(program.scene, program.limits, program.criterion, physics, refined(program, between))
    return found


def _length(program: BushingProgram) -> float:
    return program.scene.geometry.length


def half_of(program: BushingProgram) -> Half[BushingProgram]:
    """Half a bushing, as the search for steps sees it."""
    scene, length = program.scene, _length(program)

    def least_at(x: Array) -> Array:
        places = (x,) if scene.symmetric else (x, length - x)
        gaps = [least_gaps(scene, program.criterion, program.floor, at, at) for at in places]
        return program.y_of(np.max(gaps, axis=0))

    def lightest(reduced: BushingProgram) -> Walls:
        found = weigh(reduced, reduced.lower, True)
        return Walls(found.y, reduced.volume(found.y), found.multiplier)

    return Half(program, Law(program.kappa, program.a, program.b), least_at, lightest)


@dataclass(frozen=True)
class Stepped:
    """``steps`` different outer diameters from each end to the middle."""

    steps: int
    name: str = "stepped"

    def __post_init__(self) -> None:
        if not 1 <= self.steps <= MOST_STEPS:
            raise InvalidInput("form.steps", "is no number of steps this form knows", f"1 … {MOST_STEPS}")

    def find(self, program: BushingProgram, gap: float) -> Found:
        if self.steps == 1:
            return Constant().find(program, gap)
        if program.limits.max_slope is not None:
            raise InvalidInput("limits.max_slope", "a step has no slope", "no slope limit with steps")
        # No steps are lighter than the outside that may widen all the way.
        smooth = 0.0 if program.limit is None else Turned(one_way=True).find(program, gap).bound
        half = half_of(program)
        found = lightest_steps(half, self.steps, smooth)
        evidence = dict(found.evidence)
        if program.limit is not None:
            pulls = np.diff(half.sums().upto(np.concatenate([[0.0], found.places])), axis=1)
            gives = np.array([flexibilities(u, half.law.kappa, half.law.a, half.law.b)[:2] for u in found.walls.levels])
            total = float(np.sum(np.maximum(pulls, 0.0) * gives.T))
            evidence["deflection_as_constrained_um"] = 1e6 * program.limit * total
        walls, length = found.walls, _length(program)
        places = found.places * 0.5 * length
        outer = program.scene.geometry.bore + program.gap_of(walls.levels)
        return Found(
            at_stations(program, places, walls.levels), walls.volume, float(min(found.bound, walls.volume)),
            found.method, evidence, corners=corners_of(places, outer, length),
        )  # fmt: skip
