"""Exact piston motion, with or without a pin offset.

phi is measured from the crank parallel to the cylinder axis, on the cylinder's side; the offset e is the distance of
the cylinder axis from the shaft, positive toward the side to which the crank turns from there. Without an offset
that is the angle from top dead centre. Displacement is measured from the upper dead centre toward the crank.

The displacement's derivative is r (sin phi + cos phi tan beta), so forces expressed in the tangent do exactly the
work of the gas.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from solvers.numerics.arrays import Array
from solvers.numerics.jit import inlined_kernel, kernel


class Posture(NamedTuple):
    """State of a mechanism at some angles, each of their shape: displacement x [m], sin phi, cos phi, tan beta,
    d2x/dphi2 [m] and d2beta/dphi2."""

    displacement: Array
    sine: Array
    cosine: Array
    tangent: Array
    acceleration: Array
    turning: Array


class Frame(NamedTuple):
    """Kernel data of a mechanism: r, L and e [m], the upper dead centre's angle [rad], its sine and cosine."""

    r: float
    length: float
    offset: float
    top: float
    top_sine: float
    top_cosine: float


@dataclass(frozen=True)
class ExactMotion:
    """The exact slider-crank, with or without offset: sin(beta) = (r sin phi - e)/L. Valid for r + |e| < L.

    With the upper dead centre at sin phi_t = e/(L + r), where beta = -phi_t, the displacement is one product, x = 2
    r sin((phi - phi_t)/2) sin((phi + beta)/2)/cos((beta - phi_t)/2), free of cancellation there. Checked against
    50-digit positions and their derivatives. Source: derived from the triangle.
    """

    crank_radius: float
    rod_length: float
    offset: float = 0.0

    @property
    def dead_centres(self) -> tuple[float, float]:
        r, length, e = self.crank_radius, self.rod_length, self.offset
        return math.asin(e / (length + r)), math.pi + math.asin(e / (length - r))

    @property
    def stroke(self) -> float:
        """H - h, with H^2 = (L + r)^2 - e^2 and h^2 = (L - r)^2 - e^2, as 4 L r/(H + h)."""
        r, length, e = self.crank_radius, self.rod_length, abs(self.offset)
        high = math.sqrt((length + r - e) * (length + r + e))
        low = math.sqrt((length - r - e) * (length - r + e))
        return 4.0 * length * r / (high + low)

    @cached_property
    def frame(self) -> Frame:
        r, length, e = self.crank_radius, self.rod_length, self.offset
        sine = e / (length + r)
        return Frame(r, length, e, math.asin(sine), sine, math.sqrt((1.0 - sine) * (1.0 + sine)))

    def displacement(self, angle: ArrayLike) -> Array:
        """x [m] from the upper dead centre toward the crank."""
        return self.posture(angle).displacement

    def posture(self, angle: ArrayLike) -> Posture:
        """tan beta = sin beta/cos beta; d2x/dphi2 = r (cos phi - sin phi tan beta + lambda cos^2 phi/cos^3 beta);
        d2beta/dphi2 = (beta'^2 sin beta - lambda sin phi)/cos beta, with beta' = lambda cos phi/cos beta."""
        phi = np.asarray(angle, dtype=float)
        return Posture(*_postures(phi.ravel(), self.frame).reshape(6, *phi.shape))


class Stand(NamedTuple):
    """Kernel state of a mechanism at one angle: sin phi, cos phi, tan beta, 1/cos beta, and the sine and cosine of
    h = (phi - phi_t)/2."""

    sine: float
    cosine: float
    tangent: float
    secant: float
    half_sine: float
    half_cosine: float


@inlined_kernel
def stand_at(phi: float, frame: Frame) -> Stand:
    """Return all functions of the angle from sine and cosine of one half angle.

    cos beta = sqrt((L - s)(L + s))/L, s = r sin phi - e; the difference of L and r, e is formed first. With 1 - |sin
    phi| = cos^2 phi/(1 + |sin phi|) it avoids cancellation where crank and rod are nearly perpendicular to the
    cylinder axis.
    """
    half = 0.5 * (phi - frame.top)
    half_sine, half_cosine = math.sin(half), math.cos(half)
    whole, across = 2.0 * half_sine * half_cosine, (half_cosine - half_sine) * (half_cosine + half_sine)
    sine = whole * frame.top_cosine + across * frame.top_sine
    cosine = across * frame.top_cosine - whole * frame.top_sine
    rise, aside = abs(sine), -frame.offset if sine < 0.0 else frame.offset
    near = (frame.length - frame.r + aside) + frame.r * cosine * cosine / (1.0 + rise)
    upright = 1.0 / math.sqrt(near * (frame.length + frame.r * rise - aside))
    return Stand(
        sine, cosine, (frame.r * sine - frame.offset) * upright, frame.length * upright, half_sine, half_cosine
    )


@inlined_kernel
def displacement_of(at: Stand, frame: Frame) -> float:
    """x from the upper dead centre, free of cancellation there:
    2 r sin^2 h (cos beta + cos phi_t + 2 lambda cos h cos((phi + phi_t)/2))/(1 + cos(beta - phi_t))."""
    along = at.half_cosine * frame.top_cosine - at.half_sine * frame.top_sine
    rod = 1.0 / at.secant
    lean = rod + frame.top_cosine + 2.0 * frame.r / frame.length * at.half_cosine * along
    square = 2.0 * frame.r * at.half_sine * at.half_sine
    return square * lean / (1.0 + rod * (frame.top_cosine + at.tangent * frame.top_sine))


@inlined_kernel
def acceleration_of(at: Stand, frame: Frame) -> float:
    """d2x/dphi2 [m]."""
    swept = at.cosine * at.secant
    return frame.r * (at.cosine - at.sine * at.tangent + frame.r / frame.length * swept * swept * at.secant)


@inlined_kernel
def turning_of(at: Stand, frame: Frame) -> float:
    """d2beta/dphi2."""
    ratio = frame.r / frame.length
    rate = ratio * at.cosine * at.secant
    return rate * rate * at.tangent - ratio * at.sine * at.secant


@kernel
def _postures(phi: Array, frame: Frame) -> Array:
    out = np.empty((6, phi.size))
    for i in range(phi.size):
        at = stand_at(phi[i], frame)
        out[0, i], out[1, i], out[2, i] = displacement_of(at, frame), at.sine, at.cosine
        out[3, i], out[4, i], out[5, i] = at.tangent, acceleration_of(at, frame), turning_of(at, frame)
    return out


@kernel
def crank_angle_at(displacement: float, r: float, length: float, e: float) -> float:
    """Return the angle [rad], past the upper dead centre on the downward stroke, of a piston displacement [m].

    The inverse of ``ExactMotion.displacement``; outside the stroke that of the nearest dead centre.
    With d the distance of the wrist pin from the shaft: half-angle forms of the triangle r, L, d, whose two small
    sides L + r - d and d - (L - r) are computed from the distances to the dead centres. Free of cancellation at
    both; roots are taken factor by factor, so that x = 1e-300 does not underflow.
    """
    aside = abs(e)
    high = math.sqrt((length + r - aside) * (length + r + aside))
    low = math.sqrt((length - r - aside) * (length - r + aside))
    stroke = 4.0 * length * r / (high + low)
    x = min(max(displacement, 0.0), stroke)
    rest = stroke - x
    height = high - x if x < rest else low + rest
    distance = math.sqrt(height * height + e * e)
    down = math.sqrt(x) * math.sqrt((2.0 * high - x) / (length + r + distance)) * math.sqrt(length + distance - r)
    up = math.sqrt(rest) * math.sqrt((2.0 * low + rest) / (distance + length - r)) * math.sqrt(distance + r + length)
    return math.atan2(e, height) + 2.0 * math.atan2(down, up)
