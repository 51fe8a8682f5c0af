"""Results of a pin or bushing check."""

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
    """Distributions along the whole part: positions, bores, outer diameters [m], moment [N m], shear [N], equivalent
    stress [Pa], each (n,)."""

    x: Array
    bore: Array
    outer: Array
    moment: Array
    shear: Array
    equivalent: Array


@dataclass(frozen=True)
class Sections:
    """The rows of ``Stress`` at a program's stations, (6, n), with the shape breaks ``places`` [m] and the symmetry."""

    table: Array
    places: tuple[float, ...]
    geometry: Geometry | BushingGeometry
    symmetric: bool

    def along(self) -> Stress:
        """Return about 400 stations of the whole part, including load and shape breaks and the station of maximum
        stress."""
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
    """Results of a pin or bushing check, SI units; None if a result does not exist (inactive effect, no wall, pin
    only).

    ``lightest_constant`` and ``capacity`` compute ``constant_mass`` and ``force_limit``, ``sections`` the table behind
    ``along``, each when it is first read.
    """

    mass: float
    solid_mass: float | None
    lightest_constant: Callable[[], float | None] = field(compare=False, repr=False)
    capacity: Callable[[], float | None] = field(compare=False, repr=False)
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
    warnings: tuple[str, ...]

    @cached_property
    def constant_mass(self) -> float | None:
        """Mass [kg] of the lightest uniform diameter under the same limits; None if there is none."""
        return self.lightest_constant()

    @cached_property
    def force_limit(self) -> float | None:
        """Maximum force [N] that the solid pin carries; None for a bushing."""
        return self.capacity()

    @cached_property
    def along(self) -> Stress:
        """About 400 stations from end to end, computed on first access."""
        return self.sections().along()


def finite(value: float) -> float | None:
    """Return a result, or None if it is not finite."""
    return float(value) if math.isfinite(value) else None
