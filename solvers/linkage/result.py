"""What a linkage is and what a check says of it, SI units."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.errors import require
from solvers.linkage.envelope import Box
from solvers.linkage.four_bar import FourBar
from solvers.linkage.impact import Running
from solvers.linkage.loads import Peaks
from solvers.linkage.tolerances import Closure, Window

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Lengths:
    """Links [m]: base l0, crank l1, coupler l2, rocker l3."""

    base: float
    crank: float
    coupler: float
    rocker: float

    def __post_init__(self) -> None:
        for name in ("base", "crank", "coupler", "rocker"):
            value = getattr(self, name)
            require(math.isfinite(value) and value > 0, f"lengths.{name}", "must be positive", "(0, inf)")
        longest = max(self.base, self.crank, self.coupler, self.rocker)
        others = self.base + self.crank + self.coupler + self.rocker - longest
        name = next(n for n in ("base", "crank", "coupler", "rocker") if getattr(self, n) == longest)
        require(longest < others, f"lengths.{name}", "the other links cannot reach around it", "less than their sum")


@dataclass(frozen=True)
class Mechanism:
    """A linkage to evaluate: its kind and ratios, the crank's length [m], and how far its closure is missed."""

    bar: FourBar
    crank: float
    closure: Closure

    @property
    def lengths(self) -> Lengths:
        r = self.bar.ratios
        return Lengths(self.crank * r.base, self.crank, self.crank * r.coupler, self.crank * r.rocker)


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
    the crank angle [rad] that a crank cannot exceed to either side of the blow where it does not turn fully.
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
