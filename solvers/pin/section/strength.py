"""Strength constraints of a section, and the minimum wall of a pin for given forces.

All formulas of the pin use the relative wall w = 1 - d/D (0: no wall, 1: solid) to keep the digits of a thin wall:
v = 1 - (1 - w)^4, u = 1 - (1 - w)^2 = w(2 - w), v = u(2 - u). With dimensionless moment, axial force, shear and
torque, each strength criterion is one or more constraints

    v >= F(w) = sqrt(p(w)^2 + r(w)^2),    p = m + n (1 + (1-w)^2),    r = q (c0 + c1 w + c2 w^2) + t,

p and r non-negative, convex and decreasing on [0, 1]. A feasible wall exists exactly if F(1) <= 1;
``solvers.pin.section.least_wall`` finds the minimum.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.pin.load.internal_forces import InternalForces
from solvers.pin.scene import PinMaterial
from solvers.pin.section.criteria import ALLOWABLE_SHEAR, Criterion, ShearLaw
from solvers.pin.section.least_wall import least_walls, raise_uses

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StrengthConstraint:
    """F(w) at every station, over ``stress``.

    ``bending`` m and ``shear`` q have shape (n,); ``axial`` n and ``torsion`` t are constant along the pin.
    """

    name: str
    bending: Array
    shear: Array
    axial: float
    torsion: float
    law: ShearLaw
    stress: float


def _constraint(
    name: str, forces: InternalForces, diameter: float, stress: float, law: ShearLaw, factor: float
) -> StrengthConstraint:
    """Return v times the maximum stresses over ``stress``.

    Normal stress 32 M/(pi D^3) + 4 |N| (1 + (1-w)^2)/(pi D^2), and ``factor`` times the shear stress of the shear
    force, Q s(w)/D^2, and of the torque, 16 |T|/(pi D^3).
    """
    area, cube = diameter**2 * stress, math.pi * diameter**3 * stress
    return StrengthConstraint(
        name,
        (32.0 / cube) * forces.moment_total,
        (factor / area) * forces.shear_total,
        4.0 * abs(forces.axial_force) / (math.pi * area),
        factor * 16.0 * abs(forces.torque) / cube,
        law,
        stress,
    )


def strength_constraints(
    criterion: Criterion, cases: Sequence[InternalForces], diameter: float, material: PinMaterial
) -> tuple[StrengthConstraint, ...]:
    """Return a criterion's constraints for all load cases on a section of this outer diameter, including the
    material's shear allowable; for a bushing, whose outer diameter is sought, with 1 m."""
    stress, law, found = material.allowable_stress, criterion.law(material), []
    for forces in cases:
        found += [
            _constraint(share.name, share.forces, diameter, stress, law, share.factor)
            for share in criterion.shares(forces)
        ]
        if material.allowable_shear is not None:
            only = InternalForces(np.zeros_like(forces.moment), forces.shear, 0.0, forces.torque)
            found.append(_constraint(ALLOWABLE_SHEAR, only, diameter, material.allowable_shear, law, 1.0))
    return tuple(found)


def least_wall(constraints: Sequence[StrengthConstraint], floor: float, stations: int) -> Array:
    """Return the minimum relative wall w of every station, (n,), at least ``floor``; NaN where the solid section
    fails.

    Valid for any load; the relative error is a few rounding errors times the condition of the problem, which is
    unbounded only at F(1) -> 1 without shear (w -> 1 as the fourth root of the margin).
    """
    found = np.full(stations, floor)
    for constraint in constraints:
        law = constraint.law
        least_walls(
            constraint.bending, constraint.shear, constraint.axial, constraint.torsion, law.c0, law.c1, law.c2, found
        )
    return found


def uses(constraints: Sequence[StrengthConstraint], wall: Array) -> Array:
    """Return the maximum F(w)/v(w) at relative walls (n,), of the criterion and of the shear allowable, (2, n).

    1 at full utilisation, inf without a wall, 0 where unloaded.
    """
    out = np.zeros((2, wall.size))
    for c in constraints:
        row, law = int(c.name == ALLOWABLE_SHEAR), c.law
        raise_uses(c.bending, c.shear, c.axial, c.torsion, law.c0, law.c1, law.c2, wall, out[row])
    return out
