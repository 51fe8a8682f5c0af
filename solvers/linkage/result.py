"""Results of a linkage check, SI units."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.linkage.loads.torque_and_pin_force import Peaks
from solvers.linkage.mechanism.closure import Window, window
from solvers.linkage.mechanism.lengths import Mechanism
from solvers.linkage.steady_state.periodic_solution import ROUNDING, SteadyState
from solvers.linkage.swept_area.bounding_box import Box
from solvers.numerics.arrays import Array

TRANSFER_POINTS = 181


@dataclass(frozen=True)
class Strike:
    """The impact of a mechanism whose links close: maximum |R - R_k|, the tool's speed [m/s], and the cycle's peaks,
    None if the crank does not rotate fully."""

    mismatch: float
    impact_speed: float
    peaks: Peaks | None


@dataclass(frozen=True)
class EffectResults:
    """Results of the active effects, SI units, None for inactive ones; their maximum relative error, at least that of
    closed forms; messages for the user."""

    box: Box | None = None
    enclosing_radius: float | None = None
    running: SteadyState | None = None
    coupler_peak: float | None = None
    restitution_error: float | None = None
    tolerance_window: Window | None = None
    error: float = ROUNDING
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class LinkageCheck(EffectResults):
    """The results of a check, SI units; None if a result does not exist.

    ``strike`` is None for lengths that do not close and for motions that cannot strike.
    """

    mechanism: Mechanism
    strike: Strike | None

    @cached_property
    def window(self) -> Window | None:
        """Effect of the closure error; None if the links close."""
        closure = self.mechanism.closure
        return None if closure.closes else window(self.mechanism.bar, closure.surplus)

    @cached_property
    def angles(self) -> Array:
        """Crank angles [rad] over the cycle; if the crank does not rotate fully only the reachable ones, in two
        runs."""
        confined = self.mechanism.confined
        if confined is None:
            return np.linspace(0.0, 2.0 * math.pi, TRANSFER_POINTS)
        # The end of the reachable range is omitted: u31 is unbounded there.
        run = np.linspace(0.0, confined, TRANSFER_POINTS // 2 + 1)[:-1]
        return np.concatenate([run, 2.0 * math.pi - run[::-1]])

    @cached_property
    def transfer(self) -> Array:
        """u31 at these angles, where the links close."""
        # Angles beyond pi are measured back from the end of the cycle, which they reach exactly.
        angles = self.angles
        return self.mechanism.bar.transfer(
            np.where(angles > math.pi, np.minimum(angles - 2.0 * math.pi, -1e-300), angles)
        )
