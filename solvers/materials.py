"""Materials: a frozen record and a small catalogue of strip and spring steels."""

from __future__ import annotations

import math
from dataclasses import dataclass

from solvers.errors import InvalidInput


@dataclass(frozen=True)
class Material:
    """Elastic and fatigue properties of one material, SI units.

    elastic_modulus          E [Pa]
    fatigue_limit            sigma_-1 [Pa], of a smooth specimen in alternating bending
    fatigue_reduction        K >= 1, notch, size and surface together
    mean_stress_sensitivity  psi of Serensen, algebraically FKM's M, in [0, 1)
    yield_strength           [Pa]
    density                  [kg/m^3]
    poisson                  in (-1, 0.5)
    ultimate_strength        [Pa], needed by Goodman and Gerber only
    """

    elastic_modulus: float
    fatigue_limit: float
    fatigue_reduction: float
    mean_stress_sensitivity: float
    yield_strength: float
    density: float
    poisson: float = 0.3
    ultimate_strength: float | None = None

    def __post_init__(self) -> None:
        for name in ("elastic_modulus", "fatigue_limit", "yield_strength", "density"):
            if not (math.isfinite(value := getattr(self, name)) and value > 0):
                raise InvalidInput(f"material.{name}", "must be positive", "(0, inf)")
        if not (math.isfinite(self.fatigue_reduction) and self.fatigue_reduction >= 1):
            raise InvalidInput("material.fatigue_reduction", "must be at least 1", "[1, inf)")
        if not 0 <= self.mean_stress_sensitivity < 1:
            raise InvalidInput("material.mean_stress_sensitivity", "must lie below 1", "[0, 1)")
        if not -1 < self.poisson < 0.5:
            raise InvalidInput("material.poisson", "must lie between -1 and 0.5", "(-1, 0.5)")
        ultimate = self.ultimate_strength
        if ultimate is not None and not (math.isfinite(ultimate) and ultimate >= self.yield_strength):
            raise InvalidInput(
                "material.ultimate_strength", "must be finite and not below the yield strength", "[yield_strength, inf)"
            )

    @property
    def shear_modulus(self) -> float:
        """G = E / (2 (1 + nu)) [Pa]."""
        return self.elastic_modulus / (2.0 * (1.0 + self.poisson))


CATALOGUE: dict[str, Material] = {
    "paper-strip": Material(210e9, 480e6, 1.15, 0.12, 1200e6, 7850.0),
    "spring-steel-1.1274": Material(206e9, 620e6, 1.25, 0.20, 1450e6, 7850.0, 0.3, 1800e6),
    "stainless-1.4310": Material(185e9, 550e6, 1.25, 0.25, 1300e6, 7900.0, 0.3, 1600e6),
}
"""Typical values for orientation, not for release of a part.

``paper-strip`` completes the machine of Obolenskaya and Klochko, who print no material data. The other two are
rounded from what suppliers' data sheets give for hardened, polished valve strip (EN 1.1274) and for cold-rolled
spring strip (EN 1.4310); the scatter between heats and finishes is easily 15 %.
"""
