"""Unrolling an indicator diagram: from p(V), stroke by stroke, to p(phi).

V = V_c + A x(phi); p is a monotone cubic (PCHIP) of V along the stroke that phi belongs to. A cycle starts at the upper
dead centre: a four-stroke cycle with the intake, a two-stroke one with the expansion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solvers.crank.gas.data_faults import STROKE_FAULTS, Points, require_sound
from solvers.crank.gas.pressure_table import MOST_POINTS, Array
from solvers.crank.motion.slider_crank import ExactMotion, Motion, crank_angle
from solvers.errors import InvalidInput
from solvers.numerics.jit import kernel

if TYPE_CHECKING:
    from scipy.interpolate import PchipInterpolator

    from solvers.crank.scene import Cylinder

STROKES = {2: ("expansion", "compression"), 4: ("intake", "compression", "expansion", "exhaust")}
"""The strokes of a cycle, in order from the upper dead centre; the piston moves down in every other one."""


@dataclass(frozen=True)
class Stroke:
    """Volumes [m3] and pressures [Pa] along one stroke, in either order."""

    volume: tuple[float, ...]
    pressure: tuple[float, ...]

    @cached_property
    def curve(self) -> PchipInterpolator:
        """p of V [Pa, m3], for points without a fault."""
        from scipy.interpolate import PchipInterpolator

        order = np.argsort(self.volume)
        return PchipInterpolator(np.asarray(self.volume)[order], np.asarray(self.pressure)[order])


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
            for name, values in (("volume", stroke.volume), ("pressure", stroke.pressure)):
                bad = np.flatnonzero(~np.isfinite(values))
                if bad.size:
                    raise InvalidInput(f"{field}.{name}.{bad[0]}", "must be finite", "finite numbers")

    def unroll(self, motion: ExactMotion, cylinder: Cylinder, mapping: Motion | None = None) -> IndicatorCurve:
        """The diagram over the crank angle. Raises InvalidInput, with the point named, for points out of order,
        repeated, outside the cylinder's volumes, or short of a dead centre."""
        names = STROKES[cylinder.strokes]
        if len(self.strokes) != len(names):
            raise InvalidInput("pressure.strokes", "needs one set of points per stroke", ", ".join(names))
        swept = cylinder.area * motion.stroke
        for index, stroke in enumerate(self.strokes):
            low = cylinder.clearance_volume
            points = Points(np.asarray(stroke.volume), np.asarray(stroke.pressure), low, low + swept)
            require_sound(points, STROKE_FAULTS, f"pressure.strokes.{index}.volume")
        return IndicatorCurve(self.strokes, motion, mapping or motion, cylinder.area, cylinder.clearance_volume)


class _Tables(NamedTuple):
    """The cubics of all strokes behind each other: points, coefficients (4, points), where each stroke begins.

    scipy checks its own again at every look.
    """

    x: Array
    c: Array
    first: NDArray[np.intp]


@kernel
def _pressures(angle: Array, volume: Array, tables: _Tables, boundaries: Array) -> Array:
    """p of the stroke that an angle belongs to; beyond a stroke's points the value of the nearest."""
    out, start = np.empty(angle.size), boundaries[0]
    period = boundaries[-1] - start
    for i in range(angle.size):
        phi = angle[i]
        if not start <= phi <= start + period:
            phi = start + (phi - start) % period
        stroke = 0
        while stroke < tables.first.size - 2 and boundaries[stroke + 1] <= phi:
            stroke += 1
        low, high = tables.first[stroke], tables.first[stroke + 1] - 1
        inside = min(max(volume[i], tables.x[low]), tables.x[high])
        while high - low > 1:
            middle = (low + high) // 2
            if tables.x[middle] <= inside:
                low = middle
            else:
                high = middle
        t, c = inside - tables.x[low], tables.c
        out[i] = ((c[0, low] * t + c[1, low]) * t + c[2, low]) * t + c[3, low]
    return out


@dataclass(frozen=True)
class IndicatorCurve:
    """A diagram unrolled; ``mapping`` tells the volume at an angle, ``motion`` where the strokes begin and end."""

    strokes: tuple[Stroke, ...]
    motion: ExactMotion
    mapping: Motion
    area: float
    clearance_volume: float

    @property
    def _curves(self) -> tuple[PchipInterpolator, ...]:
        return tuple(stroke.curve for stroke in self.strokes)

    @cached_property
    def _tables(self) -> _Tables:
        curves = self._curves
        x = np.concatenate([curve.x for curve in curves])
        # The last point of a stroke begins no piece.
        c = np.concatenate([np.pad(np.asarray(curve.c), ((0, 0), (0, 1))) for curve in curves], axis=1)
        return _Tables(x, np.ascontiguousarray(c), np.cumsum([0, *(curve.x.size for curve in curves)]))

    @property
    def period(self) -> float:
        return math.pi * len(self.strokes)

    @cached_property
    def _boundaries(self) -> Array:
        top, bottom = self.motion.dead_centres
        turns = 2.0 * math.pi * np.arange(len(self.strokes) // 2)
        return np.append(np.sort(np.concatenate([top + turns, bottom + turns])), top + self.period)

    def pressure(self, angle: ArrayLike) -> Array:
        phi = np.asarray(angle, dtype=float)
        volume = self.clearance_volume + self.area * np.asarray(self.mapping.displacement(phi))
        return _pressures(phi.ravel(), volume.ravel(), self._tables, self._boundaries).reshape(phi.shape)

    @cached_property
    def breaks(self) -> Array:
        """The dead centres, and the points as far as they lie between them."""
        found = [self._boundaries]
        for index, curve in enumerate(self._curves):
            down = crank_angle(self.motion, (curve.x - self.clearance_volume) / self.area)
            if index % 2:  # The piston rises: the angle past the lower dead centre follows from the mirrored mechanism.
                mirrored = ExactMotion(self.motion.crank_radius, self.motion.rod_length, -self.motion.offset)
                down = 2.0 * math.pi - crank_angle(mirrored, (curve.x - self.clearance_volume) / self.area)
            angles = down + 2.0 * math.pi * (index // 2)
            low, high = self._boundaries[index], self._boundaries[index + 1]
            found.append(angles[(angles > low) & (angles < high)])
        return np.unique(np.concatenate(found))

    @property
    def jumps(self) -> tuple[tuple[float, float], ...]:
        ends = [(float(c(c.x[0])), float(c(c.x[-1]))) for c in self._curves]
        found = []
        for index in range(len(self.strokes)):
            at_bottom = index % 2
            found.append((float(self._boundaries[index]), ends[index][at_bottom] - ends[index - 1][at_bottom]))
        return tuple(found)

    def work(self) -> float:
        """The work of one cycle [J]: the integral of p dV, exact for the curves between the points."""
        low = self.clearance_volume
        high = low + self.area * self.motion.stroke
        total = 0.0
        for index, curve in enumerate(self._curves):
            first, last = curve.x[0], curve.x[-1]
            inside = float(curve.integrate(max(low, first), min(high, last)))
            inside += float(curve(first)) * max(first - low, 0.0) + float(curve(last)) * max(high - last, 0.0)
            total += -inside if index % 2 else inside
        return total
