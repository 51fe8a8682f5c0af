"""Static stability of the strip in its mechanism.

The rod buckles when the determinant of its boundary conditions vanishes. In compression that is, with x = K l,
K = sqrt(-P/EI) and beta = l/L,

    beta^2 (sin x - x cos x)/x^3 + (1 - beta) sin x / x = 0,

whose first root x(beta) in (pi, 4.4934…] depends on beta alone. The critical parameter u = L sqrt(P_cr/EI) = x/beta is
the paper's Fig. 2; beta = 1 is the clamped-pinned column (tan u = u), beta -> 0 gives u -> pi/beta.

Source: T. A. Obolenskaya, A. S. Klochko (2014), Fig. 2; S. P. Timoshenko, J. M. Gere, Theory of Elastic Stability.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from solvers.errors import InvalidInput
from solvers.numerics.jit import kernel

FIRST_ROOT_LIMITS = (np.pi, 4.493409457909064)
"""x at beta = 0 and at beta = 1 (the first root of tan x = x)."""

_START = np.array(
    [3.14159, 0.00121, 0.26981, 1.0763, -5.80599, 28.24394, -79.62024, 141.69129, -153.2619, 92.88904, -24.13172]
)
"""x(beta) to 1e-4 as a polynomial: the initial guess of Newton's method."""


@kernel
def first_root(beta: float) -> tuple[float, float]:
    """x(beta), the first buckling root for beta = l/L in (0, 1], and dx/dbeta, by Newton's method."""
    x = 0.0
    for n in range(_START.size - 1, -1, -1):
        x = _START[n] + beta * x
    slope = 0.0
    for _ in range(4):
        sine, cosine = math.sin(x), math.cos(x)
        value = beta * beta * (sine - x * cosine) + (1.0 - beta) * x * x * sine
        slope = beta * beta * x * sine + (1.0 - beta) * (2.0 * x * sine + x * x * cosine)
        step = value / slope
        x -= step
        if abs(step) < 1e-13 * x:
            break
    sine, cosine = math.sin(x), math.cos(x)
    slope = beta * beta * x * sine + (1.0 - beta) * (2.0 * x * sine + x * x * cosine)
    return x, -(2.0 * beta * (sine - x * cosine) - x * x * sine) / slope


@kernel
def log_critical_parameter(l: float, rod_length: float) -> tuple[float, float]:
    """ln u with u = L sqrt(P_cr/EI), and d ln u/d ln l, for l > 0 [m]; a strip longer than L is taken as L long."""
    beta = min(l / rod_length, 1.0)
    x, slope = first_root(beta)
    return math.log(x / beta), beta * slope / x - 1.0


def critical_phase(length_ratio: float) -> float:
    """x = K_cr l for beta = l/L in (0, 1], accurate to a few units in the last place."""
    if not 0.0 < length_ratio <= 1.0:
        raise InvalidInput("dimensions.l", "the free length must be positive and not exceed the rod", "(0, L]")
    return min(first_root(length_ratio)[0], FIRST_ROOT_LIMITS[1])


def critical_parameter(length_ratio: float) -> float:
    """u = L sqrt(P_cr/EI), dimensionless, for beta = l/L in (0, 1]."""
    return critical_phase(length_ratio) / length_ratio


@lru_cache(maxsize=256)
def critical_coupling(length: float, rod_length: float) -> float:
    """-P_cr/EI [1/m^2], the (negative) coupling q at which the strip of this free length buckles, rigid in shear.

    Cached, as a search evaluates many strips of the same length in succession.
    """
    return -((critical_phase(length / rod_length) / length) ** 2)


def critical_force(elastic_modulus: float, b: float, h: float, length: float, rod_length: float) -> float:
    """P_cr [N], rigid in shear: the smaller of the buckling loads in and out of the crank's plane.

    Out of the crank's plane the rod is assumed hinged at the pin too. A crank pin that resists tilting would increase
    that load, so a strip wider than thick (b >= h) is governed by bending in the crank's plane either way.
    """
    return elastic_modulus * b * h * min(b, h) ** 2 / 12.0 * -critical_coupling(length, rod_length)
