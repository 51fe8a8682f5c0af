"""Results of a pin or bushing check."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from solvers.numerics.arrays import Array
from solvers.pin.ring.along_the_part import RingResult
from solvers.pin.ring.bearing_pressure import Pressures
from solvers.pin.scene import Scene


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


def along_the_part(table: Array, places: tuple[float, ...], scene: Scene) -> Stress:
    """Return about 400 stations of the whole part, including load boundaries, the shape's breaks ``places`` [m] and the
    station of maximum stress.

    ``table``: the rows of ``Stress`` at a program's stations, (6, n), the shear without its sign.
    """
    g = scene.geometry
    table = table[:, _kept(table, np.array([0.0, 0.5 * g.length, *scene.breakpoints, *places]), g.length / 400.0)]
    if scene.symmetric:
        mirrored = table[:, ::-1].copy()
        mirrored[0] = g.length - mirrored[0]
        table = np.concatenate([table, mirrored[:, 1:]], axis=1)
    table[4] = np.copysign(table[4], 0.5 * g.length - table[0])
    return Stress(*table)


def _kept(table: Array, places: Array, step: float) -> Array:
    """Mask of the columns kept: one per ``step``, the ends, ``places``, the maximum stress; of equal ones the first."""
    x, sizes = table[0], table[1:3]
    new = np.append(True, (np.diff(x) > 0.0) | (np.abs(np.diff(sizes)) > 1e-12 * sizes[:, :-1]).any(axis=0))
    places = np.sort(np.append(places, (x[0], x[-1], x[np.argmax(table[5])])))
    after = np.searchsorted(places, x).clip(1, places.size - 1)
    at_place = np.minimum(np.abs(x - places[after - 1]), np.abs(x - places[after])) <= 1e-12 * x[-1]
    return new & (at_place | (np.diff(np.floor(x / step), prepend=-1.0) > 0.0))


@dataclass(frozen=True)
class PinCheck:
    """Results of a pin or bushing check, SI units; None if a result does not exist (inactive effect, no wall, pin
    only).

    ``lightest_constant`` and ``capacity`` are functions that compute ``constant_mass`` and ``force_limit``,
    ``sections`` the distributions ``along`` the part, ``messages`` the ``warnings``, ``rings`` the ``ring``; each is
    called on first access.
    """

    mass: float
    solid_mass: float | None
    lightest_constant: Callable[[], float | None] = field(compare=False, repr=False)
    capacity: Callable[[], float] | None = field(compare=False, repr=False)
    sections: Callable[[], Stress] = field(compare=False, repr=False)
    messages: Callable[[PinCheck], tuple[str, ...]] = field(compare=False, repr=False)
    rings: Callable[[], RingResult] | None = field(compare=False, repr=False)
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
    pressures: Pressures | None

    @cached_property
    def ring(self) -> RingResult | None:
        """The part as a ring; None if the effect is inactive."""
        return self.rings and self.rings()

    @cached_property
    def constant_mass(self) -> float | None:
        """Mass [kg] of the lightest uniform diameter under the same limits; None if there is none."""
        return self.lightest_constant()

    @cached_property
    def force_limit(self) -> float | None:
        """Maximum force [N] that the solid pin carries; None for a bushing, whose outer diameter is the unknown."""
        return self.capacity and self.capacity()

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """One message per violated limit."""
        return self.messages(self)

    @cached_property
    def along(self) -> Stress:
        """About 400 stations from end to end, computed on first access."""
        return self.sections()


def finite(value: float) -> float | None:
    """Return a result, or None if it is not finite."""
    return float(value) if math.isfinite(value) else None
