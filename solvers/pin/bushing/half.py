"""Half a bushing, as the search for steps sees it (``solvers.pin.steps``)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.pin.bushing.dual import weigh
from solvers.pin.bushing.program import BushingProgram
from solvers.pin.bushing.section import least_gaps
from solvers.pin.pointwise import Lumped
from solvers.pin.stations import NODES
from solvers.pin.steps.bar import Law, Sums, Walls, kinks

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Half:
    """The half of a bushing that must meet the demands of both."""

    program: BushingProgram

    @cached_property
    def half(self) -> BushingProgram:
        p = self.program
        if p.scene.symmetric:
            return p
        middle, panels = p.anchor, p.anchor // NODES

        def mean(values: Array) -> Array:
            return 0.5 * (values[:middle] + values[middle:][::-1])

        return replace(
            p, stations=p.stations.first(panels), anchor=middle,
            lower=np.maximum(p.lower[:middle], p.lower[middle:][::-1]), bending=mean(p.bending), shear=mean(p.shear),
        )  # fmt: skip

    @property
    def law(self) -> Law:
        return Law(self.program.kappa, self.program.a, self.program.b, 1.0)

    @cached_property
    def edges(self) -> Array:
        return kinks(self.program.scene.cases, self.program.scene.geometry.length, self.program.scene.reference)

    @cached_property
    def _peaks(self) -> Array:
        return np.maximum.accumulate(self.half.lower)

    @cached_property
    def _sums(self) -> Sums | None:
        half = self.half
        if half.limit is None:
            return None
        return Sums(half.stations, half.bending / half.limit, half.shear / half.limit)

    def least(self, t: Array) -> Array:
        """The greatest least y from the end up to places that rise."""
        p, length = self.program, self.program.scene.geometry.length
        x = 0.5 * length * t
        before = np.clip(np.searchsorted(self.half.stations.x, x, side="right") - 1, 0, None)
        found = self._peaks[before]
        for at in (x,) if p.scene.symmetric else (x, length - x):
            found = np.maximum(found, p.y_of(least_gaps(p.scene, p.criterion, p.floor, at, at)))
        return np.maximum.accumulate(found)

    def sums(self) -> Sums | None:
        """The deflection's two coefficients; None without a limit."""
        return self._sums

    def weigh(self, places: Array) -> Walls:
        """The least y of steps that end at these places."""
        low, share = self.least(places), np.diff(places, prepend=0.0)
        sums = np.diff(self._sums.upto(np.concatenate([[0.0], places])), axis=1)
        mean = np.divide(sums, share, out=np.zeros_like(sums), where=share > 0.0) * self.half.limit
        reduced = replace(
            self.half, stations=Lumped(np.concatenate([[0.0], places[:-1]]), places, share), lower=low,
            bending=np.maximum(mean[0], 0.0), shear=np.maximum(mean[1], 0.0), anchor=places.size,
        )  # fmt: skip
        found = weigh(reduced, low, True)
        return Walls(found.y, reduced.volume(found.y), found.multiplier)
