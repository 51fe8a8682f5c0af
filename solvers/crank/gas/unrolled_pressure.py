"""The cylinder pressure over one cycle as cubics: the common form of all pressure data.

Between two breaks p is one cubic, of the crank angle (from a table) or of the volume V = V_c + A x(phi) (from a
diagram). At a break it may jump; the piece index selects the side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from solvers.crank.motion.slider_crank import AngleFunctions, ExactMotion, Geometry, angle_functions, displacement_of
from solvers.errors import require, require_not_negative, require_positive
from solvers.numerics.arrays import Array, Index
from solvers.numerics.jit import inlined_kernel, kernel

MOST_POINTS = 20_000


@dataclass(frozen=True)
class Cylinder:
    """Bore D, clearance volume V_c, crankcase pressure p_0, and the strokes per cycle: two or four."""

    bore: float
    clearance_volume: float
    crankcase_pressure: float
    strokes: int

    def __post_init__(self) -> None:
        require_positive(self, "cylinder", "bore")
        require_not_negative(self, "cylinder", "clearance_volume")
        require(math.isfinite(self.crankcase_pressure), "cylinder.crankcase_pressure", "must be finite", "(-inf, inf)")
        require(self.strokes in (2, 4), "cylinder.strokes", "is neither two nor four", "2 or 4")

    @property
    def area(self) -> float:
        return math.pi * self.bore**2 / 4.0

    @property
    def period(self) -> float:
        """Crank angle of one cycle [rad]: 2 pi or 4 pi."""
        return math.pi * self.strokes


class Unrolled(NamedTuple):
    """A pressure cycle over the crank angle: the pieces of one period.

    ``breaks`` (n + 1,) [rad]; the origin of each piece's cubic, in rad or m3 (n,); its coefficients, highest power
    first (n, 4); the stroke it belongs to (n,), even ones downward; and, for cubics of the volume, the motion that
    defines it, the piston's area [m2] and the clearance volume [m3].
    """

    breaks: Array
    origin: Array
    cubic: Array
    stroke: Index
    by_volume: bool
    geometry: Geometry
    area: float
    clearance: float

    @property
    def jumps(self) -> tuple[tuple[float, float], ...]:
        """The dead centres [rad] and the pressure after minus that before [Pa]; a table has no jumps."""
        turns = 2.0 * math.pi * np.arange(round((self.breaks[-1] - self.breaks[0]) / (2.0 * math.pi)))
        angle = (turns[:, None] + np.array(ExactMotion(*self.geometry[:3]).dead_centres)).ravel()
        before = self.pressure(np.nextafter(angle, -np.inf) if self.by_volume else angle)
        return tuple(zip(angle.tolist(), (self.pressure(angle) - before).tolist(), strict=True))

    def pressure(self, angle: ArrayLike, brix: bool = False) -> Array:
        """p(phi) [Pa], same shape as the angles; periodic. With ``brix``, for diagrams without an offset only, by
        Brix's construction."""
        phi = np.asarray(angle, dtype=float)
        return _pressures(np.ascontiguousarray(phi).ravel(), self, brix).reshape(phi.shape)


@inlined_kernel
def piece_of(angle: float, breaks: Array) -> int:
    """Return the index of the piece that contains an angle of the period."""
    low, high = 0, breaks.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if breaks[middle] <= angle:
            low = middle
        else:
            high = middle
    return low


@inlined_kernel
def volume_of(at: AngleFunctions, gas: Unrolled) -> float:
    """Return V [m3], with ``at`` the state of the mechanism ``gas.geometry``."""
    return gas.clearance + gas.area * displacement_of(at, gas.geometry)


@inlined_kernel
def pressure_of(angle: float, at: AngleFunctions, piece: int, gas: Unrolled) -> float:
    """Return p [Pa] at an angle of a piece, both its ends included, with ``at`` the state of ``gas.geometry``."""
    t = volume_of(at, gas) if gas.by_volume else angle
    return _cubic(t - gas.origin[piece], piece, gas)


@inlined_kernel
def _cubic(t: float, piece: int, gas: Unrolled) -> float:
    c = gas.cubic
    return ((c[piece, 0] * t + c[piece, 1]) * t + c[piece, 2]) * t + c[piece, 3]


@inlined_kernel
def work_at(volume: float, piece: int, gas: Unrolled) -> float:
    """Return the integral of p dV [J] from the origin of the piece's cubic of the volume."""
    t, c = volume - gas.origin[piece], gas.cubic
    return t * (c[piece, 3] + t * (c[piece, 2] / 2.0 + t * (c[piece, 1] / 3.0 + t * c[piece, 0] / 4.0)))


@inlined_kernel
def brix_pressure_at(at: AngleFunctions, piece: int, gas: Unrolled) -> float:
    """Return p [Pa] of the diagram at the position of Brix's construction x = r (1 - cos phi + lambda/2 sin^2 phi).

    The cubic at that volume is searched within the stroke, starting from the piece of the exact motion.
    """
    r, half = gas.geometry.r, at.half_sine
    volume = gas.clearance + gas.area * r * (2.0 * half * half + 0.5 * r / gas.geometry.length * at.sine * at.sine)
    stroke, k = gas.stroke[piece], piece
    step = -1 if stroke % 2 else 1
    while 0 <= k - step < gas.stroke.size and gas.stroke[k - step] == stroke and volume < gas.origin[k]:
        k -= step
    while 0 <= k + step < gas.stroke.size and gas.stroke[k + step] == stroke and volume >= gas.origin[k + step]:
        k += step
    return _cubic(volume - gas.origin[k], k, gas)


@inlined_kernel
def wrapped(angle: float, breaks: Array) -> float:
    """Return the angle shifted by whole periods into the range of the breaks."""
    start, period = breaks[0], breaks[-1] - breaks[0]
    if start <= angle <= breaks[-1]:
        return angle
    return min(max(start + (angle - start) % period, start), breaks[-1])


@kernel
def _pressures(angle: Array, gas: Unrolled, brix: bool) -> Array:
    out = np.empty(angle.size)
    for i in range(angle.size):
        phi = wrapped(angle[i], gas.breaks)
        k = piece_of(phi, gas.breaks)
        at = angle_functions(phi, gas.geometry)
        out[i] = brix_pressure_at(at, k, gas) if brix else pressure_of(phi, at, k, gas)
    return out


@kernel
def refined(gas: Unrolled, longest: float) -> Unrolled:
    """Return the same pressures in pieces no longer than ``longest`` [rad]."""
    parts = np.empty(gas.stroke.size, np.intp)
    for k in range(parts.size):
        parts[k] = max(math.ceil((gas.breaks[k + 1] - gas.breaks[k]) / longest), 1)
    breaks, piece, n = np.full(parts.sum() + 1, gas.breaks[-1]), np.empty(parts.sum(), np.intp), 0
    for k in range(parts.size):
        for part in range(parts[k]):
            breaks[n] = gas.breaks[k] + (gas.breaks[k + 1] - gas.breaks[k]) * (part / parts[k])
            piece[n] = k
            n += 1
    origin, cubic, stroke = gas.origin[piece], gas.cubic[piece], gas.stroke[piece]
    return Unrolled(breaks, origin, cubic, stroke, gas.by_volume, gas.geometry, gas.area, gas.clearance)


class Pressure(Protocol):
    """Pressure data of any kind."""

    def unroll(self, motion: ExactMotion, cylinder: Cylinder) -> Unrolled:
        """Return the pressures over the crank angle."""
