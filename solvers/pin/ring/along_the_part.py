"""Ring model of a checked part, in the middle and at the thinnest wall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.numerics.arrays import Array
from solvers.pin.ring import ovalization
from solvers.pin.scene import Scene

_MIN_RING_WALL = 1e-5
"""Minimum wall, relative to the radius, for which the ring model is evaluated."""
_MIN_DIAMETER = 1e-9
"""Minimum outer diameter [m], that of a shaft without a load."""


@dataclass(frozen=True)
class RingResult:
    """Ring results in the middle of the part, and maxima over its length (None if the wall vanishes; at the end of a
    shaft only the stress)."""

    ovalization: float
    ovalization_max: float | None
    stresses: ovalization.Ring
    stress_max: float | None
    model: str


def ring_of(scene: Scene, bore: Array, outer: Array, middle: int = -1) -> RingResult:
    """Evaluate the ring in the middle and at the thinnest wall, where ovalization and stress are greatest.

    ``bore`` and ``outer`` [m]: diameters along the part, ``middle``: index of those in its middle.
    """
    m = scene.material

    def ring(k: int, least_ratio: float = 0.0) -> ovalization.Ring:
        diameter = max(float(outer[k]), _MIN_DIAMETER)
        ratio = max(min(float(bore[k]) / diameter, 1.0 - _MIN_RING_WALL), least_ratio)
        return ovalization.ring(scene.force, diameter, scene.geometry.length, ratio, m.elastic_modulus, m.poisson)

    thinnest = int(np.argmin(outer - bore))
    at_middle = ring(middle)
    if not bore[thinnest] <= outer[thinnest] * (1.0 - _MIN_RING_WALL):
        return RingResult(at_middle.ovalization, None, at_middle, None, at_middle.model)
    same = bore[thinnest] == bore[middle] and outer[thinnest] == outer[middle]
    at_thinnest, stress = at_middle if same else ring(thinnest), None
    # The ovalization of a shaft does not depend on its diameter, and is defined at an end without load as well.
    if outer[thinnest] >= _MIN_DIAMETER:
        is_wide = bore[thinnest] >= ovalization.MIN_HOOP_RATIO * outer[thinnest]
        stress = (at_thinnest if is_wide else ring(thinnest, ovalization.MIN_HOOP_RATIO)).greatest
    return RingResult(at_middle.ovalization, at_thinnest.ovalization, at_middle, stress, at_middle.model)
