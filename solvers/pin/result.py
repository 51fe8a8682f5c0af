"""What a check of a pin or a bushing finds."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.pin.ring.bearing_pressure import Pressures
from solvers.pin.ring_results import RingResult
from solvers.pin.scene import BushingGeometry, Geometry

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Stress:
    """Along the whole part: places, bores, outer diameters [m], moment [N m], shear [N], equivalent stress [Pa], each
    (n,)."""

    x: Array
    bore: Array
    outer: Array
    moment: Array
    shear: Array
    equivalent: Array


@dataclass(frozen=True)
class Sections:
    """What ``Stress`` has, (6, n), at a program's stations; places where a shape begins; whether the stations of one
    half stand for both."""

    table: Array
    places: tuple[float, ...]
    geometry: Geometry | BushingGeometry
    symmetric: bool

    def along(self) -> Stress:
        """About four hundred stations of the whole part, among them those where a load or a shape begins and the one of
        the greatest stress."""
        table, g, (x, bore, outer) = self.table, self.geometry, self.table[:3]
        starts = {0.0, g.boss_length, g.boss_length + g.gap, 0.5 * g.length, *self.places}
        worst = np.argmax(np.nan_to_num(table[5]))
        fixed = np.isin(x, [*starts, x[0], x[worst], x[-1]])
        same = np.zeros(x.size, dtype=bool)
        same[1:] = (x[1:] == x[:-1]) & (np.abs(np.diff(bore)) <= 1e-12 * bore[:-1])
        same[1:] &= np.abs(np.diff(outer)) <= 1e-12 * outer[:-1]
        keep: list[int] = []
        step, last = g.length / 400.0, -math.inf
        for i, (place, must, again) in enumerate(zip(x.tolist(), fixed.tolist(), same.tolist(), strict=True)):
            repeated = again and keep and keep[-1] == i - 1
            if (must and not repeated) or (place - last >= step and not again):
                keep.append(i)
                last = place
        table = table[:, keep]
        if self.symmetric:
            mirrored = table[:, ::-1].copy()
            mirrored[0] = g.length - mirrored[0]
            mirrored[4] = -mirrored[4]
            table = np.concatenate([table, mirrored[:, 1:]], axis=1)
        return Stress(*table)


@dataclass(frozen=True)
class PinCheck:
    """The results of a check of a pin or a bushing, SI units; None where a result does not exist (an effect that did
    not run, no wall, what only a pin has).

    ``constant_mass`` is what one diameter all along would weigh under the same limits, ``force_limit`` the greatest
    force that a solid pin carries.
    """

    mass: float
    solid_mass: float | None
    constant_mass: float | None
    sections: Callable[[], Sections] = field(compare=False, repr=False)
    min_bore: float
    bore_mid: float
    max_outer: float
    outer_mid: float
    least_wall: float
    max_moment: float
    max_shear: float
    equivalent_stress_max: float | None
    worst_section: float
    shear_stress_max: float | None
    strength_utilisation: float | None
    deflection: float | None
    ring: RingResult | None
    pressures: Pressures | None
    force_limit: float | None
    warnings: tuple[str, ...]

    @cached_property
    def along(self) -> Stress:
        """The part from end to end, at some four hundred places; made when it is first read."""
        return self.sections().along()


def finite(value: float) -> float | None:
    """A result, or None where there is none."""
    return float(value) if math.isfinite(value) else None
