"""Strength criteria and shear stress laws of a section."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from solvers.pin.scene import PinMaterial


class ShearLaw(NamedTuple):
    """Maximum shear stress of a tube: tau = Q s(w)/(D^2 v), s = c0 + c1 w + c2 w^2."""

    c0: float
    c1: float
    c2: float


_K = 16.0 / (3.0 * math.pi)
ZHURAVSKY = ShearLaw(3.0 * _K, -3.0 * _K, _K)
"""tau = 16 Q (D^2 + D d + d^2)/(3 pi (D^4 - d^4)): the mean over the neutral axis (Zhuravsky, Jourawski)."""


def saint_venant(poisson: float) -> ShearLaw:
    """tau = 4 Q ((3+2nu) D^2 + (1+2nu) d^2)/(pi (1+nu)(D^4 - d^4)): the maximum of linear elasticity.

    Source: Timoshenko and Goodier, Theory of Elasticity, bending of bars; exact for the tube's inner edge.
    """
    k = 4.0 / (math.pi * (1.0 + poisson))
    inner = k * (1.0 + 2.0 * poisson)
    return ShearLaw(k * (3.0 + 2.0 * poisson) + inner, -2.0 * inner, inner)


class Factors(NamedTuple):
    """One constraint of a criterion: factors of the normal stresses of bending and axial force, and of the shear
    stresses of shear force and torque."""

    bending: float
    axial: float
    shear: float
    torsion: float


ONLY_SHEAR = Factors(0.0, 0.0, 1.0, 1.0)
"""The constraint of a separate shear allowable."""


@dataclass(frozen=True)
class CombinedCriterion:
    """sqrt(sigma^2 + k^2 tau^2) <= allowable, combining the maxima of sigma and tau wherever they occur: k = 2 Tresca,
    k = sqrt 3 von Mises."""

    name: str
    factor: float

    def law(self, material: PinMaterial) -> ShearLaw:
        return ZHURAVSKY

    @property
    def factors(self) -> tuple[Factors, ...]:
        """A single constraint with all forces."""
        return (Factors(1.0, 1.0, self.factor, self.factor),)


@dataclass(frozen=True)
class FibreCriterion:
    """Tresca per fibre: max(sigma_max, 2 tau_max) <= allowable, with Zhuravsky's or the elastic shear.

    Over the section sigma^2 + 4 tau^2 is greatest at the outer fibre (no shear) or at the neutral axis (no bending).
    An axial force or a torque acts on every fibre and is added to both.
    """

    name: str = "fibre"
    by_elasticity: bool = False

    def law(self, material: PinMaterial) -> ShearLaw:
        return saint_venant(material.poisson) if self.by_elasticity else ZHURAVSKY

    @property
    def factors(self) -> tuple[Factors, ...]:
        """Two constraints: bending without shear at the outer fibre, shear without bending at the neutral axis."""
        return Factors(1.0, 1.0, 0.0, 2.0), Factors(0.0, 1.0, 2.0, 2.0)


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
"""Selectable criteria; the paper's is the default."""
