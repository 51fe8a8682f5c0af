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
from numpy.typing import ArrayLike

from solvers.crank.faults import STROKE_FAULTS, Points, require_sound
from solvers.crank.motion import ExactMotion, Motion, crank_angle
from solvers.crank.pressure import MOST_POINTS, Array
from solvers.errors import InvalidInput

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


class _Table(NamedTuple):
    """A stroke's cubics as arrays: scipy checks its own again at every look."""

    x: Array
    c: Array

    def __call__(self, volume: Array) -> Array:
        """The curve; beyond its points the value of the nearest."""
        x, c = self.x, self.c
        inside = np.minimum(np.maximum(volume, x[0]), x[-1])
        piece = np.searchsorted(x[1:-1], inside, side="right")
        t = inside - x[piece]
        return ((c[0, piece] * t + c[1, piece]) * t + c[2, piece]) * t + c[3, piece]


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
    def _tables(self) -> tuple[_Table, ...]:
        return tuple(_Table(np.asarray(curve.x), np.asarray(curve.c)) for curve in self._curves)

    @property
    def period(self) -> float:
        return math.pi * len(self.strokes)

    @cached_property
    def _boundaries(self) -> Array:
        top, bottom = self.motion.dead_centres
        turns = 2.0 * math.pi * np.arange(len(self.strokes) // 2)
        return np.append(np.sort(np.concatenate([top + turns, bottom + turns])), top + self.period)

    def pressure(self, angle: ArrayLike) -> Array:
        phi, start = np.asarray(angle, dtype=float), self._boundaries[0]
        inside = np.where((phi >= start) & (phi <= start + self.period), phi, start + np.mod(phi - start, self.period))
        along = np.clip(np.searchsorted(self._boundaries, inside, side="right") - 1, 0, len(self.strokes) - 1)
        volume = self.clearance_volume + self.area * self.mapping.displacement(inside)
        out = np.empty_like(volume)
        for index, table in enumerate(self._tables):
            here = along == index
            out[here] = table(volume[here])
        return out

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
