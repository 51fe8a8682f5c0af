"""Capacity of the solid pin: maximum force, location of failure, and required outer diameter."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from solvers.numerics.arrays import Array
from solvers.pin.load.macaulay import ROUNDING
from solvers.pin.optimum.discretised import constraints_at
from solvers.pin.optimum.program import Program
from solvers.pin.scene import Scene
from solvers.pin.section.criteria import Criterion
from solvers.pin.section.strength import utilisations
from solvers.pin.stations.between_nodes import maximum_excess
from solvers.pin.stations.initial_panels import initial_stations

_MAX_PASSES = 60
_ROOM, _DIAMETER_TOLERANCE = 1e-9, 1e-13
"""Extension of the bracket of log D at both ends, and tolerance of the root."""


@dataclass(frozen=True)
class WeakSpan:
    """Range [m] in which even the solid section fails, and its maximum utilisation."""

    begin: float
    end: float
    utilisation: float


def solid_utilisation(scene: Scene, criterion: Criterion, x: Array, panel_start: Array) -> Array:
    """Return the maximum utilisation of the solid section over all constraints at stations; feasible if F(1) <= 1."""
    return utilisations(constraints_at(scene, criterion, x, panel_start), np.zeros_like(x), np.ones_like(x)).max(axis=0)


def greatest_utilisation(scene: Scene, criterion: Criterion) -> tuple[float, float]:
    """Return (utilisation, position) of the solid pin's critical section; panels that may contain a larger value are
    halved."""
    stations = initial_stations(scene)
    for _ in range(_MAX_PASSES):
        values = solid_utilisation(scene, criterion, stations.x, stations.panel_start)
        between = maximum_excess(stations, values[None]) > ROUNDING
        if not between.any():
            break
        stations = stations.halved(between)
    best = int(np.argmax(values))
    return float(values[best]), float(stations.x[best])


def force_limit(scene: Scene, criterion: Criterion) -> float:
    """Return the maximum force [N] that the solid pin carries; further cases scale in proportion."""
    probe = scene if scene.force > 0 else replace(scene, force=1.0, further_cases=())
    return probe.force / greatest_utilisation(probe, criterion)[0]


def force_limit_of(program: Program) -> float:
    """Return ``force_limit`` from a program's stations, if they resolve the maximum."""
    values = program.utilisations(np.ones_like(program.stations.x)).max(axis=0)
    greatest = float(values.max())
    if not greatest > 0.0 or (maximum_excess(program.stations, values[None]) > ROUNDING).any():
        return force_limit(program.scene, program.criterion)
    return program.scene.force / greatest


def weak_span(scene: Scene, criterion: Criterion) -> WeakSpan | None:
    """Return the range along the pin in which the solid section fails; None if it fails nowhere."""
    from scipy.optimize import brentq

    worst, place = greatest_utilisation(scene, criterion)
    if worst <= 1.0:
        return None
    length = scene.geometry.length
    stations = initial_stations(scene)
    x, panel_start = stations.x, stations.panel_start
    fails = solid_utilisation(scene, criterion, x, panel_start) > 1.0
    inside = np.append(x[fails], place)

    def excess(at: float) -> float:
        return float(solid_utilisation(scene, criterion, *np.array([[at], [at]]))[0]) - 1.0

    def edge(good: float, bad: float) -> float:
        return brentq(excess, good, bad) if excess(good) < 0.0 < excess(bad) else bad

    first, last = float(inside.min()), float(inside.max())
    before, behind = x[(x < first) & ~fails], x[(x > last) & ~fails]
    begin = edge(float(before.max()), first) if before.size else first
    if scene.symmetric:
        return WeakSpan(begin, length - begin, worst)
    return WeakSpan(begin, edge(float(behind.min()), last) if behind.size else last, worst)


def least_outer_diameter(scene: Scene, criterion: Criterion) -> float:
    """Return the least outer diameter [m] whose solid pin carries the loads, all else equal; 0 without a load."""
    from scipy.optimize import brentq

    def worst(diameter: float) -> float:
        return greatest_utilisation(
            replace(scene, geometry=replace(scene.geometry, outer_diameter=diameter)), criterion
        )[0]

    own = scene.geometry.outer_diameter
    now = worst(own)
    if now == 0.0:
        return 0.0
    # The utilisation decreases at least as 1/D, at most as 1/D^3.
    least, most = sorted((math.log(now) / 3.0, math.log(now)))
    found = brentq(lambda x: math.log(worst(own * math.exp(x))), least - _ROOM, most + _ROOM, xtol=_DIAMETER_TOLERANCE)
    return own * math.exp(found + _DIAMETER_TOLERANCE)
