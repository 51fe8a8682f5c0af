"""Pressures given over the crank angle: a table of one cycle of two or four strokes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solvers.crank.gas.data_faults import TABLE_FAULTS, Points, require_sound
from solvers.crank.motion.slider_crank import ExactMotion, Motion
from solvers.crank.scene import Cylinder
from solvers.errors import InvalidInput

if TYPE_CHECKING:
    from scipy.interpolate import PchipInterpolator

Array = NDArray[np.float64]

MOST_POINTS = 20_000


@dataclass(frozen=True)
class TablePressure:
    """Pressures [Pa] at crank angles [rad] of one cycle, joined by a monotone cubic (PCHIP) that closes on itself.

    Angles rise strictly and span less than one cycle of the cylinder. The curve overshoots no point and is once
    continuously differentiable.
    """

    angle: tuple[float, ...]
    pressure: tuple[float, ...]

    def __post_init__(self) -> None:
        count = len(self.angle)
        if not 3 <= count <= MOST_POINTS:
            raise InvalidInput("pressure.angle", "has too few or too many points", f"3 … {MOST_POINTS} points")
        if len(self.pressure) != count:
            raise InvalidInput("pressure.pressure", "needs one pressure per angle", f"{count} pressures")
        for name, values in (("angle", self.angle), ("pressure", self.pressure)):
            bad = np.flatnonzero(~np.isfinite(values))
            if bad.size:
                raise InvalidInput(f"pressure.{name}.{bad[0]}", "must be finite", "finite numbers")

    def unroll(self, motion: ExactMotion, cylinder: Cylinder, mapping: Motion | None = None) -> TableCurve:
        """The table itself. Raises InvalidInput, with the point named, where it is not one rising, open cycle."""
        points = Points(np.asarray(self.angle), np.asarray(self.pressure), 0.0, cylinder.period)
        require_sound(points, TABLE_FAULTS, "pressure.angle")
        # A last point one cycle after the first says the same thing twice.
        closed = self.angle[-1] - self.angle[0] >= cylinder.period * (1.0 - 1e-9)
        last = len(self.angle) - closed
        return TableCurve(self.angle[:last], self.pressure[:last], cylinder.period, motion.dead_centres)


@dataclass(frozen=True)
class TableCurve:
    """A table of one period, closed."""

    angle: tuple[float, ...]
    values: tuple[float, ...]
    period: float
    dead_centres: tuple[float, float]

    @cached_property
    def _curve(self) -> PchipInterpolator:
        from scipy.interpolate import PchipInterpolator

        # A whole period of overlap on either side makes the slopes, and so the curve, periodic.
        angle, values = np.asarray(self.angle), np.asarray(self.values)
        turns = np.repeat([-self.period, 0.0, self.period], angle.size)
        return PchipInterpolator(np.tile(angle, 3) + turns, np.tile(values, 3))

    def pressure(self, angle: ArrayLike) -> Array:
        start = self.angle[0]
        return self._curve(start + np.mod(np.asarray(angle, dtype=float) - start, self.period))

    @property
    def _half_turns(self) -> list[float]:
        turns = round(self.period / (2.0 * math.pi))
        return [centre + 2.0 * math.pi * turn for turn in range(turns) for centre in self.dead_centres]

    @cached_property
    def breaks(self) -> Array:
        start = self.dead_centres[0]
        inside = start + np.mod(np.asarray(self.angle) - start, self.period)
        return np.unique(np.concatenate([inside, self._half_turns, [start + self.period]]))

    @property
    def jumps(self) -> tuple[tuple[float, float], ...]:
        """None: the closed cubic is continuous everywhere."""
        return tuple((angle, 0.0) for angle in self._half_turns)
