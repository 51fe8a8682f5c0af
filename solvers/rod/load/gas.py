"""Pressure on the piston: p(phi) over one revolution, and the back pressure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from solvers.errors import InvalidInput
from solvers.numerics.arrays import Array
from solvers.numerics.periodic import TURN
from solvers.rod.scene import Load, PressureCurve

if TYPE_CHECKING:
    from scipy.interpolate import PchipInterpolator

_WIDE_PEAK = 0.1
"""Half-width [rad] of a peak that uniform angles do not miss."""
_MAX_SHARP = 4096
"""Number of a table's points that sampling takes into account."""
_APART = 1e-9
"""Points closer than this [rad] are one."""


_NO_BREAKS, _NO_PIECES = np.empty(0), np.empty((4, 0))


def _require(ok: bool, name: str, reason: str, allowed: str) -> None:
    if not ok:
        raise InvalidInput(f"load.{name}", reason, allowed)


def require_back_pressure(value: float | None) -> None:
    """Raise InvalidInput for a back pressure that is not a finite number."""
    _require(value is None or math.isfinite(value), "back_pressure", "must be finite", "(-inf, inf) or none")


def sharpest(angle: Array, values: Array, most: int = _MAX_SHARP) -> Array:
    """Angles of points in increasing order; if more than ``most``, the extreme points in each of equal intervals."""
    if angle.size <= most:
        return angle
    step = np.floor((angle - angle[0]) * (most // 2 / TURN)).astype(int)
    first = np.flatnonzero(np.diff(step, prepend=-1))
    chosen = [np.lexsort((sign * values, step))[first] for sign in (1.0, -1.0)]
    return angle[np.unique(np.concatenate(chosen))]


@dataclass(frozen=True)
class SchmidtLoad(Load):
    """Schmidt's isothermal Stirling cycle: p = p_min (1 + delta)/(1 - delta cos(phi - theta)), 0 <= delta < 1.

    Its mean is p_min (1 + delta)/sqrt(1 - delta^2). The denominator is computed as 1 - delta + 2 delta sin^2((phi -
    theta)/2), free of cancellation as delta -> 1.
    """

    p_min: float
    delta: float
    theta: float
    back_pressure: float | None = None

    def __post_init__(self) -> None:
        _require(math.isfinite(self.p_min) and self.p_min >= 0, "p_min", "must not be negative", "[0, inf)")
        _require(0 <= self.delta < 1, "delta", "must lie in [0, 1): at 1 the pressure has a pole", "[0, 1)")
        _require(math.isfinite(self.theta), "theta", "must be finite", "(-inf, inf)")
        require_back_pressure(self.back_pressure)

    @property
    def default_back_pressure(self) -> float:
        return self.p_min * math.sqrt((1.0 + self.delta) / (1.0 - self.delta))

    def sharp_angles(self) -> Array:
        """Angles around the peak, in steps growing from 1/4 of its half-width in proportion to the distance."""
        width = math.sqrt((1.0 - self.delta) / (1.0 + self.delta))
        if width > _WIDE_PEAK:
            return np.empty(0)
        steps = math.ceil(4.0 * math.asinh(math.pi / width))
        return self.theta + width * np.sinh(0.25 * np.arange(-steps, steps + 1))

    @property
    def curve(self) -> PressureCurve:
        return PressureCurve(float(self.p_min), float(self.delta), float(self.theta), _NO_BREAKS, _NO_PIECES)


@dataclass(frozen=True)
class ConstantLoad(Load):
    """A constant pressure difference, as in a press or on a test bench."""

    constant_pressure: float
    back_pressure: float | None = None

    def __post_init__(self) -> None:
        _require(math.isfinite(self.constant_pressure), "constant_pressure", "must be finite", "(-inf, inf)")
        require_back_pressure(self.back_pressure)

    @property
    def default_back_pressure(self) -> float:
        return 0.0

    @property
    def curve(self) -> PressureCurve:
        return PressureCurve(float(self.constant_pressure), 0.0, 0.0, _NO_BREAKS, _NO_PIECES)


@dataclass(frozen=True)
class TableLoad(Load):
    """Tabulated pressures over one revolution, interpolated by a periodic monotone cubic (PCHIP).

    Angles increase, by 1e-9 at least, and span less than one revolution; the first point follows the last one a
    revolution later. The curve does not overshoot and is once continuously differentiable. Mean: exact integral of the
    pieces.
    """

    angle: tuple[float, ...]
    values: tuple[float, ...]
    back_pressure: float | None = None

    def __post_init__(self) -> None:
        _require(len(self.angle) >= 3, "angle", "needs at least three points", "3 … 100000 points")
        _require(len(self.angle) == len(self.values), "pressure", "needs one pressure per angle", "equal lengths")
        angle, values = np.asarray(self.angle), np.asarray(self.values)
        _require(bool(np.isfinite(angle).all()), "angle", "must be finite", "finite numbers")
        _require(bool(np.isfinite(values).all()), "pressure", "must be finite", "finite numbers")
        falls = np.flatnonzero(np.diff(angle) < _APART)
        if falls.size:
            raise InvalidInput(f"load.angle.{falls[0] + 1}", "does not follow the point before it", "rising angles")
        if angle[-1] - angle[0] > TURN - _APART:
            raise InvalidInput(f"load.angle.{angle.size - 1}", "lies a full turn after the first", "less than one turn")
        require_back_pressure(self.back_pressure)

    @cached_property
    def _three_turns(self) -> PchipInterpolator:
        from scipy.interpolate import PchipInterpolator

        # Overlap on either side makes the slopes, and so the curve, periodic.
        angle, values = np.asarray(self.angle), np.asarray(self.values)
        turns = np.repeat([-TURN, 0.0, TURN], angle.size)
        return PchipInterpolator(np.tile(angle, 3) + turns, np.tile(values, 3))

    @cached_property
    def default_back_pressure(self) -> float:
        return float(self._three_turns.integrate(self.angle[0], self.angle[0] + TURN)) / TURN

    def sharp_angles(self) -> Array:
        """The points of the table; of a very long one the extreme points in each of equal intervals."""
        return sharpest(np.asarray(self.angle), np.asarray(self.values))

    @cached_property
    def curve(self) -> PressureCurve:
        # Keep the middle one of the three revolutions.
        points, turns = len(self.angle), self._three_turns
        pieces = np.ascontiguousarray(turns.c[:, points : 2 * points])
        return PressureCurve(0.0, 0.0, 0.0, np.ascontiguousarray(turns.x[points : 2 * points + 1]), pieces)

    def corners(self) -> Array:
        return self.curve.breaks[:-1]
