"""Errors of the textbook approximations: Brix's construction and two harmonics.

The errors of displacement and acceleration are greatest with the crank perpendicular to the cylinder axis: with
lambda = r/L and c = sqrt(1 - lambda^2)

    |x_Brix - x|/r = lambda^3/(2 (1 + c)^2),  |a_2 - a|/(r omega^2 (1 + lambda)) = lambda^3/(c (1 + c)(1 + lambda)).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from solvers.crank.cycle.forces import Cycle
from solvers.crank.cycle.worst_instants import BRIX, greatest

_SINGLE_CYLINDER = np.zeros(1)
"""Phases of a single cylinder acting alone [rad]."""


@dataclass(frozen=True)
class TierErrors:
    """Errors of the textbook approximations for this mechanism (without offset).

    ``brix_displacement``  maximum |x_Brix - x|/r
    ``two_harmonic_acceleration``  maximum |a_2 - a|/(r omega^2 (1 + lambda))
    ``brix_pressure``  maximum |p_Brix(phi) - p(phi)| [Pa]; None for table pressures, or with an offset
    """

    brix_displacement: float
    two_harmonic_acceleration: float
    brix_pressure: float | None


def tier_errors(cycle: Cycle, tolerance: float) -> TierErrors:
    """Return the errors; that of the pressure to the relative ``tolerance``."""
    ratio = cycle.motion.crank_radius / cycle.motion.rod_length
    rod_cosine = math.sqrt((1.0 - ratio) * (1.0 + ratio))
    pressure = None
    if cycle.curve.has_brix:
        maximum = greatest(cycle.machine, cycle.curve, cycle.sharp_angles, _SINGLE_CYLINDER, BRIX, 1, tolerance)
        pressure = float(maximum.value[0])
    return TierErrors(
        ratio**3 / (2.0 * (1.0 + rod_cosine) ** 2),
        ratio**3 / (rod_cosine * (1.0 + rod_cosine) * (1.0 + ratio)),
        pressure,
    )
