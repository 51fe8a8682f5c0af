"""Pressures tabulated over the crank angle for one cycle of two or four strokes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from solvers.crank.gas.data_faults import TABLE_FAULTS, Points, Repair, repaired, require_finite, require_sound_table
from solvers.crank.gas.unrolled_pressure import MOST_POINTS, Cylinder, Unrolled
from solvers.crank.motion.slider_crank import ExactMotion
from solvers.errors import require
from solvers.numerics.arrays import Array
from solvers.numerics.monotone_cubic import monotone_cubics


@dataclass(frozen=True)
class TablePressure:
    """Pressures [Pa] at crank angles [rad] of one cycle, interpolated by a periodic monotone cubic (PCHIP).

    Angles are strictly increasing and span less than one cycle of the cylinder. The curve does not overshoot and is
    once continuously differentiable.
    """

    angle: tuple[float, ...]
    pressure: tuple[float, ...]

    def __post_init__(self) -> None:
        count = len(self.angle)
        enough, same = 3 <= count <= MOST_POINTS, len(self.pressure) == count
        require(enough, "pressure.angle", "has too few or too many points", f"3 … {MOST_POINTS} points")
        require(same, "pressure.pressure", "needs one pressure per angle", f"{count} pressures")
        require_finite("pressure", angle=self.angle, pressure=self.pressure)

    def open_cycle(self, period: float) -> tuple[Array, Array]:
        """Angles and pressures, without a last point that repeats the first one a cycle later."""
        last = len(self.angle) - (self.angle[-1] - self.angle[0] >= period * (1.0 - 1e-9))
        return np.array(self.angle[:last]), np.array(self.pressure[:last])

    def unroll(self, motion: ExactMotion, cylinder: Cylinder) -> Unrolled:
        """Return the table over the crank angle. Raises InvalidInput, naming the point, for faulty data."""
        period = cylinder.period
        require_sound_table(Points(np.array(self.angle), np.array(self.pressure), 0.0, period))
        angle, values = self.open_cycle(period)
        angle -= math.floor(angle[0] / period) * period
        # One point of overlap on the left and two on the right make the slopes, and hence the curve, periodic.
        x = np.concatenate([angle[-1:] - period, angle, angle[:2] + period])
        cubic = monotone_cubics(x, np.concatenate([values[-1:], values, values[:2]]))[1:-1]
        one_stroke = np.zeros(angle.size, np.intp)
        clearance = cylinder.clearance_volume
        return Unrolled(x[1:-1], angle, cubic, one_stroke, False, motion.geometry, cylinder.area, clearance)


def repaired_table(table: TablePressure, cylinder: Cylinder) -> tuple[TablePressure, tuple[Repair, ...]]:
    """Return the repaired table and the repairs. Raises InvalidInput for irreparable data."""
    given = Points(np.asarray(table.angle), np.asarray(table.pressure), 0.0, cylinder.period)
    points, repairs = repaired(given, TABLE_FAULTS, "pressure.angle", 3)
    return TablePressure(tuple(points.x.tolist()), tuple(points.pressure.tolist())), tuple(repairs)
