"""A stepped bore under a deflection limit: branch and bound over the break points, exact walls for the best.

With the break points given, the walls are a convex program of as many unknowns as steps, solved like any other by one
multiplier. The break points lie on the ends of some thousand panels; the bound holds for break points anywhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from solvers.pin.pointwise import segments
from solvers.pin.program import Program, assemble, folded, opening_stations
from solvers.pin.separable import weigh
from solvers.pin.stations import NODES
from solvers.pin.step_boxes import Sums, closed

Array = NDArray[np.float64]
_PANELS = 4096
_MOST_BOXES = 100_000
"""About a second: up to three steps the boxes end between neighbouring panels, with more they end here."""


@dataclass(frozen=True)
class StiffSteps:
    """Inner ends of the steps [m], u of each, their volume, its lower bound over all break points, the deflection's
    multiplier (0: it is no limit), and the boxes of break points looked at."""

    places: Array
    walls: Array
    volume: float
    bound: float
    multiplier: float
    boxes: int


def _summed(half: Program) -> Sums:
    def sums(values: Array) -> Array:
        return np.concatenate([[0.0], np.cumsum((half.share * values).reshape(-1, NODES).sum(axis=1))])

    share = sums(np.ones_like(half.lower))
    peaks = np.maximum.accumulate(half.lower)[NODES - 1 :: NODES]
    law, limit = half.law, half.limit
    return Sums(
        share / share[-1], sums(half.bending) / limit, sums(half.shear) / limit,
        np.concatenate([half.lower[:1], peaks]), law.a, law.b, law.knee,
    )  # fmt: skip


def stiff_steps(program: Program, places: Array, gap: float) -> StiffSteps | None:
    """The lightest steps, sought from these break points on; None where even the solid pin deflects too much."""
    scene = program.scene
    stations = opening_stations(scene, tuple(float(p) for p in places[:-1]))
    while stations.left.size < _PANELS * (1 if scene.symmetric else 2):
        wide = stations.right - stations.left
        stations = stations.halved(wide > 0.5 * wide.max())
    half = folded(assemble(scene, program.limits, program.criterion, program.physics, stations, program.law))
    ends = np.concatenate([[0.0], half.stations.right])
    start = np.array([0, *(int(np.argmin(np.abs(ends - place))) for place in places)])
    for k in range(start.size - 2, 0, -1):
        start[k] = max(min(start[k], start[k + 1] - 1), k)
    sums = _summed(half)
    at, bound, boxes = closed(sums, start, gap, _MOST_BOXES if places.size > 1 else 2)
    parts = [slice(NODES * a, NODES * b) for a, b in pairwise(at.tolist())]
    reduced = segments(half, sums.least[at[1:]], parts)
    weighed = weigh(reduced, None, True)
    if weighed is None:
        return None
    volume = reduced.volume(weighed.solidity)
    return StiffSteps(ends[at[1:]], weighed.solidity, volume, min(bound, volume), weighed.multiplier, boxes)
