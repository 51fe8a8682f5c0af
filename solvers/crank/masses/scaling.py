"""Estimation of a new engine's masses from an existing one's, by piston area."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from numpy.typing import NDArray

from solvers.crank.masses.reduced_rod import RodMasses, evaluate, require_known
from solvers.errors import require_positive

USUAL = {
    "spark ignition": ((80.0, 150.0), (100.0, 200.0)),
    "diesel": ((150.0, 300.0), (250.0, 400.0)),
}
"""Usual constructive masses [kg per m2 of piston area] of aluminium piston groups and of steel rods.

Textbook figures, quoted from memory and rounded; suitable only to detect misplaced decimals.
"""


@dataclass(frozen=True)
class Estimate:
    """Constructive masses m' [kg per m2 of piston area] of an existing engine, and the new bore [m]."""

    bore: float
    piston_area_density: float
    rod_area_density: float
    uncertainty: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_positive(self, "", "bore", "piston_area_density", "rod_area_density")
        require_known(self, self.uncertainty)


def estimate(request: Estimate) -> RodMasses:
    """Estimate m = m' pi D^2/4 for piston group and rod."""

    def scaled(x: dict[str, NDArray]) -> dict[str, NDArray]:
        area = math.pi * x["bore"] ** 2 / 4.0
        return {"piston_mass": x["piston_area_density"] * area, "rod_mass": x["rod_area_density"] * area}

    warnings = []
    for part, index, value in (("piston group", 0, request.piston_area_density), ("rod", 1, request.rod_area_density)):
        low = min(ranges[index][0] for ranges in USUAL.values())
        high = max(ranges[index][1] for ranges in USUAL.values())
        if not low <= value <= high:
            warnings.append(f"the {part} lies outside {low:g} … {high:g} kg/m2, the usual figures of textbooks")
    return evaluate(scaled, request, warnings)
