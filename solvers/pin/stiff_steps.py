"""A stepped bore under a deflection limit: exact walls for given break points, the break points by local search.

With the break points given, the walls are a convex program of as many unknowns as steps, solved like any other by one
multiplier. The break points move one by one over the ends of some hundred panels; no proof that none is better.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from solvers.pin.pointwise import segments
from solvers.pin.program import Program, assemble, folded, opening_stations
from solvers.pin.separable import Weighed, weigh

Array = NDArray[np.float64]
_PANELS = 96
_SWEEPS = 6


@dataclass(frozen=True)
class StiffSteps:
    """Inner ends of the steps [m], u of each, their volume, and the deflection's multiplier (0: it is no limit)."""

    places: Array
    walls: Array
    volume: float
    multiplier: float


def stiff_steps(program: Program, places: Array) -> StiffSteps | None:
    """The best steps found from these break points on; None where even the solid pin deflects too much."""
    scene = program.scene
    stations = opening_stations(scene, tuple(float(p) for p in places[:-1]))
    while stations.left.size < _PANELS * (1 if scene.symmetric else 2):
        wide = stations.right - stations.left
        stations = stations.halved(wide > 0.5 * wide.max())
    half = folded(assemble(scene, program.limits, program.criterion, program.physics, stations, program.law))
    ends, peaks = half.stations.right, np.maximum.accumulate(half.lower)
    per_panel = half.stations.x.size // ends.size

    def walls_for(chosen: list[int]) -> tuple[float, Weighed] | None:
        """Volume and walls of steps that end with these panels."""
        parts = [slice(a, b) for a, b in pairwise([0, *((p + 1) * per_panel for p in chosen)])]
        reduced = segments(half, np.array([peaks[p.stop - 1] for p in parts]), parts)
        weighed = weigh(reduced, None, True)
        return None if weighed is None else (reduced.volume(weighed.solidity), weighed)

    chosen = [int(np.argmin(np.abs(ends - place))) for place in places]
    for k in range(places.size - 2, -1, -1):
        chosen[k] = max(min(chosen[k], chosen[k + 1] - 1), 0)
    best = walls_for(chosen)
    if best is None:
        return None
    for _ in range(_SWEEPS if best[1].multiplier > 0.0 else 0):
        before = best[0]
        for k in range(places.size - 1):
            for trial in range(chosen[k - 1] + 1 if k else 0, chosen[k + 1]):
                moved = [*chosen[:k], trial, *chosen[k + 1 :]]
                candidate = walls_for(moved)
                if candidate is not None and candidate[0] < best[0]:
                    best, chosen = candidate, moved
        if best[0] >= before * (1.0 - 1e-9):
            break
    return StiffSteps(ends[chosen], best[1].solidity, best[0], best[1].multiplier)
