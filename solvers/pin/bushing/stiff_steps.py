"""Steps of a bushing under a deflection limit: exact diameters for given breaks, the breaks by local search.

With the breaks given, the diameters are the same convex program with one unknown a step. The breaks move one by one
over the ends of some fifty panels a half; no proof that none is better.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from solvers.pin.bushing.dual import Weighed, weigh
from solvers.pin.bushing.program import BushingProgram, assemble
from solvers.pin.pointwise import Lumped
from solvers.pin.program import Physics
from solvers.pin.stations import NODES

Array = NDArray[np.float64]
_PANELS = 48
_SWEEPS = 6


def stiff_steps(program: BushingProgram, places: Array) -> tuple[Array, Array, float]:
    """(inner ends [m], y of every step, volume) of the best steps found from these breaks on."""
    half = _half(program)
    ends, peaks = half.stations.right, np.maximum.accumulate(half.lower)

    def levels_for(chosen: list[int]) -> tuple[float, Weighed]:
        parts = [slice(a, b) for a, b in pairwise([0, *((p + 1) * NODES for p in chosen)])]
        share = np.array([half.share[part].sum() for part in parts])
        bend, shear = (np.array([half.share[p] @ c[p] for p in parts]) / share for c in (half.bending, half.shear))
        edges = np.concatenate([[0.0], np.cumsum(share)])
        low = np.array([peaks[part.stop - 1] for part in parts])
        lumped = replace(
            half, stations=Lumped(edges[:-1], edges[1:], share), lower=low, bending=bend, shear=shear, anchor=low.size
        )
        found = weigh(lumped, low, True)
        return lumped.volume(found.y), found

    chosen = [int(np.argmin(np.abs(ends - place))) for place in places]
    for k in range(places.size - 2, -1, -1):
        chosen[k] = max(min(chosen[k], chosen[k + 1] - 1), 0)
    best = levels_for(chosen)
    for _ in range(_SWEEPS):
        before = best[0]
        for k in range(places.size - 1):
            for trial in range(chosen[k - 1] + 1 if k else 0, chosen[k + 1]):
                moved = [*chosen[:k], trial, *chosen[k + 1 :]]
                candidate = levels_for(moved)
                if candidate[0] < best[0]:
                    best, chosen = candidate, moved
        if best[0] >= before * (1.0 - 1e-9):
            break
    return ends[chosen], best[1].y, best[0]


def _half(program: BushingProgram) -> BushingProgram:
    """The program of one half on at least so many panels; both halves' demands on each station."""
    stations = program.stations
    while stations.left.size < _PANELS * (1 if program.scene.symmetric else 2):
        wide = stations.right - stations.left
        stations = stations.halved(wide > 0.5 * wide.max())
    physics = Physics(shear_deflection=bool(np.any(program.shear > 0.0)))
    fine = assemble(program.scene, program.limits, program.criterion, physics, stations)
    fine = replace(fine, limit=program.limit)
    if program.scene.symmetric:
        return fine
    middle, panels = fine.anchor, fine.anchor // NODES

    def mean(values: Array) -> Array:
        return 0.5 * (values[:middle] + values[middle:][::-1])

    return replace(
        fine, stations=stations.first(panels), anchor=middle,
        lower=np.maximum(fine.lower[:middle], fine.lower[middle:][::-1]),
        bending=mean(fine.bending), shear=mean(fine.shear),
    )  # fmt: skip
