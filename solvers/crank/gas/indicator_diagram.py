"""Unrolling of an indicator diagram: from p(V), stroke by stroke, to p(phi).

V = V_c + A x(phi); p is a monotone cubic (PCHIP) of V along the stroke that phi belongs to. A cycle starts at the
upper dead centre: a four-stroke cycle with the intake, a two-stroke one with the expansion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

import numpy as np

from solvers.crank.gas.cylinder import Cylinder
from solvers.crank.gas.data_faults import END_GAP, STROKE_FAULTS, Points, require_finite, require_sound
from solvers.crank.gas.unrolled_pressure import MOST_POINTS, Unrolled
from solvers.crank.motion.slider_crank import ExactMotion, Geometry, crank_angle_at
from solvers.errors import InvalidInput
from solvers.numerics.arrays import Array, Index
from solvers.numerics.jit import kernel
from solvers.numerics.monotone_cubic import monotone_cubics

STROKES = {2: ("expansion", "compression"), 4: ("intake", "compression", "expansion", "exhaust")}
"""The strokes of a cycle, in order from the upper dead centre, alternately downward and upward."""


@dataclass(frozen=True)
class Stroke:
    """Volumes [m3] and pressures [Pa] along one stroke, in either order."""

    volume: tuple[float, ...]
    pressure: tuple[float, ...]


@dataclass(frozen=True)
class IndicatorPressure:
    """An indicator diagram: one set of points per stroke, in the order of ``STROKES``."""

    strokes: tuple[Stroke, ...]

    def __post_init__(self) -> None:
        for index, stroke in enumerate(self.strokes):
            count, field = len(stroke.volume), f"pressure.strokes.{index}"
            if not 2 <= count <= MOST_POINTS:
                raise InvalidInput(f"{field}.volume", "has too few or too many points", f"2 … {MOST_POINTS} points")
            if len(stroke.pressure) != count:
                raise InvalidInput(f"{field}.pressure", "needs one pressure per volume", f"{count} pressures")
            require_finite(field, volume=stroke.volume, pressure=stroke.pressure)

    @cached_property
    def _ascending(self) -> tuple[Array, Index, tuple[float, ...]]:
        """Volumes and pressures of all strokes, each ascending in volume, (2, points); the index of each stroke's first
        point; the ranges of the strokes' minimum and maximum volumes, and the minimum step."""
        columns = [np.array((stroke.volume, stroke.pressure)) for stroke in self.strokes]
        columns = [c if c[0, 0] < c[0, -1] else c[:, ::-1] for c in columns]
        points = np.concatenate(columns, axis=1)
        first = np.array([0, *accumulate(c.shape[1] for c in columns)], np.intp)
        least, greatest = points[0, first[:-1]].tolist(), points[0, first[1:] - 1].tolist()
        steps = points[0, 1:] - points[0, :-1]
        steps[first[1:-1] - 1] = math.inf  # from one stroke to the next
        return points, first, (min(least), max(least), min(greatest), max(greatest), float(steps.min()))

    def unroll(self, motion: ExactMotion, cylinder: Cylinder) -> Unrolled:
        """Return the diagram over the crank angle.

        Raises InvalidInput, naming the point, for points out of order, repeated, outside the cylinder's volumes, or
        short of a dead centre.
        """
        names = STROKES[cylinder.strokes]
        if len(self.strokes) != len(names):
            raise InvalidInput("pressure.strokes", "needs one set of points per stroke", ", ".join(names))
        low, swept = cylinder.clearance_volume, cylinder.area * motion.stroke
        (volume, pressure), first, (a, b, c, d, step) = self._ascending
        high, gap = low + swept, END_GAP * swept
        # Complete and ascending data has no fault; testing each fault separately takes ten times as long.
        if not (low - gap < a <= b < low + gap and high - gap < c <= d < high + gap and step > 1e-12 * swept):
            for index, stroke in enumerate(self.strokes):
                points = Points(np.array(stroke.volume), np.array(stroke.pressure), low, high)
                require_sound(points, STROKE_FAULTS, f"pressure.strokes.{index}.volume")
        top, bottom = motion.dead_centres
        ends = np.array([(bottom if i % 2 else top) + i // 2 * 2.0 * math.pi for i in range(len(names) + 1)])
        geometry = motion.geometry
        breaks, origin, cubic, stroke_of = _unrolled(volume, pressure, first, ends, geometry, cylinder.area, low)
        return Unrolled(breaks, origin, cubic, stroke_of, True, geometry, cylinder.area, low)


@kernel
def _unrolled(
    volume: Array, pressure: Array, first: Index, ends: Array, geometry: Geometry, area: float, clearance: float
) -> tuple[Array, Array, Array, Index]:
    """Return breaks, origins, cubics and strokes of a diagram.

    The points of each stroke are ascending in volume, from index ``first`` on. Beyond a stroke's points the pressure
    is that of the nearest point.
    """
    size = volume.size + first.size
    breaks, origin, cubic = np.empty(size + 1), np.empty(size), np.zeros((size, 4))
    stroke, count = np.empty(size, np.intp), 0
    for s in range(first.size - 1):
        x, y = volume[first[s] : first[s + 1]], pressure[first[s] : first[s + 1]]
        cubics, n, upward = monotone_cubics(x, y), x.size, s % 2 == 1
        start = ends[s]
        for step in range(n + 1):
            # Interval i starts at point i - 1; the last ends at the dead centre.
            i = n - step if upward else step
            end = ends[s + 1]
            if step < n:
                displacement = (x[i - 1 if upward else i] - clearance) / area
                # The angle past the lower dead centre follows from the mirrored mechanism.
                angle = crank_angle_at(
                    displacement, geometry.r, geometry.length, -geometry.offset if upward else geometry.offset
                )
                end = s // 2 * 2.0 * math.pi + (2.0 * math.pi - angle if upward else angle)
                end = min(end, ends[s + 1])
            if end > start:
                breaks[count], stroke[count] = start, s
                if i == 0:
                    origin[count], cubic[count, 3] = 0.0, y[0]
                elif i == n:
                    origin[count], cubic[count, 3] = x[n - 1], y[n - 1]
                else:
                    origin[count] = x[i - 1]
                    for power in range(4):
                        cubic[count, power] = cubics[i - 1, power]
                start = end
                count += 1
    breaks[count] = ends[-1]
    return breaks[: count + 1].copy(), origin[:count].copy(), cubic[:count].copy(), stroke[:count].copy()
