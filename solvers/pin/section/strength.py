"""Strength constraints of a section, and the minimum wall of a pin for given forces.

All formulas of the pin use the relative wall w = 1 - d/D (0: no wall, 1: solid) to keep the digits of a thin wall:
v = 1 - (1 - w)^4, u = 1 - (1 - w)^2 = w(2 - w), v = u(2 - u). With dimensionless moment, axial force, shear and
torque, each strength criterion is one or more constraints

    v >= F(w) = sqrt(p(w)^2 + r(w)^2),    p = m + n (1 + (1-w)^2),    r = q (c0 + c1 w + c2 w^2) + t,

p and r non-negative, convex and decreasing on [0, 1]. A feasible wall exists exactly if F(1) <= 1;
``solvers.pin.section.least_wall`` finds the minimum.

With t = D - d and D^4 - d^4 = t (2d + t)(D^2 + d^2), free of cancellation for a thin wall, the same constraint for any
bore d and any outer diameter D is

    G(t) = sqrt(p^2 + r^2)/(stress (D^4 - d^4)) <= 1,   p = (32/pi) M D + (4/pi) N (D^2 + d^2),
    r = k (Q (c0 D^2 + c1 D t + c2 t^2) + (16/pi) T D):

with the coefficients above it holds for a pin in units of its diameter, with those for a diameter of 1 m for any part.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.pin.load.macaulay import InternalForces
from solvers.pin.scene import PinMaterial
from solvers.pin.section.criteria import ONLY_SHEAR, Criterion, ShearLaw

SLACK = 1e-9
"""Relative excess up to which a violation is not reported."""


class StrengthConstraint(NamedTuple):
    """F(w) at every station, over the allowable stress.

    ``bending`` m and ``shear`` q have shape (n,); ``axial`` n and ``torsion`` t are constant along the pin.
    ``separate``: the constraint of a separate shear allowable.
    """

    bending: Array
    shear: Array
    axial: float
    torsion: float
    law: ShearLaw
    separate: bool = False


def strength_constraints(
    criterion: Criterion, cases: Sequence[InternalForces], diameter: float, material: PinMaterial
) -> tuple[StrengthConstraint, ...]:
    """Return a criterion's constraints for all load cases on a section of this outer diameter, including the
    material's shear allowable; for a bushing, whose outer diameter is sought, with 1 m.

    v times the maximum stresses over the allowable: normal stress 32 M/(pi D^3) + 4 |N| (1 + (1-w)^2)/(pi D^2), shear
    stress Q s(w)/D^2 + 16 |T|/(pi D^3).
    """
    law, rows = criterion.law(material), [(False, factors, material.allowable_stress) for factors in criterion.factors]
    if material.allowable_shear is not None:
        rows.append((True, ONLY_SHEAR, material.allowable_shear))
    found = []
    for forces in cases:
        for separate, factors, stress in rows:
            area, cube = diameter**2 * stress, math.pi * diameter**3 * stress
            found.append(
                StrengthConstraint(
                    (factors.bending * 32.0 / cube) * forces.moment,
                    (factors.shear / area) * forces.shear,
                    factors.axial * 4.0 * abs(forces.axial_force) / (math.pi * area),
                    factors.torsion * 16.0 * abs(forces.torque) / cube,
                    law,
                    separate,
                )
            )
    return tuple(found)


@kernel
def utilisation(t: float, d: float, m: float, n: float, q: float, s: float, c0: float, c1: float, c2: float):
    """Return G and -d ln G/d ln t of a section with bore d and t = D - d."""
    D = d + t
    full = t * (2.0 * d + t) * (D * D + d * d)
    shape = d * (c0 * d + (2.0 * c0 + c1) * t) + (c0 + c1 + c2) * t * t
    p, dp = m * D + n * (D * D + d * d), m + 2.0 * n * D
    r, dr = q * shape + s * D, q * (d * (2.0 * c0 + c1) + 2.0 * (c0 + c1 + c2) * t) + s
    size = max(abs(p), abs(r))
    if size == 0.0:
        return 0.0, 1.0
    a, b = p / size, r / size
    f = math.sqrt(a * a + b * b)
    exponent = 4.0 * D * D * D * t / full - t * (a * dp + b * dr) / (size * f * f)
    return size * f / full, exponent


@kernel
def _raise_utilisations(
    bending: Array, shear: Array, n: float, s: float, c0: float, c1: float, c2: float, bore: Array, thickness: Array,
    out: Array,
) -> None:  # fmt: skip
    for i in range(out.size):
        if max(bending[i], shear[i], n, s) > 0.0:
            value = np.inf
            if thickness[i] > 0.0:
                value = utilisation(thickness[i], bore[i], bending[i], n, shear[i], s, c0, c1, c2)[0]
            out[i] = max(out[i], value)


def utilisations(constraints: Sequence[StrengthConstraint], bore: Array, thickness: Array) -> Array:
    """Return the maximum G of the criterion and of the shear allowable, (2, n), at d and t = D - d, (n,) each.

    1 at full utilisation, inf where a loaded section has no wall, 0 where unloaded.
    """
    out = np.zeros((2, thickness.size))
    for c in constraints:
        row, law = out[int(c.separate)], c.law
        _raise_utilisations(c.bending, c.shear, c.axial, c.torsion, law.c0, law.c1, law.c2, bore, thickness, row)
    return out


def where_over(x: Array, utilisations: Array) -> tuple[float, float] | None:
    """Return the first and last position [m] at which the larger of the utilisations (2, n), interpolated linearly
    between stations, exceeds 1; None: nowhere."""
    utilisation, ends = utilisations.max(axis=0), []
    over = np.flatnonzero(utilisation > 1.0)
    if not over.size:
        return None
    for inner, outer in ((over[0], over[0] - 1), (over[-1], over[-1] + 1)):
        place = float(x[inner])
        if 0 <= outer < x.size and math.isfinite(utilisation[inner]):
            place += float(
                (x[outer] - x[inner]) * (utilisation[inner] - 1.0) / (utilisation[inner] - utilisation[outer])
            )
        ends.append(place)
    return ends[0], ends[1]
