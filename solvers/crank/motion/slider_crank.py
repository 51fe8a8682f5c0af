"""How the piston moves: exactly, with a pin offset, or by the two-harmonic form that the textbooks use.

phi counts from the crank standing parallel to the cylinder axis, on the cylinder's side; the offset e is the distance
of the cylinder axis from the shaft, positive toward the side to which the crank turns from there. Without an offset
that is the angle from top dead centre. Displacement counts from the upper dead centre toward the crank.

Every motion gives the tangent of the rod's angle and its own displacement's derivative is r (sin phi + cos phi tan
beta), so that forces made of the tangent do, in every motion, exactly the work of the gas.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solvers.crank.motion import in_line as kinematics
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


class Motion(Protocol):
    """A slider-crank mechanism's motion, by crank angle [rad]; lengths in m, derivatives per radian."""

    crank_radius: float
    rod_length: float

    def displacement(self, angle: ArrayLike) -> Array:
        """x [m] from the upper dead centre toward the crank."""

    def rod_tangent(self, angle: ArrayLike) -> Array:
        """tan(beta), positive where the crank pin lies on the side to which the crank turns from phi = 0."""

    def acceleration(self, angle: ArrayLike) -> Array:
        """d2x/dphi2 [m]: times omega^2 the acceleration."""

    def rod_angular_acceleration(self, angle: ArrayLike) -> Array:
        """d2beta/dphi2: times omega^2 the angular acceleration of the rod."""

    def posture(self, angle: ArrayLike) -> Posture:
        """All but the displacement at once."""

    @property
    def dead_centres(self) -> tuple[float, float]:
        """The angles [rad] of the upper and the lower dead centre that follows it."""

    @property
    def stroke(self) -> float:
        """The distance [m] between the dead centres."""


def derivative(motion: Motion, angle: ArrayLike) -> Array:
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

    def displacement(self, angle: ArrayLike) -> Array:
        phi = np.asarray(angle, dtype=float)
        found = _displacement(phi.ravel(), self.crank_radius, self.rod_length, self.offset, self.dead_centres[0])
        return found.reshape(phi.shape)

    def posture(self, angle: ArrayLike) -> Posture:
        """tan beta = sin beta/cos beta; d2x/dphi2 = r (cos phi - sin phi tan beta + lambda cos^2 phi/cos^3 beta);
        d2beta/dphi2 = (beta'^2 sin beta - lambda sin phi)/cos beta, with beta' = lambda cos phi/cos beta."""
        phi = np.asarray(angle, dtype=float)
        found = _posture(phi.ravel(), self.crank_radius, self.rod_length, self.offset)
        return Posture(*found.reshape(5, *phi.shape))

    def rod_tangent(self, angle: ArrayLike) -> Array:
        return self.posture(angle).tangent

    def acceleration(self, angle: ArrayLike) -> Array:
        return self.posture(angle).acceleration

    def rod_angular_acceleration(self, angle: ArrayLike) -> Array:
        return self.posture(angle).turning


@kernel
def _displacement(phi: Array, r: float, length: float, offset: float, top: float) -> Array:
    """x from the upper dead centre, at phi = ``top``."""
    out = np.empty(phi.size)
    for i in range(phi.size):
        beta = math.asin((r * math.sin(phi[i]) - offset) / length)
        half, centre = 0.5 * (phi[i] - top), math.cos(0.5 * (beta - top))
        risen = math.sin(half) / centre
        # The sum phi + beta is built from its distance to the dead centre, where both parts cancel.
        turned = math.asin(r / length * math.cos(0.5 * (phi[i] + top)) * risen)
        out[i] = 2.0 * r * risen * math.sin(half + turned)
    return out


@kernel
def _posture(phi: Array, r: float, length: float, offset: float) -> Array:
    """The rows of a posture, (5, n).

    cos beta = sqrt((L - s)(L + s))/L, s = r sin phi - e; what is left of L beside r and e is formed before anything
    else. With 1 - |sin phi| = cos^2 phi/(1 + |sin phi|) it keeps its digits where the crank stands across and the rod
    all but with it.
    """
    out, ratio = np.empty((5, phi.size)), r / length
    for i in range(phi.size):
        sine, cosine = math.sin(phi[i]), math.cos(phi[i])
        rise, aside = abs(sine), -offset if sine < 0.0 else offset
        near = (length - r + aside) + r * cosine * cosine / (1.0 + rise)
        rod = math.sqrt(near * (length + r * rise - aside)) / length
        rod_sine = (r * sine - offset) / length
        turning = ratio * cosine / rod
        out[0, i], out[1, i], out[2, i] = sine, cosine, rod_sine / rod
        out[3, i] = r * (cosine - sine * rod_sine / rod + turning * cosine / (rod * rod))
        out[4, i] = (turning * turning * rod_sine - ratio * sine) / rod
    return out


@dataclass(frozen=True)
class TwoHarmonicMotion:
    """The textbooks' form, x = r [(1 - cos phi) + (lambda/4)(1 - cos 2 phi)]; no offset.

    Its rod has tan(beta) = lambda sin(phi). Greatest errors for lambda = 0.25: 0.20 % of r in x, 0.66 % of
    r omega^2 (1 + lambda) in the acceleration. Brix's graphical construction, which shifts the centre by
    r lambda/2, amounts to the same displacement.
    """

    crank_radius: float
    rod_length: float

    @property
    def dead_centres(self) -> tuple[float, float]:
        return 0.0, math.pi

    @property
    def stroke(self) -> float:
        return 2.0 * self.crank_radius

    def displacement(self, angle: ArrayLike) -> Array:
        return kinematics.brix_displacement(angle, self.crank_radius, self.rod_length)

    def rod_tangent(self, angle: ArrayLike) -> Array:
        return self.crank_radius / self.rod_length * np.sin(angle)

    def acceleration(self, angle: ArrayLike) -> Array:
        ratio = self.crank_radius / self.rod_length
        return self.crank_radius * (np.cos(angle) + ratio * np.cos(2.0 * np.asarray(angle)))

    def rod_angular_acceleration(self, angle: ArrayLike) -> Array:
        return -self.crank_radius / self.rod_length * np.sin(angle)

    def posture(self, angle: ArrayLike) -> Posture:
        sine, cosine, ratio = np.sin(angle), np.cos(angle), self.crank_radius / self.rod_length
        tangent = ratio * sine
        return Posture(sine, cosine, tangent, self.crank_radius * (cosine + ratio * (1.0 - 2.0 * sine**2)), -tangent)


def crank_angle(motion: ExactMotion, displacement: ArrayLike) -> Array:
    """The angle [rad], past the upper dead centre on the downward stroke, at which the piston has a displacement.

    The inverse of ``ExactMotion.displacement``: with d the distance of the wrist pin from the shaft, half-angle forms
    of the triangle r, L, d, whose two small sides L + r - d and d - (L - r) are built from the distances to the dead
    centres. Nothing cancels at either. Displacements outside the stroke are taken as the dead centre they lie beyond.
    """
    r, length, e, stroke = motion.crank_radius, motion.rod_length, motion.offset, motion.stroke
    if e == 0.0:
        return kinematics.crank_angle(displacement, r, length)
    x = np.clip(np.asarray(displacement, dtype=float), 0.0, stroke)
    rest = stroke - x
    high = math.sqrt((length + r - abs(e)) * (length + r + abs(e)))
    low = math.sqrt((length - r - abs(e)) * (length - r + abs(e)))
    height = np.where(x < rest, high - x, low + rest)
    distance = np.hypot(height, e)
    beyond = x * (2.0 * high - x) / (length + r + distance)
    short = rest * (2.0 * low + rest) / (distance + length - r)
    down = np.sqrt(beyond) * np.sqrt(length + distance - r)
    up = np.sqrt(short) * np.sqrt(distance + r + length)
    return np.arctan2(e, height) + 2.0 * np.arctan2(down, up)
