"""How the piston moves, exactly, with or without a pin offset.

phi counts from the crank standing parallel to the cylinder axis, on the cylinder's side; the offset e is the distance
of the cylinder axis from the shaft, positive toward the side to which the crank turns from there. Without an offset
that is the angle from top dead centre. Displacement counts from the upper dead centre toward the crank.

The displacement's derivative is r (sin phi + cos phi tan beta), so that forces made of the tangent do exactly the work
of the gas.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solvers.numerics.jit import kernel

Array = NDArray[np.float64]


class Posture(NamedTuple):
    """How a mechanism stands at some angles, each of their shape: sin phi, cos phi, tan beta, d2x/dphi2 [m] and
    d2beta/dphi2."""

    sine: Array
    cosine: Array
    tangent: Array
    acceleration: Array
    turning: Array


class Frame(NamedTuple):
    """A mechanism as kernels take it: r, L and e [m], the upper dead centre's angle [rad], its sine and cosine."""

    r: float
    length: float
    offset: float
    top: float
    top_sine: float
    top_cosine: float


def derivative(motion: ExactMotion, angle: ArrayLike) -> Array:
    """dx/dphi = r (sin phi + cos phi tan beta) [m]: times omega the velocity."""
    at = motion.posture(angle)
    return motion.crank_radius * (at.sine + at.cosine * at.tangent)


@dataclass(frozen=True)
class ExactMotion:
    """The exact slider-crank, with or without offset: sin(beta) = (r sin phi - e)/L. Valid for r + |e| < L.

    With the upper dead centre at sin phi_t = e/(L + r), where beta = -phi_t, the displacement is one product,
    x = 2 r sin((phi - phi_t)/2) sin((phi + beta)/2)/cos((beta - phi_t)/2), which keeps its digits there. Checked
    against 50-digit positions and their derivatives. Source: derived from the triangle; for e = 0 the same as
    ``solvers.crank.motion.in_line``.
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
        phi = np.asarray(angle, dtype=float)
        return _displacements(phi.ravel(), self.frame).reshape(phi.shape)

    def posture(self, angle: ArrayLike) -> Posture:
        """tan beta = sin beta/cos beta; d2x/dphi2 = r (cos phi - sin phi tan beta + lambda cos^2 phi/cos^3 beta);
        d2beta/dphi2 = (beta'^2 sin beta - lambda sin phi)/cos beta, with beta' = lambda cos phi/cos beta."""
        phi = np.asarray(angle, dtype=float)
        return Posture(*_postures(phi.ravel(), self.frame).reshape(5, *phi.shape))

    def rod_tangent(self, angle: ArrayLike) -> Array:
        return self.posture(angle).tangent

    def acceleration(self, angle: ArrayLike) -> Array:
        return self.posture(angle).acceleration

    def rod_angular_acceleration(self, angle: ArrayLike) -> Array:
        return self.posture(angle).turning


@kernel
def displacement_at(phi: float, frame: Frame) -> float:
    """x from the upper dead centre.

    With h = (phi - phi_t)/2 and s = sin h/cos((beta - phi_t)/2) the half sum (phi + beta)/2 is h + asin q,
    q = lambda cos((phi + phi_t)/2) s, of which nothing cancels at the dead centre.
    """
    half = 0.5 * (phi - frame.top)
    sine, cosine = math.sin(half), math.cos(half)
    tilt = (frame.r * math.sin(phi) - frame.offset) / frame.length
    along = math.sqrt((1.0 - tilt) * (1.0 + tilt)) * frame.top_cosine + tilt * frame.top_sine
    risen = sine / math.sqrt(0.5 + 0.5 * along)
    q = frame.r / frame.length * (cosine * frame.top_cosine - sine * frame.top_sine) * risen
    return 2.0 * frame.r * risen * (sine * math.sqrt((1.0 - q) * (1.0 + q)) + cosine * q)


@kernel
def _displacements(phi: Array, frame: Frame) -> Array:
    out = np.empty(phi.size)
    for i in range(phi.size):
        out[i] = displacement_at(phi[i], frame)
    return out


@kernel
def posture_at(phi: float, frame: Frame) -> tuple[float, float, float, float, float]:
    """A posture's five numbers.

    cos beta = sqrt((L - s)(L + s))/L, s = r sin phi - e; what is left of L beside r and e is formed before anything
    else. With 1 - |sin phi| = cos^2 phi/(1 + |sin phi|) it keeps its digits where the crank stands across and the rod
    all but with it.
    """
    r, length, offset = frame.r, frame.length, frame.offset
    sine, cosine = math.sin(phi), math.cos(phi)
    rise, aside = abs(sine), -offset if sine < 0.0 else offset
    near = (length - r + aside) + r * cosine * cosine / (1.0 + rise)
    rod = math.sqrt(near * (length + r * rise - aside)) / length
    rod_sine, ratio = (r * sine - offset) / length, r / length
    turning = ratio * cosine / rod
    acceleration = r * (cosine - sine * rod_sine / rod + turning * cosine / (rod * rod))
    return sine, cosine, rod_sine / rod, acceleration, (turning * turning * rod_sine - ratio * sine) / rod


@kernel
def _postures(phi: Array, frame: Frame) -> Array:
    out = np.empty((5, phi.size))
    for i in range(phi.size):
        out[0, i], out[1, i], out[2, i], out[3, i], out[4, i] = posture_at(phi[i], frame)
    return out


def crank_angle(motion: ExactMotion, displacement: ArrayLike) -> Array:
    """The angle [rad], past the upper dead centre on the downward stroke, at which the piston has a displacement [m].

    The inverse of ``ExactMotion.displacement``. Displacements outside the stroke are taken as the dead centre they lie
    beyond.
    """
    x = np.asarray(displacement, dtype=float)
    return _crank_angles(x.ravel(), motion.frame).reshape(x.shape)


@kernel
def _crank_angles(displacement: Array, frame: Frame) -> Array:
    out = np.empty(displacement.size)
    for i in range(displacement.size):
        out[i] = crank_angle_at(displacement[i], frame.r, frame.length, frame.offset)
    return out


@kernel
def crank_angle_at(displacement: float, r: float, length: float, e: float) -> float:
    """``crank_angle`` of one displacement.

    With d the distance of the wrist pin from the shaft, half-angle forms of the triangle r, L, d, whose two small sides
    L + r - d and d - (L - r) are built from the distances to the dead centres. Nothing cancels at either; roots are
    taken factor by factor, so that x = 1e-300 does not underflow.
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
