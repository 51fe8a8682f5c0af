"""Materials: a frozen record and a small catalogue of strip and spring steels."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from solvers.errors import InvalidInput, require_positive

LOSS_FACTOR = 0.01
"""Default loss factor eta of a steel strip held by friction in its clamps (damping ratio 0.5 %).

Hardened steel itself has 1e-4 to 2e-3, a part clamped or bolted at its ends a few 1e-3 to a few 1e-2 (L. Cremer, M.
Heckl, B. A. T. Petersson, Structure-Borne Sound (2005); VDI 3830). If resonances govern a design, eta is worth
measuring.
"""


@dataclass(frozen=True)
class Material:
    """Elastic and fatigue properties of a material, SI units.

    elastic_modulus          E [Pa]
    fatigue_limit            sigma_-1 [Pa] of a smooth specimen under fully reversed bending
    fatigue_reduction        K >= 1: notch, size and surface combined
    mean_stress_sensitivity  psi of Serensen (algebraically FKM's M), in [0, 1)
    yield_strength           [Pa]
    density                  [kg/m^3]
    poisson                  in (-1, 0.5)
    ultimate_strength        [Pa], required by Goodman and Gerber only
    loss_factor              eta = 2 zeta in [0, 0.5] of a part in its clamps: fraction of the vibration energy
                             dissipated
                             per radian; 0: undamped. Used by the strip's inertia only
    """

    elastic_modulus: float
    fatigue_limit: float
    fatigue_reduction: float
    mean_stress_sensitivity: float
    yield_strength: float
    density: float
    poisson: float = 0.3
    ultimate_strength: float | None = None
    loss_factor: float = LOSS_FACTOR

    def __post_init__(self) -> None:
        require_positive(self, "material", "elastic_modulus", "fatigue_limit", "yield_strength", "density")
        if not (math.isfinite(self.fatigue_reduction) and self.fatigue_reduction >= 1):
            raise InvalidInput("material.fatigue_reduction", "must be at least 1", "[1, inf)")
        if not 0 <= self.mean_stress_sensitivity < 1:
            raise InvalidInput("material.mean_stress_sensitivity", "must lie below 1", "[0, 1)")
        if not -1 < self.poisson < 0.5:
            raise InvalidInput("material.poisson", "must lie between -1 and 0.5", "(-1, 0.5)")
        if not 0 <= self.loss_factor <= 0.5:
            raise InvalidInput("material.loss_factor", "must lie between 0 and 0.5", "[0, 0.5]")
        ultimate = self.ultimate_strength
        if ultimate is not None and not (math.isfinite(ultimate) and ultimate >= self.yield_strength):
            raise InvalidInput(
                "material.ultimate_strength",
                "must be finite and not below the yield strength",
                "a strength not below the yield strength",
            )

    @property
    def shear_modulus(self) -> float:
        """G = E / (2 (1 + nu)) [Pa]."""
        return self.elastic_modulus / (2.0 * (1.0 + self.poisson))


@dataclass(frozen=True, kw_only=True)
class Catalogued:
    """Catalogue data of a material: title, and the source of each value."""

    title: str = field(compare=False)
    sources: Mapping[str, str] = field(compare=False)


@dataclass(frozen=True)
class Listed(Material, Catalogued):
    """A strip material of the catalogue."""


def sources_of(**told: str) -> Mapping[str, str]:
    """Sources by quantity, read-only."""
    return MappingProxyType(told)


_SHEETS = "rounded from suppliers' data sheets; 15 % of scatter between heats and finishes is common"
_CLAMPED = "assumed: of steel parts held by friction in clamps, which lose more than the material"
_ASSUMED = "assumed: the paper prints no material data"

CATALOGUE: dict[str, Listed] = {
    "paper-strip": Listed(
        210e9, 480e6, 1.15, 0.12, 1200e6, 7850.0,
        title="The strip of Obolenskaya and Klochko's machine",
        sources=sources_of(
            elastic_modulus=_ASSUMED, fatigue_limit=_ASSUMED, fatigue_reduction=_ASSUMED,
            mean_stress_sensitivity=_ASSUMED, yield_strength=_ASSUMED, density=_ASSUMED, poisson=_ASSUMED,
            loss_factor=_CLAMPED,
        ),
    ),
    "spring-steel-1.1274": Listed(
        206e9, 620e6, 1.25, 0.20, 1450e6, 7850.0, 0.3, 1800e6,
        title="Carbon spring steel strip C100S, 1.1274, hardened, tempered and polished",
        sources=sources_of(
            elastic_modulus="what design standards for springs take for hardened carbon steel at room temperature",
            fatigue_limit=_SHEETS,
            fatigue_reduction="assumed for polished surfaces and rounded edges, with little more than bending",
            mean_stress_sensitivity="typical of steels of this strength (FKM guideline: M rises with it)",
            yield_strength=_SHEETS,
            density="typical of carbon steel",
            poisson="typical of steel",
            ultimate_strength=_SHEETS,
            loss_factor=_CLAMPED,
        ),
    ),
    "stainless-1.4310": Listed(
        185e9, 550e6, 1.25, 0.25, 1300e6, 7900.0, 0.3, 1600e6,
        title="Stainless spring strip X10CrNi18-8, 1.4310, cold rolled to EN 10151 +C1500",
        sources=sources_of(
            elastic_modulus="cold rolled strip as suppliers tell it after EN 10151: 179 GPa at 1300, 185 at 1800 MPa",
            fatigue_limit=_SHEETS,
            fatigue_reduction="assumed for polished surfaces and rounded edges, with little more than bending",
            mean_stress_sensitivity="typical of austenitic strip of this strength",
            yield_strength=_SHEETS,
            density="typical of austenitic steel",
            poisson="typical of steel",
            ultimate_strength="EN 10151 +C1500: 1500 to 1700 MPa",
            loss_factor=_CLAMPED,
        ),
    ),
}  # fmt: skip
"""Typical values for orientation, not for release of a part.

``paper-strip`` completes the machine of Obolenskaya and Klochko, who print no material data. The other two are rounded
from suppliers' data sheets for hardened, polished valve strip (EN 1.1274) and cold-rolled spring strip (EN 1.4310); the
scatter between heats and finishes easily reaches 15 %.
"""
