"""Pressures tabulated over the crank angle for one cycle of two or four strokes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from solvers.crank.gas.cylinder import Cylinder
from solvers.crank.gas.data_faults import Points, require_finite, require_sound_table
from solvers.crank.gas.unrolled_pressure import MOST_POINTS, Unrolled
from solvers.crank.motion.slider_crank import ExactMotion
from solvers.errors import InvalidInput
from solvers.numerics.arrays import Array, Index
from solvers.numerics.jit import kernel
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
        if not 3 <= count <= MOST_POINTS:
            raise InvalidInput("pressure.angle", "has too few or too many points", f"3 … {MOST_POINTS} points")
        if len(self.pressure) != count:
            raise InvalidInput("pressure.pressure", "needs one pressure per angle", f"{count} pressures")
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
        centres = motion.dead_centres
        ends = np.array([centre + 2.0 * math.pi * n for n in range(cylinder.strokes // 2) for centre in centres])
        breaks, origin, cubic, stroke = _unrolled(angle, values, np.append(ends, ends[0] + period))
        return Unrolled(breaks, origin, cubic, stroke, False, motion.geometry, cylinder.area, cylinder.clearance_volume)


@kernel
def _unrolled(angle: Array, values: Array, ends: Array) -> tuple[Array, Array, Array, Index]:
    """Return breaks, origins, cubics and strokes of a table between the dead centres ``ends``."""
    n, start, period = angle.size, ends[0], ends[-1] - ends[0]
    # One point of overlap on the left and two on the right make the slopes, and hence the curve, periodic.
    x, y = np.empty(n + 3), np.empty(n + 3)
    for i in range(n + 3):
        x[i], y[i] = angle[(i - 1) % n] + (i - 1) // n * period, values[(i - 1) % n]
    cubics = monotone_cubics(x, y)
    shift = math.floor((start - angle[0]) / period) * period
    breaks, origin = np.empty(n + ends.size + 1), np.empty(n + ends.size)
    cubic, stroke = np.empty((n + ends.size, 4)), np.empty(n + ends.size, np.intp)
    breaks[0], count, along = start, 0, 0
    for j in range(2 * n):
        i, low = j % n, angle[j % n] + (shift + j // n * period)
        high = angle[(j + 1) % n] + (shift + (j + 1) // n * period)
        while breaks[count] < high and along < ends.size - 1:
            origin[count], stroke[count] = low, along
            for power in range(4):
                cubic[count, power] = cubics[i + 1, power]
            count += 1
            breaks[count] = min(high, ends[along + 1])
            if ends[along + 1] <= high:
                along += 1
    return breaks[: count + 1].copy(), origin[:count].copy(), cubic[:count].copy(), stroke[:count].copy()
