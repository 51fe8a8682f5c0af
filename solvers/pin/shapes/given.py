"""A given profile: linear between points, with a step where two points share a position."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from solvers.errors import InvalidInput
from solvers.numerics.arrays import Array
from solvers.pin.load.macaulay import ROUNDING
from solvers.pin.scene import BushingGeometry, Geometry, Scene
from solvers.pin.shapes.contour import Contour
from solvers.pin.stations.lobatto_panels import LEAST_PANEL, separated


@dataclass(frozen=True)
class Profile:
    """Bore diameters [m] (outer diameters of a bushing) at non-decreasing positions [m]; a repeated position is a
    step.

    Points up to the middle of the pin define both halves. The profile is constant before the first and after the
    last point.
    """

    x: tuple[float, ...]
    bore: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.x or len(self.x) != len(self.bore):
            raise InvalidInput("profile", "needs a bore for every place, and one point at least", "pairs of numbers")
        for k, (place, bore) in enumerate(zip(self.x, self.bore, strict=True)):
            if not (math.isfinite(place) and place >= 0):
                raise InvalidInput(f"profile.{k}.x", "must not be negative", "[0, length of the pin]")
            if not (math.isfinite(bore) and bore >= 0):
                raise InvalidInput(f"profile.{k}.bore", "must not be negative", "[0, outer diameter)")
            if k and place < self.x[k - 1]:
                raise InvalidInput(f"profile.{k}.x", "lies before the point ahead of it", "places that do not fall")

    def require_inside(self, geometry: Geometry | BushingGeometry) -> None:
        """Raise InvalidInput for points beyond the part and sizes that leave no wall."""
        for k, (place, bore) in enumerate(zip(self.x, self.bore, strict=True)):
            if place > geometry.length * (1.0 + 1e-9):
                raise InvalidInput(f"profile.{k}.x", "lies beyond the part's end", "at most its length")
            geometry.require_size(k, bore)

    def along(self, length: float) -> WholeProfile:
        """Return the profile over the whole pin."""
        x, bore = list(self.x), list(self.bore)
        middle = 0.5 * length
        mirrored = x[-1] <= middle * (1.0 + 1e-12)
        if mirrored:
            x, bore = x + [length - p for p in reversed(x)], bore + bore[::-1]
        if x[0] > 0.0:
            x, bore = [0.0, *x], [bore[0], *bore]
        if x[-1] < length:
            x, bore = [*x, length], [*bore, bore[-1]]
        return WholeProfile(tuple(min(p, length) for p in x), tuple(bore), mirrored)


@dataclass(frozen=True)
class WholeProfile:
    """Points from end to end; ``mirrored`` if those of the second half were generated from the first half's."""

    x: tuple[float, ...]
    bore: tuple[float, ...]
    mirrored: bool = False

    def is_symmetric(self, length: float, walls: Array) -> bool:
        """Return whether the profile is symmetric, to rounding of the ``walls`` at the points.

        Between the combined positions both profiles are linear, so it suffices to compare the ends of the segments,
        on both sides of a step.
        """
        if self.mirrored:
            return True
        mirror_image = WholeProfile(tuple(length - p for p in reversed(self.x)), self.bore[::-1])
        edges = np.array(separated([*self.x, *mirror_image.x], LEAST_PANEL * length))
        side, x = np.tile(0.5 * (edges[:-1] + edges[1:]), 2), np.concatenate([edges[:-1], edges[1:]])
        own, mirrored = self.between(walls, x, side), mirror_image.between(walls[::-1], x, side)
        return bool(np.all(np.abs(own - mirrored) <= ROUNDING * np.maximum(own, mirrored)))

    def contour(self, scene: Scene) -> Contour:
        """Return the profile as straight pieces, over one half of a symmetric part."""
        length = scene.geometry.length
        end = 0.5 * length if scene.symmetric else length
        x, size = np.array(self.x), np.array(self.bore)
        kept = (x[1:] > x[:-1]) & (x[:-1] < end)
        first, last, start, stop = size[:-1][kept], size[1:][kept], x[:-1][kept], x[1:][kept]
        slope = (last - first) / (stop - start)
        clipped = np.minimum(stop, end)
        return Contour(
            np.stack([start, clipped, first, first + slope * (clipped - start), slope, slope], axis=1), length
        )

    def between(self, values: Array, x: Array, side: Array) -> Array:
        """Interpolate values given at the points to stations x with ``side`` as in ``Stations``: linear, with steps
        where two points share a position."""
        points = np.array(self.x)
        k = np.minimum(np.searchsorted(points, side, side="right") - 1, points.size - 2)
        width = points[k + 1] - points[k]
        fraction = np.divide(x - points[k], width, out=np.zeros_like(x), where=width > 0.0)
        return values[k] + np.minimum(np.maximum(fraction, 0.0), 1.0) * (values[k + 1] - values[k])
