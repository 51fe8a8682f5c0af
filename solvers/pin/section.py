"""The section of a pin: stresses, and the wall that carries given forces.

Everything is written in the relative wall w = 1 - d/D (0: no wall, 1: solid), so that a thin wall keeps its digits:
v = 1 - (1 - w)^4, u = 1 - (1 - w)^2 = w(2 - w), v = u(2 - u). With the moment, axial force, shear and torque made
dimensionless, each strength criterion is one or more demands

    v >= F(w) = sqrt(p(w)^2 + r(w)^2),    p, r quadratic in w, not negative, convex and falling on [0, 1].

v - F is concave and negative at w = 0, so Newton's method from the left converges monotonically from every load, and
a wall exists exactly if F(1) <= 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.loads import InternalForces
from solvers.pin.scene import PinMaterial

Array = NDArray[np.float64]
_EPS = float(np.finfo(float).eps)
_MOST_STEPS = 100


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
    """F(w) = sqrt(p(w)^2 + r(w)^2) at every station: coefficients of shape (3, n), normalised by ``stress``."""

    name: str
    p: Array
    r: Array
    stress: float

    def value(self, wall: Array) -> Array:
        """F(w) at relative walls of shape (n,)."""
        p = self.p[0] + wall * (self.p[1] + wall * self.p[2])
        r = self.r[0] + wall * (self.r[1] + wall * self.r[2])
        return np.hypot(p, r)


def _normal(forces: InternalForces, diameter: float, stress: float) -> Array:
    """v times the greatest normal stress over ``stress``: 32 M/(pi D^3) + 4 |N| (1 + (1-w)^2)/(pi D^2)."""
    m = 32.0 * forces.moment_total / (math.pi * diameter**3 * stress)
    n = 4.0 * abs(forces.axial_force) / (math.pi * diameter**2 * stress)
    return np.stack([m + 2.0 * n, np.full_like(m, -2.0 * n), np.full_like(m, n)])


def _tangential(forces: InternalForces, diameter: float, law: ShearLaw, stress: float, factor: float) -> Array:
    """v times ``factor`` times the greatest shear stress over ``stress``: from the shear force and the torque."""
    q = factor * forces.shear_total / (diameter**2 * stress)
    t = factor * 16.0 * abs(forces.torque) / (math.pi * diameter**3 * stress)
    return np.stack([law.c0 * q + t, law.c1 * q, law.c2 * q])


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
        Demand(
            share.name,
            _normal(share.forces, diameter, stress),
            _tangential(share.forces, diameter, law, stress, share.factor),
            stress,
        )
        for share in criterion.shares(forces)
    )


def shear_demand(forces: InternalForces, diameter: float, material: PinMaterial, law: ShearLaw) -> tuple[Demand, ...]:
    """The separate limit on the shear stress, where the material has one."""
    if material.allowable_shear is None:
        return ()
    r = _tangential(forces, diameter, law, material.allowable_shear, 1.0)
    return (Demand("allowable_shear", np.zeros_like(r), r, material.allowable_shear),)


def v_of(wall: Array) -> Array:
    """v = 1 - (1 - w)^4 without cancellation."""
    return wall * (2.0 - wall) * (2.0 - 2.0 * wall + wall * wall)


def wall_of(solidity: Array) -> Array:
    """w of u = 1 - (1 - w)^2, without cancellation: u/(1 + sqrt(1 - u))."""
    return solidity / (1.0 + np.sqrt(np.maximum(1.0 - solidity, 0.0)))


def solidity_of(wall: Array) -> Array:
    """u = w (2 - w): the share of the solid section that is left."""
    return wall * (2.0 - wall)


@kernel
def _least_wall(p: Array, r: Array, out: Array) -> None:
    for i in range(out.size):
        full = math.hypot(p[0, i] + p[1, i] + p[2, i], r[0, i] + r[1, i] + r[2, i])
        if full == 0.0 and p[0, i] == 0.0 and r[0, i] == 0.0:
            out[i] = 0.0
            continue
        if not full <= 1.0:
            out[i] = np.nan
            continue
        # F falls with w, so the wall for the constant F(1) lies left of the root; Newton stays left of it.
        b = math.sqrt(math.sqrt(1.0 - full))
        w = full / ((1.0 + b) * (1.0 + b * b))
        for _ in range(_MOST_STEPS):
            pv = p[0, i] + w * (p[1, i] + w * p[2, i])
            rv = r[0, i] + w * (r[1, i] + w * r[2, i])
            f = math.sqrt(pv * pv + rv * rv)
            if f < 1e-150:
                f = math.hypot(pv, rv)
            b = 1.0 - w
            gain = w * (2.0 - w) * (1.0 + b * b) - f
            slope = 4.0 * b * b * b
            if f > 0.0:
                slope -= (pv * (p[1, i] + 2.0 * w * p[2, i]) + rv * (r[1, i] + 2.0 * w * r[2, i])) / f
            if gain >= 0.0 or slope <= 0.0:
                break
            step = -gain / slope
            w = min(w + step, 1.0)
            # The curvature is below 20, so where the slope is not small the step after a small one is below rounding.
            if step <= 2.0 * _EPS * w or (step <= 1e-9 * w and slope > 0.1):
                break
        out[i] = w


def least_wall(demand: Demand) -> Array:
    """The least relative wall w of every station, shape (n,); NaN where even the solid section is too weak.

    Valid for any load; relative error a few rounding errors times the condition of the problem, which is unbounded
    only at F(1) -> 1 without shear (w -> 1 as the fourth root of the margin).
    """
    out = np.empty(demand.p.shape[1])
    _least_wall(np.ascontiguousarray(demand.p), np.ascontiguousarray(demand.r), out)
    return out


def equivalent_stress(demands: tuple[Demand, ...], wall: Array) -> Array:
    """Greatest equivalent stress of the demands [Pa] at relative walls (n,): stress F/v; 0 where nothing acts."""
    v = v_of(wall)
    out = np.zeros_like(wall)
    for demand in demands:
        f = demand.value(wall)
        with np.errstate(divide="ignore", invalid="ignore"):
            out = np.maximum(out, np.where(f > 0.0, demand.stress * f / v, 0.0))
    return out
