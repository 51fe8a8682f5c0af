"""The slider-crank without an offset in elementary functions: its velocity, and the textbook's two harmonics.

phi is the crank angle from top dead centre, lambda = r/L; displacement is measured from top dead centre toward the
crank. Validity: lambda < 1; the two harmonics are exact in the limit of a long rod. Their errors are greatest with the
crank perpendicular to the cylinder axis.

Source: any text on engine dynamics, e.g. C. F. Taylor, The Internal Combustion Engine in Theory and Practice II.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray


def velocity(angle: ArrayLike, crank_radius: float, rod_length: float, angular_speed: float) -> NDArray[np.float64]:
    """v = r omega sin(phi) (1 + lambda cos(phi)/sqrt(1 - lambda^2 sin^2(phi))) [m/s], positive toward the crank."""
    lam = crank_radius / rod_length
    s = lam * np.sin(angle)
    return crank_radius * angular_speed * np.sin(angle) * (1.0 + lam * np.cos(angle) / np.sqrt((1.0 - s) * (1.0 + s)))


def two_harmonic_acceleration(
    angle: ArrayLike, crank_radius: float, rod_length: float, angular_speed: float
) -> NDArray[np.float64]:
    """a = r omega^2 (cos phi + lambda cos 2 phi) [m/s^2]: the second derivative of ``brix_displacement``."""
    lam = crank_radius / rod_length
    return crank_radius * angular_speed**2 * (np.cos(angle) + lam * np.cos(2.0 * np.asarray(angle)))


def brix_displacement(angle: ArrayLike, crank_radius: float, rod_length: float) -> NDArray[np.float64]:
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
