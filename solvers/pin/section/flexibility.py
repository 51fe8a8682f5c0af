"""Flexibility of a pin section in bending and shear, as functions of u = 1 - (d/D)^2.

Bending: 1/v = 1/(u (2 - u)), convex. Shear: Cowper's coefficient of a tube, 1/(k A) = phi(u)/A0 with

    phi(u) = A/u + B (1 - u)/(u (2 - u)^2),   A = (7 + 6 nu)/(6 (1 + nu)),   B = (20 + 12 nu)/(6 (1 + nu)),

decreasing, convex up to about u = 0.9 and concave from there to the solid section. A station's flexibility g = B/v +
S phi may therefore be concave close to the solid section. Its convex envelope follows g up to the point whose
tangent passes through (1, g(1)), and that tangent from there on: never above g, and equal to it wherever the minimum
of u + lambda g can lie. The third derivatives of 1/v and phi are negative for every u (``phi_curvature`` decreases).

Source: G. R. Cowper (1966), The shear coefficient in Timoshenko's beam theory.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ShearFlexibility:
    """Constants A and B of phi."""

    a: float
    b: float


@kernel
def phi(u: float, a: float, b: float) -> float:
    """Shear flexibility phi(u) relative to that of the area A0."""
    c = 2.0 - u
    return a / u + b * (1.0 - u) / (u * c * c)


@kernel
def phi_slope(u: float, a: float, b: float) -> float:
    """phi'(u), from the partial fractions (A + B/4)/u + (B/4)/(2-u) - (B/2)/(2-u)^2."""
    c = 2.0 - u
    return -(a + 0.25 * b) / (u * u) + 0.25 * b / (c * c) - b / (c * c * c)


@kernel
def phi_curvature(u: float, a: float, b: float) -> float:
    """phi''(u); decreasing in u, zero at the inflection point."""
    c = 2.0 - u
    return 2.0 * (a + 0.25 * b) / (u * u * u) + 0.5 * b / (c * c * c) - 3.0 * b / (c * c * c * c)


@kernel
def line_from(bend: float, shear: float, a: float, b: float) -> float:
    """Return the u from which the convex envelope of g = bend/v + shear phi on (0, 1] is linear to (1, g(1)); 1:
    nowhere.

    g + g' e = g(1) with e = 1 - u; divided by the common factor e^2 this is
    shear b (1 - 3e) = bend (1 + e)(1 + e^2) + shear a (1 + e)^3, decreasing on the left, increasing on the right.
    """
    if shear * b <= bend + shear * a:
        return 1.0
    e = 0.0
    for _ in range(30):
        c = 1.0 + e
        f = bend * c * (1.0 + e * e) + shear * (a * c * c * c - b * (1.0 - 3.0 * e))
        df = bend * (1.0 + e * (2.0 + 3.0 * e)) + shear * (3.0 * a * c * c + 3.0 * b)
        step = f / df
        e -= step
        if abs(step) <= 1e-15:
            break
    return 1.0 - e


@kernel
def chord(u: float, bend: float, shear: float, a: float, b: float) -> float:
    """(g(u) - g(1))/(1 - u), -g'(1) at u = 1: rate of decrease of g along the chord to the solid section."""
    e = 1.0 - u
    c = 1.0 + e
    return (bend * e / c + shear * (a + b / (c * c))) / u


@kernel
def bending(u: float) -> tuple[float, float, float]:
    """1/v = (1/u + 1/(2-u))/2 with its first and second derivative."""
    c = 2.0 - u
    return 1.0 / (u * c), 0.5 * (1.0 / (c * c) - 1.0 / (u * u)), 1.0 / (u * u * u) + 1.0 / (c * c * c)


@cache
def cowper(poisson: float) -> ShearFlexibility:
    """Return Cowper's constants for this Poisson's ratio."""
    k = 6.0 * (1.0 + poisson)
    return ShearFlexibility((7.0 + 6.0 * poisson) / k, (20.0 + 12.0 * poisson) / k)


@cache
def inflection(poisson: float) -> float:
    """Return the u above which phi is concave, 0.90 to 0.91."""
    law, low, high = cowper(poisson), 0.5, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if phi_curvature(middle, law.a, law.b) > 0.0 else (low, middle)
    return low
