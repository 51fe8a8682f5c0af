"""A cylinder and its cycle. SI units."""

from __future__ import annotations

import math
from dataclasses import dataclass

from solvers.errors import require, require_not_negative, require_positive


@dataclass(frozen=True)
class Cylinder:
    """Bore D, clearance volume V_c, crankcase pressure p_0, and the strokes per cycle: two or four."""

    bore: float
    clearance_volume: float
    crankcase_pressure: float
    strokes: int

    def __post_init__(self) -> None:
        require_positive(self, "cylinder", "bore")
        require_not_negative(self, "cylinder", "clearance_volume")
        require(math.isfinite(self.crankcase_pressure), "cylinder.crankcase_pressure", "must be finite", "(-inf, inf)")
        require(self.strokes in (2, 4), "cylinder.strokes", "is neither two nor four", "2 or 4")

    @property
    def area(self) -> float:
        return math.pi * self.bore**2 / 4.0

    @property
    def period(self) -> float:
        """Crank angle of one cycle [rad]: 2 pi or 4 pi."""
        return math.pi * self.strokes
