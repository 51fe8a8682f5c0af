"""Unrolling of an indicator diagram: from p(V), stroke by stroke, to p(phi).

V = V_c + A x(phi); p is a monotone cubic (PCHIP) of V along the stroke that phi belongs to. A cycle starts at the
top dead centre: a four-stroke cycle with the intake, a two-stroke one with the expansion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from solvers.crank.gas.data_faults import (
    END_GAP,
    STROKE_FAULTS,
    Points,
    Repair,
    repaired,
    require_finite,
    require_sound,
)
from solvers.crank.gas.unrolled_pressure import MOST_POINTS, Cylinder, Unrolled
from solvers.crank.motion.slider_crank import ExactMotion, Geometry, crank_angle_at
from solvers.errors import InvalidInput
from solvers.numerics.arrays import Array, Index
from solvers.numerics.jit import kernel
from solvers.numerics.monotone_cubic import monotone_cubics

STROKES = {2: ("expansion", "compression"), 4: ("intake", "compression", "expansion", "exhaust")}
"""The strokes of a cycle, in order from the top dead centre, alternately downward and upward."""


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

    def unroll(self, motion: ExactMotion, cylinder: Cylinder) -> Unrolled:
        """Return the diagram over the crank angle.

        Raises InvalidInput, naming the point, for points out of order, repeated, outside the cylinder's volumes, or
        short of a dead centre.
        """
        names = STROKES[cylinder.strokes]
        if len(self.strokes) != len(names):
            raise InvalidInput("pressure.strokes", "needs one set of points per stroke", ", ".join(names))
        low, swept = cylinder.clearance_volume, cylinder.area * motion.stroke
        high, gap = low + swept, END_GAP * swept
        volumes, pressures, ends_at = [], [], [0]
        for stroke in self.strokes:
            step = 1 if stroke.volume[0] < stroke.volume[-1] else -1
            volumes += stroke.volume[::step]
            pressures += stroke.pressure[::step]
            ends_at.append(len(volumes))
        volume, pressure, first = np.array(volumes), np.array(pressures), np.array(ends_at, np.intp)
        # Complete and ascending data has no fault; testing each fault separately takes ten times as long.
        if not _sound(volume, first, low, high, gap):
            for index, stroke in enumerate(self.strokes):
                points = Points(np.array(stroke.volume), np.array(stroke.pressure), low, high)
                require_sound(points, STROKE_FAULTS, f"pressure.strokes.{index}.volume")
        top, bottom = motion.dead_centres
        ends = np.array([(bottom if i % 2 else top) + i // 2 * 2.0 * math.pi for i in range(len(names) + 1)])
        return _unrolled(volume, pressure, first, ends, motion.geometry, cylinder.area, low)


@kernel
def _sound(volume: Array, first: Index, low: float, high: float, gap: float) -> bool:
    """Whether every stroke's volumes, from index ``first`` on, ascend and reach both ends up to a ``gap``."""
    for s in range(first.size - 1):
        x = volume[first[s] : first[s + 1]]
        if not (abs(x[0] - low) < gap and abs(x[-1] - high) < gap and np.diff(x).min() > 1e-12 * (high - low)):
            return False
    return True


@kernel
def _unrolled(
    volume: Array, pressure: Array, first: Index, ends: Array, geometry: Geometry, area: float, clearance: float
) -> Unrolled:
    """Return a diagram over the crank angle, its strokes between these ``ends`` [rad].

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
                # The angle past the bottom dead centre follows from the mirrored mechanism.
                angle = crank_angle_at(
                    displacement, geometry.r, geometry.length, -geometry.offset if upward else geometry.offset
                )
                end = s // 2 * 2.0 * math.pi + (2.0 * math.pi - angle if upward else angle)
                end = min(end, ends[s + 1])
            if end > start:
                breaks[count], stroke[count] = start, s
                origin[count], cubic[count, 3] = x[max(i - 1, 0)], y[max(i - 1, 0)]
                for power in range(3 if 0 < i < n else 0):
                    cubic[count, power] = cubics[i - 1, power]
                start = end
                count += 1
    breaks[count] = ends[-1]
    breaks, origin, cubic = breaks[: count + 1].copy(), origin[:count].copy(), cubic[:count].copy()
    return Unrolled(breaks, origin, cubic, stroke[:count].copy(), True, geometry, area, clearance)


def repaired_indicator(
    diagram: IndicatorPressure, cylinder: Cylinder, motion: ExactMotion
) -> tuple[IndicatorPressure, tuple[Repair, ...]]:
    """Return the repaired diagram and the repairs. Raises InvalidInput for irreparable data."""
    low, swept = cylinder.clearance_volume, cylinder.area * motion.stroke
    strokes, repairs = [], []
    for index, stroke in enumerate(diagram.strokes):
        points = Points(np.asarray(stroke.volume), np.asarray(stroke.pressure), low, low + swept)
        points, applied = repaired(points, STROKE_FAULTS, f"pressure.strokes.{index}.volume", 2)
        strokes.append(Stroke(tuple(points.x.tolist()), tuple(points.pressure.tolist())))
        repairs += applied
    return IndicatorPressure(tuple(strokes)), tuple(repairs)
