"""The section of a pin: stresses, and the wall that carries given forces.

Everything is written in the relative wall w = 1 - d/D (0: no wall, 1: solid), so that a thin wall keeps its digits:
v = 1 - (1 - w)^4, u = 1 - (1 - w)^2 = w(2 - w), v = u(2 - u). With the moment, axial force, shear and torque made
dimensionless, each strength criterion is one or more demands

    v >= F(w) = sqrt(p(w)^2 + r(w)^2),    p = m + n (1 + (1-w)^2),    r = q (c0 + c1 w + c2 w^2) + t,

p and r not negative, convex and falling on [0, 1]. A wall exists exactly if F(1) <= 1; ``solvers.pin.walls`` finds it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.pin.loads import InternalForces
from solvers.pin.scene import PinMaterial
from solvers.pin.walls import demanded, least_walls

Array = NDArray[np.float64]


ALLOWABLE_SHEAR = "allowable_shear"
"""The demand of a limit on the shear stress, apart from the criterion's."""


@dataclass(frozen=True)
class ShearLaw:
    """Greatest shear stress of a tube: tau = Q s(w)/(D^2 v), s = c0 + c1 w + c2 w^2."""

    c0: float
    c1: float
    c2: float


def zhuravsky() -> ShearLaw:
    """tau = 16 Q (D^2 + D d + d^2)/(3 pi (D^4 - d^4)): the mean over the neutral axis (Zhuravsky, Jourawski)."""
    k = 16.0 / (3.0 * math.pi)
    return ShearLaw(3.0 * k, -3.0 * k, k)


def saint_venant(poisson: float) -> ShearLaw:
    """tau = 4 Q ((3+2nu) D^2 + (1+2nu) d^2)/(pi (1+nu)(D^4 - d^4)): the greatest, by elasticity.

    Source: Timoshenko and Goodier, Theory of Elasticity, bending of bars; exact for the tube's inner edge.
    """
    k = 4.0 / (math.pi * (1.0 + poisson))
    inner = k * (1.0 + 2.0 * poisson)
    return ShearLaw(k * (3.0 + 2.0 * poisson) + inner, -2.0 * inner, inner)


@dataclass(frozen=True)
class Demand:
    """F(w) at every station, over ``stress``: ``bending`` m and ``shear`` q of shape (n,), and what is the same
    all along, ``axial`` n and ``torsion`` t."""

    name: str
    bending: Array
    shear: Array
    axial: float
    torsion: float
    law: ShearLaw
    stress: float

    def value(self, wall: Array) -> Array:
        """F(w) at relative walls of shape (n,)."""
        out = np.empty(wall.shape)
        law = self.law
        demanded(self.bending, self.shear, self.axial, self.torsion, law.c0, law.c1, law.c2, wall, out)
        return out


def _demand(name: str, forces: InternalForces, diameter: float, stress: float, law: ShearLaw, factor: float) -> Demand:
    """v times the greatest stresses over ``stress``: normal 32 M/(pi D^3) + 4 |N| (1 + (1-w)^2)/(pi D^2), and
    ``factor`` times the shear stress of the shear force, Q s(w)/D^2, and of the torque, 16 |T|/(pi D^3)."""
    area, cube = diameter**2 * stress, math.pi * diameter**3 * stress
    return Demand(
        name,
        (32.0 / cube) * forces.moment_total,
        (factor / area) * forces.shear_total,
        4.0 * abs(forces.axial_force) / (math.pi * area),
        factor * 16.0 * abs(forces.torque) / cube,
        law,
        stress,
    )


@dataclass(frozen=True)
class Share:
    """What one demand of a criterion takes of the forces, and by which factor shear stress counts in it."""

    name: str
    forces: InternalForces
    factor: float


@dataclass(frozen=True)
class CombinedCriterion:
    """sqrt(sigma^2 + k^2 tau^2) <= allowable with both maxima taken together: k = 2 Tresca, k = sqrt 3 von Mises."""

    name: str
    factor: float

    def law(self, material: PinMaterial) -> ShearLaw:
        return zhuravsky()

    @property
    def factors(self) -> tuple[tuple[float, float], ...]:
        """By what each demand multiplies the bending stress and the shear stress."""
        return ((1.0, self.factor),)

    def shares(self, forces: InternalForces) -> tuple[Share, ...]:
        """All forces in one demand."""
        return (Share(self.name, forces, self.factor),)


@dataclass(frozen=True)
class FibreCriterion:
    """Tresca fibre by fibre: max(sigma_max, 2 tau_max) <= allowable, with Zhuravsky's or the elastic shear.

    Over the section sigma^2 + 4 tau^2 is greatest at the outer fibre (no shear) or at the neutral axis (no bending).
    An axial force or a torque is present at every fibre and is added to both.
    """

    name: str = "fibre"
    by_elasticity: bool = False

    def law(self, material: PinMaterial) -> ShearLaw:
        return saint_venant(material.poisson) if self.by_elasticity else zhuravsky()

    @property
    def factors(self) -> tuple[tuple[float, float], ...]:
        """By what each demand multiplies the bending stress and the shear stress."""
        return (1.0, 0.0), (0.0, 2.0)

    def shares(self, forces: InternalForces) -> tuple[Share, ...]:
        """Bending without shear at the outer fibre, shear without bending at the neutral axis."""
        flat = InternalForces(forces.moment, np.zeros_like(forces.shear), forces.axial_force, forces.torque)
        axis = InternalForces(np.zeros_like(forces.moment), forces.shear, forces.axial_force, forces.torque)
        return Share(f"{self.name}_bending", flat, 2.0), Share(f"{self.name}_shear", axis, 2.0)


Criterion = CombinedCriterion | FibreCriterion

CRITERIA: dict[str, Criterion] = {
    c.name: c
    for c in (
        CombinedCriterion("tresca_paper", 2.0),
        FibreCriterion(),
        FibreCriterion("saint_venant", by_elasticity=True),
        CombinedCriterion("von_mises", math.sqrt(3.0)),
    )
}
"""The criteria a user may select; the paper's is the default."""


def section_demands(
    criterion: Criterion, forces: InternalForces, diameter: float, material: PinMaterial
) -> tuple[Demand, ...]:
    """A criterion's demands on a section of this outer diameter."""
    stress, law = material.allowable_stress, criterion.law(material)
    return tuple(
        _demand(share.name, share.forces, diameter, stress, law, share.factor) for share in criterion.shares(forces)
    )


def shear_demand(forces: InternalForces, diameter: float, material: PinMaterial, law: ShearLaw) -> tuple[Demand, ...]:
    """The separate limit on the shear stress, where the material has one."""
    if material.allowable_shear is None:
        return ()
    only = InternalForces(np.zeros_like(forces.moment), forces.shear, 0.0, forces.torque)
    return (_demand(ALLOWABLE_SHEAR, only, diameter, material.allowable_shear, law, 1.0),)


def v_of(wall: Array) -> Array:
    """v = 1 - (1 - w)^4 without cancellation."""
    return wall * (2.0 - wall) * (2.0 - 2.0 * wall + wall * wall)


def wall_of(solidity: Array) -> Array:
    """w of u = 1 - (1 - w)^2, without cancellation: u/(1 + sqrt(1 - u))."""
    return solidity / (1.0 + np.sqrt(np.maximum(1.0 - solidity, 0.0)))


def solidity_of(wall: Array) -> Array:
    """u = w (2 - w): the share of the solid section that is left."""
    return wall * (2.0 - wall)


def least_wall(demands: Sequence[Demand], floor: float, stations: int) -> Array:
    """The least relative wall w of every station, (n,), that no demand and not the ``floor`` undercuts; NaN where even
    the solid section is too weak.

    Valid for any load; relative error a few rounding errors times the condition of the problem, which is unbounded
    only at F(1) -> 1 without shear (w -> 1 as the fourth root of the margin).
    """
    found = np.full(stations, floor)
    for demand in demands:
        law = demand.law
        least_walls(demand.bending, demand.shear, demand.axial, demand.torsion, law.c0, law.c1, law.c2, found)
    return found


def uses(demands: Sequence[Demand], wall: Array) -> Array:
    """Greatest F(w)/v(w) at relative walls (n,), of the criterion's demands and of the separate limit on the shear
    stress, (2, n): 1 where the strength is used up, inf without a wall, 0 where nothing acts."""
    out, v = np.zeros((2, wall.size)), v_of(wall)
    for demand in demands:
        f, row = demand.value(wall), int(demand.name == ALLOWABLE_SHEAR)
        with np.errstate(divide="ignore", invalid="ignore"):
            out[row] = np.maximum(out[row], np.where(f > 0.0, f / v, 0.0))
    return out
