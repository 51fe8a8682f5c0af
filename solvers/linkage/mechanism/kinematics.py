"""A change-point four-bar with a fully rotating crank: angles, joints and angular velocities at any crank angle.

Lengths in cranks, angles in rad; the formulas are in ``angular_velocity_ratio``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.linkage.mechanism.angular_velocity_ratio import transfer_and_slope
from solvers.linkage.mechanism.change_point import ChangePoint, Gain, Number, Ratios
from solvers.numerics.arrays import Array


@dataclass(frozen=True)
class FourBar:
    """A change-point mechanism of one kind, or many with arrays as ratios; all quantities in crank lengths."""

    kind: ChangePoint
    ratios: Ratios

    @cached_property
    def coefficients(self) -> Array:
        """lambda0, lambda2, lambda3, N, M, kappa = |N| e, sigma in the last axis."""
        kind, r = self.kind, self.ratios
        numerator = kind.half_angle_coefficient(r)
        kappa, margin = abs(numerator) * kind.pin_to_pivot(r), kind.rotatability_margin(r)
        out = np.empty((*np.shape(numerator), 7))
        for k, value in enumerate((r.base, r.coupler, r.rocker, numerator, margin, kappa, kind.rocker_sign)):
            out[..., k] = value
        return out

    @cached_property
    def gain(self) -> Number:
        """g = sqrt(lambda0 lambda2/lambda3)."""
        return (self.ratios.base * self.ratios.coupler / self.ratios.rocker) ** 0.5

    @cached_property
    def u31_start(self) -> Number:
        """|u31(0)| = (g - 1)/e, after the blow; without cancellation, as g^2 - 1 = |N| e/lambda3."""
        return abs(self.kind.half_angle_coefficient(self.ratios)) / self.ratios.rocker / (self.gain + 1.0)

    @cached_property
    def u31_end(self) -> Number:
        """|u31(2 pi)| = (g + 1)/e, before the blow."""
        return (self.gain + 1.0) / self.kind.pin_to_pivot(self.ratios)

    @property
    def restitution(self) -> Number:
        """R_k = (g - 1)/(g + 1)."""
        return self.u31_start / self.u31_end

    @cached_property
    def rotatable(self) -> Number:
        """Whether the crank rotates fully."""
        return self.kind.rotatability_margin(self.ratios) >= 0.0

    @cached_property
    def reverses(self) -> bool:
        """Whether the rocker can reverse at the blow: e, |N| > 0."""
        kind, r = self.kind, self.ratios
        return bool(kind.pin_to_pivot(r) > 0.0 and kind.crank_sign * kind.half_angle_coefficient(r) > 0.0)

    @cached_property
    def swing(self) -> Number:
        """Angle of the rocker between its end positions [rad]: 2 asin(g/lambda0), maximal (pi) at g = lambda0.

        Accurate near pi: g/lambda0 = sqrt(lambda2/(lambda0 lambda3)).
        """
        margin = np.maximum(self.kind.straight_swing_margin(self.ratios), 0.0)
        return 2.0 * np.arctan2(np.sqrt(self.ratios.coupler), np.sqrt(margin))

    @cached_property
    def middle_transmission_angle(self) -> Number:
        """nu(pi), the transmission angle in mid-cycle [rad]; pi if the crank does not rotate fully."""
        margin = np.maximum(self.kind.rotatability_margin(self.ratios), 0.0)
        return 2.0 * np.arctan2(self.ratios.base, np.sqrt(margin))

    @property
    def longest(self) -> float:
        """The longest link, in cranks."""
        return float(max(self.ratios.base, self.ratios.coupler, self.ratios.rocker, 1.0))

    def transfer(self, phi: Array | float) -> Array:
        """u31 at crank angles in [-2 pi, 2 pi]; same shape."""
        angles = np.asarray(phi, float)
        return transfer_and_slope(self.coefficients, angles.ravel())[0].reshape(angles.shape)

    def rocker_angle(self, phi: Array | float) -> Array:
        """phi3 [rad], 0 at the blow, at crank angles in [-2 pi, 2 pi]; same shape."""
        angles = np.asarray(phi, float)
        s, c = np.abs(np.sin(0.5 * angles)), np.where(angles < 0, -1.0, 1.0) * np.cos(0.5 * angles)
        base, coupler, rocker, numerator, margin, kappa, _ = self.coefficients
        # Zero, up to rounding, where a crank that cannot rotate fully is stopped.
        root = np.sqrt(np.maximum(base * coupler * rocker * c * c + margin * s * s, 0.0))
        return_numerator = (rocker * kappa * c * c + margin * s * s) / (root + rocker * np.abs(c))
        return 2.0 * np.arctan2(numerator * s, np.where(c < 0, return_numerator, rocker * c + root))

    def joints(self, phi: Array | float) -> tuple[Array, Array]:
        """Crank pin B and rocker joint C in cranks, each (2, n); crank pivot at 0, rocker pivot at (lambda0, 0)."""
        angle, rocker_angle = np.atleast_1d(np.asarray(phi, float)), np.atleast_1d(self.rocker_angle(phi))
        pin = self.kind.crank_sign * np.stack([np.cos(angle), np.sin(angle)])
        joint = self.kind.rocker_sign * self.ratios.rocker * np.stack([np.cos(rocker_angle), np.sin(rocker_angle)])
        joint[0] += self.ratios.base
        return pin, joint


def of_family(kind: ChangePoint, restitution: float, parameter: float) -> FourBar:
    """The mechanism of a kind with R_k = ``restitution`` and the kind's free ratio."""
    return FourBar(kind, kind.family(Gain(restitution), parameter))
