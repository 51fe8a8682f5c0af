"""Errors of the textbook approximations: Brix's construction and two harmonics."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from solvers.crank.cycle.forces import Cycle, Machine
from solvers.crank.cycle.worst_instants import TEXTBOOK, greatest
from solvers.crank.gas.unrolled_pressure import Unrolled
from solvers.crank.motion.slider_crank import ExactMotion

_PIECES = 8
"""Pieces per half turn."""
_ALONE = np.zeros(1)
"""The phase of a single cylinder [rad]."""


@dataclass(frozen=True)
class TierErrors:
    """Errors of the textbook approximations for this mechanism (without offset).

    ``brix_displacement``  maximum |x_Brix - x|/r
    ``two_harmonic_acceleration``  maximum |a_2 - a|/(r omega^2 (1 + lambda))
    ``brix_pressure``  maximum |p_Brix(phi) - p(phi)| [Pa]; None for table pressures
    """

    brix_displacement: float
    two_harmonic_acceleration: float
    brix_pressure: float | None


def tier_errors(cycle: Cycle, tolerance: float) -> TierErrors:
    """Return the errors, each to the relative ``tolerance``."""
    displacement, acceleration = _of_motion(cycle.motion.crank_radius / cycle.motion.rod_length)
    pressure = None
    if cycle.curve.has_brix:
        of_cycle = cycle.machine, cycle.curve.unrolled, cycle.sharp_angles, _ALONE
        pressure = float(greatest(*of_cycle, TEXTBOOK + 2, 1, tolerance).value[0])
    return TierErrors(displacement, acceleration, pressure)


@lru_cache(maxsize=256)
def _of_motion(ratio: float) -> tuple[float, float]:
    """Return the errors of Brix's displacement, relative to r, and of the two-harmonic acceleration, to its maximum."""
    frame, bounds = ExactMotion(ratio, 1.0).frame, np.linspace(0.0, np.pi, _PIECES + 1)
    nothing = np.zeros(_PIECES)
    gas = Unrolled(bounds, nothing, np.zeros((_PIECES, 4)), np.zeros(_PIECES, np.intp), False, frame, 0.0, 0.0)
    machine = Machine(frame, *np.zeros(8).tolist())
    found = greatest(machine, gas, np.empty(0), _ALONE, TEXTBOOK, 2, 1e-8).value
    return float(found[0]), float(found[1])
