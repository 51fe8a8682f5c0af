"""Ring results of a check: in the middle of the part and at its thinnest wall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.pin.optimum.program import Sought
from solvers.pin.ring import ovalization
from solvers.pin.scene import Scene

Array = NDArray[np.float64]
_MIN_RING_WALL = 1e-5
"""Minimum wall, relative to the radius, for which the ring model is evaluated."""


@dataclass(frozen=True)
class RingResult:
    """Ring results in the middle of the part and their maxima over its length (None if the wall vanishes)."""

    ovalization: float
    ovalization_max: float | None
    stresses: ovalization.RingStresses
    stress_max: float | None
    model: str


def ring_of(scene: Scene, sought: Sought, sizes: Array) -> RingResult:
    """Evaluate the ring in the middle and at the thinnest wall, where ovalization and stress are greatest.

    ``sizes`` [m] along the part; of a symmetric one from its end to the middle.
    """
    m = scene.material

    def like(size: float) -> tuple[float, ...]:
        bore, outer = sought.pair(size)
        return scene.force, outer, scene.geometry.length, bore / outer, m.elastic_modulus, m.poisson

    middle, thinnest = float(sizes[sizes.size - 1 if scene.symmetric else sizes.size // 2]), sought.thinnest(sizes)
    own = ovalization.ring(*like(sought.with_wall(middle, _MIN_RING_WALL)))
    if thinnest != sought.with_wall(thinnest, _MIN_RING_WALL):
        return RingResult(own.ovalization, None, own.stresses, None, own.model)
    most = own if thinnest == middle else ovalization.ring(*like(thinnest))
    stress = ovalization.greatest_stress(*like(thinnest))
    return RingResult(own.ovalization, most.ovalization, own.stresses, stress, own.model)
