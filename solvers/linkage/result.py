"""What a check says of a linkage, SI units."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.linkage.loads.torque_and_pin_force import Peaks
from solvers.linkage.mechanism.closure import Window
from solvers.linkage.mechanism.lengths import Mechanism
from solvers.linkage.steady_state.periodic_solution import Running
from solvers.linkage.swept_area.bounding_box import Box

Array = NDArray[np.float64]
TRANSFER_POINTS = 181


@dataclass(frozen=True)
class Strike:
    """What a mechanism that closes does at the blow.

    |u31| after and before it, R_k, the speed of the tool [m/s], nu in mid-cycle [rad], peak loads. ``greatest`` is the
    greatest |u31| of the cycle; ``confined`` as in ``LinkageCheck``.
    """

    mechanism: Mechanism
    confined: float | None
    start: float
    end: float
    restitution: float
    mismatch: float
    impact_speed: float
    transmission_angle: float
    peaks: Peaks | None
    greatest: float

    @cached_property
    def angles(self) -> Array:
        """Crank angles [rad] over the cycle; where the crank does not turn fully only those it reaches, in two runs."""
        if self.confined is None:
            return np.linspace(0.0, 2.0 * math.pi, TRANSFER_POINTS)
        # The last step before the wall is left out: u31 has no bound there.
        run = np.linspace(0.0, self.confined, TRANSFER_POINTS // 2 + 1)[:-1]
        return np.concatenate([run, 2.0 * math.pi - run[::-1]])

    @cached_property
    def transfer(self) -> Array:
        """u31 at these angles."""
        # Angles beyond pi are counted back from the end of the cycle, which they reach exactly.
        angles = self.angles
        return self.mechanism.bar.transfer(
            np.where(angles > math.pi, np.minimum(angles - 2.0 * math.pi, -1e-300), angles)
        )


@dataclass(frozen=True)
class LinkageCheck:
    """The results of a check, SI units; None where a result does not exist.

    ``strike`` is None for lengths that miss their closure and for a kind of motion that cannot strike; ``confined`` is
    the crank angle [rad] that a crank cannot exceed to either side of the blow where it does not turn fully. What
    follows ``window``, with the box and the circle, is there only where the effect that brings it runs.
    """

    mechanism: Mechanism
    rotatable: bool
    confined: float | None
    strike: Strike | None
    box: Box | None
    enclosing_radius: float | None
    window: Window | None
    restitution_error: float | None
    tolerance_window: Window | None
    coupler_peak: float | None
    running: Running | None
    warnings: tuple[str, ...]
