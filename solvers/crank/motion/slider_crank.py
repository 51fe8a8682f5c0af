"""Exact piston motion, with or without a pin offset, and the textbook's two harmonics.

phi is measured from the crank parallel to the cylinder axis, on the cylinder's side; the offset e is the distance of
the cylinder axis from the shaft, positive toward the side to which the crank turns from there. Without an offset
that is the angle from top dead centre. Displacement is measured from the top dead centre toward the crank.

The displacement's derivative is r (sin phi + cos phi tan beta), so forces expressed in the tangent do exactly the
work of the gas.

Without an offset, with lambda = r/L < 1: the velocity in elementary functions, and the two harmonics, exact in the
limit of a long rod; their errors are greatest with the crank perpendicular to the cylinder axis. Source: any text on
engine dynamics, e.g. C. F. Taylor, The Internal Combustion Engine in Theory and Practice II.
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


class Geometry(NamedTuple):
    """Geometry of a mechanism: r, L and e [m], the top dead centre's angle [rad], its sine and cosine."""

    r: float
    length: float
    offset: float
    top: float
    top_sine: float
    top_cosine: float


@dataclass(frozen=True)
class ExactMotion:
    """The exact slider-crank, with or without offset: sin(beta) = (r sin phi - e)/L. Valid for r + |e| < L.

    With the top dead centre at sin phi_t = e/(L + r), where beta = -phi_t, the displacement is one product, x = 2
    r sin((phi - phi_t)/2) sin((phi + beta)/2)/cos((beta - phi_t)/2), free of cancellation there. Checked against
    50-digit positions and their derivatives. Source: derived from the triangle.
    """

    crank_radius: float
    rod_length: float
    offset: float = 0.0

    @property
    def dead_centres(self) -> tuple[float, float]:
        """Crank angles of the top dead centre and of the following bottom one [rad]."""
        return self.geometry.top, math.pi + math.asin(self.offset / (self.rod_length - self.crank_radius))

    @property
    def stroke(self) -> float:
        """H - h, with H^2 = (L + r)^2 - e^2 and h^2 = (L - r)^2 - e^2, as 4 L r/(H + h)."""
        r, length, e = self.crank_radius, self.rod_length, abs(self.offset)
        top_height = math.sqrt((length + r - e) * (length + r + e))
        bottom_height = math.sqrt((length - r - e) * (length - r + e))
        return 4.0 * length * r / (top_height + bottom_height)

    @cached_property
    def geometry(self) -> Geometry:
        r, length, e = self.crank_radius, self.rod_length, self.offset
        sine = e / (length + r)
        return Geometry(r, length, e, math.asin(sine), sine, math.sqrt((1.0 - sine) * (1.0 + sine)))

    def displacement(self, angle: ArrayLike) -> Array:
        """x [m] at crank angles [rad], from the top dead centre toward the crank; same shape as the angles."""
        return self._motion(angle)[0]

    def acceleration(self, angle: ArrayLike) -> Array:
        """d2x/dphi2 = r (cos phi - sin phi tan beta + lambda cos^2 phi/cos^3 beta) [m]."""
        return self._motion(angle)[1]

    def _motion(self, angle: ArrayLike) -> Array:
        phi = np.asarray(angle, dtype=float)
        return _motion(phi.ravel(), self.geometry).reshape(2, *phi.shape)


class AngleFunctions(NamedTuple):
    """Functions of one crank angle: sin phi, cos phi, tan beta, 1/cos beta, and the sine and cosine of
    h = (phi - phi_t)/2."""

    sine: float
    cosine: float
    tangent: float
    secant: float
    half_sine: float
    half_cosine: float


@inlined_kernel
def angle_functions(phi: float, geometry: Geometry) -> AngleFunctions:
    """Compute the functions of a crank angle from sine and cosine of one half angle.

    cos beta = sqrt((L - s)(L + s))/L, s = r sin phi - e; the difference of L and r, e is formed first. With 1 - |sin
    phi| = cos^2 phi/(1 + |sin phi|) it avoids cancellation where crank and rod are nearly perpendicular to the
    cylinder axis.
    """
    half = 0.5 * (phi - geometry.top)
    half_sine, half_cosine = math.sin(half), math.cos(half)
    double_sine, double_cosine = 2.0 * half_sine * half_cosine, (half_cosine - half_sine) * (half_cosine + half_sine)
    sine = double_sine * geometry.top_cosine + double_cosine * geometry.top_sine
    cosine = double_cosine * geometry.top_cosine - double_sine * geometry.top_sine
    absolute_sine, signed_offset = abs(sine), -geometry.offset if sine < 0.0 else geometry.offset
    short_side = (geometry.length - geometry.r + signed_offset) + geometry.r * cosine * cosine / (1.0 + absolute_sine)
    inverse_height = 1.0 / math.sqrt(short_side * (geometry.length + geometry.r * absolute_sine - signed_offset))
    return AngleFunctions(
        sine,
        cosine,
        (geometry.r * sine - geometry.offset) * inverse_height,
        geometry.length * inverse_height,
        half_sine,
        half_cosine,
    )


@inlined_kernel
def displacement_of(at: AngleFunctions, geometry: Geometry) -> float:
    """x from the top dead centre, free of cancellation there:
    2 r sin^2 h (cos beta + cos phi_t + 2 lambda cos h cos((phi + phi_t)/2))/(1 + cos(beta - phi_t))."""
    mean_cosine = at.half_cosine * geometry.top_cosine - at.half_sine * geometry.top_sine
    rod_cosine = 1.0 / at.secant
    numerator = rod_cosine + geometry.top_cosine + 2.0 * geometry.r / geometry.length * at.half_cosine * mean_cosine
    square = 2.0 * geometry.r * at.half_sine * at.half_sine
    return square * numerator / (1.0 + rod_cosine * (geometry.top_cosine + at.tangent * geometry.top_sine))


@inlined_kernel
def acceleration_of(at: AngleFunctions, geometry: Geometry) -> float:
    """d2x/dphi2 [m]."""
    cosine_ratio = at.cosine * at.secant
    return geometry.r * (
        at.cosine - at.sine * at.tangent + geometry.r / geometry.length * cosine_ratio * cosine_ratio * at.secant
    )


@inlined_kernel
def rod_acceleration_of(at: AngleFunctions, geometry: Geometry) -> float:
    """d2beta/dphi2 = (beta'^2 sin beta - lambda sin phi)/cos beta, with beta' = lambda cos phi/cos beta."""
    ratio = geometry.r / geometry.length
    rate = ratio * at.cosine * at.secant
    return rate * rate * at.tangent - ratio * at.sine * at.secant


@kernel
def _motion(phi: Array, geometry: Geometry) -> Array:
    out = np.empty((2, phi.size))
    for i in range(phi.size):
        at = angle_functions(phi[i], geometry)
        out[0, i], out[1, i] = displacement_of(at, geometry), acceleration_of(at, geometry)
    return out


@kernel
def crank_angle_at(displacement: float, r: float, length: float, e: float) -> float:
    """Return the crank angle [rad] of a piston displacement [m] on the downward stroke from the top dead centre.

    The inverse of ``ExactMotion.displacement``; outside the stroke, the angle of the nearest dead centre.
    With d the distance of the wrist pin from the shaft: half-angle forms of the triangle r, L, d, whose two small
    sides L + r - d and d - (L - r) are computed from the distances to the dead centres. Free of cancellation at
    both; roots are taken factor by factor, so that x = 1e-300 does not underflow.
    """
    offset = abs(e)
    top_height = math.sqrt((length + r - offset) * (length + r + offset))
    bottom_height = math.sqrt((length - r - offset) * (length - r + offset))
    stroke = 4.0 * length * r / (top_height + bottom_height)
    x = min(max(displacement, 0.0), stroke)
    remaining = stroke - x
    height = top_height - x if x < remaining else bottom_height + remaining
    distance = math.sqrt(height * height + e * e)
    sine_part = (
        math.sqrt(x) * math.sqrt((2.0 * top_height - x) / (length + r + distance)) * math.sqrt(length + distance - r)
    )
    cosine_part = (
        math.sqrt(remaining)
        * math.sqrt((2.0 * bottom_height + remaining) / (distance + length - r))
        * math.sqrt(distance + r + length)
    )
    return math.atan2(e, height) + 2.0 * math.atan2(sine_part, cosine_part)


def velocity(angle: ArrayLike, crank_radius: float, rod_length: float, angular_speed: float) -> Array:
    """v = r omega sin(phi) (1 + lambda cos(phi)/sqrt(1 - lambda^2 sin^2(phi))) [m/s], positive toward the crank."""
    lam = crank_radius / rod_length
    s = lam * np.sin(angle)
    return crank_radius * angular_speed * np.sin(angle) * (1.0 + lam * np.cos(angle) / np.sqrt((1.0 - s) * (1.0 + s)))


def two_harmonic_acceleration(angle: ArrayLike, crank_radius: float, rod_length: float, angular_speed: float) -> Array:
    """a = r omega^2 (cos phi + lambda cos 2 phi) [m/s^2]: the second derivative of ``brix_displacement``."""
    lam = crank_radius / rod_length
    return crank_radius * angular_speed**2 * (np.cos(angle) + lam * np.cos(2.0 * np.asarray(angle)))


def brix_displacement(angle: ArrayLike, crank_radius: float, rod_length: float) -> Array:
    """x = r [(1 - cos phi) + (lambda/4)(1 - cos 2 phi)] [m]: Brix's construction; the differences as squared sines."""
    lam = crank_radius / rod_length
    return crank_radius * (2.0 * np.sin(0.5 * np.asarray(angle)) ** 2 + 0.5 * lam * np.sin(angle) ** 2)


def brix_error(ratio: float) -> float:
    """max |x_Brix - x|/r = lambda^3/(2 (1 + c)^2), c = sqrt(1 - lambda^2), lambda = r/L."""
    return ratio**3 / (2.0 * (1.0 + math.sqrt((1.0 - ratio) * (1.0 + ratio))) ** 2)


def two_harmonic_error(ratio: float) -> float:
    """max |a_2 - a|/(r omega^2 (1 + lambda)) = lambda^3/(c (1 + c) (1 + lambda)), c as in ``brix_error``."""
    c = math.sqrt((1.0 - ratio) * (1.0 + ratio))
    return ratio**3 / (c * (1.0 + c) * (1.0 + ratio))
