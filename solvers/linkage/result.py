"""What a check says of a linkage, SI units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.linkage.loads.torque_and_pin_force import Peaks
from solvers.linkage.mechanism.closure import Window
from solvers.linkage.mechanism.lengths import Mechanism
from solvers.linkage.steady_state.periodic_solution import Running
from solvers.linkage.swept_area.bounding_box import Box

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Strike:
    """What a mechanism that closes does at the blow.

    |u31| after and before it, R_k, the speed of the tool [m/s], nu in mid-cycle [rad], peak loads, and u31 over the
    cycle: crank angles [rad] and values; where the crank does not turn fully only those it reaches, in two runs.
    ``greatest`` is the greatest |u31| of the cycle.
    """

    start: float
    end: float
    restitution: float
    mismatch: float
    impact_speed: float
    transmission_angle: float
    peaks: Peaks | None
    angles: Array
    transfer: Array
    greatest: float


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
