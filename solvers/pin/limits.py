"""Design limits of a pin or a bushing besides strength."""

from __future__ import annotations

import math
from dataclasses import dataclass

from solvers.errors import require, require_positive


@dataclass(frozen=True)
class Limits:
    """Design limits besides strength; None: no limit.

    min_wall         minimum wall thickness [m]
    max_deflection   maximum deflection of the middle relative to the bosses' inner edges [m]
    max_ovalization  maximum growth of a diameter [m]
    max_slope        maximum slope of the bore's diameter, |dd/dx|
    max_ring_stress  maximum hoop stress of the section as a ring [Pa]
    """

    min_wall: float = 0.0
    max_deflection: float | None = None
    max_ovalization: float | None = None
    max_slope: float | None = None
    max_ring_stress: float | None = None

    def __post_init__(self) -> None:
        require(
            math.isfinite(self.min_wall) and self.min_wall >= 0, "limits.min_wall", "must not be negative", "[0, D/2]"
        )
        for name in ("max_deflection", "max_ovalization", "max_slope", "max_ring_stress"):
            if getattr(self, name) is not None:
                require_positive(self, "limits", name)


NO_LIMITS = Limits()
