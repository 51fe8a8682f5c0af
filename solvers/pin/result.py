"""Results of a pin or bushing check."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from solvers.numerics.arrays import Array
from solvers.pin.optimum.design_variable import design_variable_of
from solvers.pin.optimum.program import constraints_at
from solvers.pin.ring.along_the_part import RingResult
from solvers.pin.ring.bearing_pressure import Pressures
from solvers.pin.scene import Scene
from solvers.pin.section.criteria import Criterion
from solvers.pin.shapes.contour import Contour
from solvers.pin.shapes.delivered import tolerance_of

_CHORDS = 1e-4
"""Least relative excess of the stress tolerated in straight lines between positions."""


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


def sections_of(
    scene: Scene, criterion: Criterion, diameter: Callable[[], Contour], worst: float, accuracy: float
) -> Stress:
    """Return the distributions along the whole part at 75 positions and more, including load boundaries, the shape's
    breaks and the section ``worst`` [m]. Straight lines between its diameters exceed no stress by more than the
    accuracy or 1e-4."""
    shape, variable, length = diameter(), design_variable_of(scene), scene.geometry.length
    half = shape.rows[-1, 1]
    # A bushing's stress may decrease with the cube of its wall.
    tolerance = max(tolerance_of(accuracy), 0.5 * _CHORDS) / (1.0 if variable.sign < 0.0 else 3.0)
    x, side = shape.points(length / 75.0, variable.given, tolerance)
    further = np.array([place for place in (worst, *scene.breakpoints) if place <= half])
    x, side = np.append(x, further), np.append(side, further)
    order = np.lexsort((side, x))
    x, side = x[order], side[order]
    sizes = np.clip(shape.at(x, side), *((0.0, variable.given) if variable.sign < 0.0 else (variable.given, np.inf)))
    new = (np.diff(x, prepend=-1.0) > 1e-12 * length) | (np.abs(np.diff(sizes, prepend=-1.0)) > 1e-12 * sizes)
    x, side, sizes = x[new], side[new], sizes[new]
    own, thickness = scene.own_forces(x, side), variable.thickness(sizes) / variable.unit_diameter
    used = variable.utilisations(constraints_at(scene, criterion, x, side), thickness)[0]
    given = np.full_like(sizes, variable.given)
    bore, outer = (sizes, given) if variable.sign < 0.0 else (given, sizes)
    table = np.stack([x, bore, outer, own[0], own[1], scene.material.allowable_stress * used])
    if scene.symmetric:
        mirrored = table[:, -2::-1].copy()
        mirrored[0] = length - mirrored[0]
        table = np.concatenate([table, mirrored], axis=1)
    table[4] = np.copysign(table[4], 0.5 * length - table[0])
    return Stress(*table)


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
        """75 positions and more from end to end, computed on first access."""
        return self.sections()


def finite(value: float) -> float | None:
    """Return a result, or None if it is not finite."""
    return float(value) if math.isfinite(value) else None
