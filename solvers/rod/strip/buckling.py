"""Static stability of the strip in its mechanism.

The rod buckles when the determinant of its boundary conditions vanishes. In compression that is, with x = K l,
K = sqrt(-P/EI) and beta = l/L,

    beta^2 (sin x - x cos x)/x^3 + (1 - beta) sin x / x = 0,

whose first root x(beta) in (pi, 4.4934…] depends on beta alone. The critical parameter u = L sqrt(P_cr/EI) = x/beta is
the paper's Fig. 2; beta = 1 is the clamped-pinned column (tan u = u), beta -> 0 gives u -> pi/beta.

Source: T. A. Obolenskaya, A. S. Klochko (2014), Fig. 2; S. P. Timoshenko, J. M. Gere, Theory of Elastic Stability.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.typing import ArrayLike, NDArray

from solvers.errors import InvalidInput

FIRST_ROOT_LIMITS = (np.pi, 4.493409457909064)
"""x at beta = 0 and at beta = 1 (the first root of tan x = x)."""

_DEGREE = 30


def _residual(x: NDArray[np.float64], beta: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """x^3 times the determinant, and its derivative in x: both smooth and bounded on the bracket."""
    sine, cosine = np.sin(x), np.cos(x)
    value = beta**2 * (sine - x * cosine) + (1.0 - beta) * x**2 * sine
    derivative = beta**2 * x * sine + (1.0 - beta) * (2.0 * x * sine + x**2 * cosine)
    return value, derivative


@lru_cache(maxsize=1)
def _fit() -> Chebyshev:
    """x(beta) as a Chebyshev interpolant: the root is analytic in beta on [0, 1]."""

    def roots(beta: NDArray[np.float64]) -> NDArray[np.float64]:
        low = np.full_like(beta, FIRST_ROOT_LIMITS[0])
        high = np.full_like(beta, FIRST_ROOT_LIMITS[1])
        for _ in range(60):
            middle = 0.5 * (low + high)
            positive = _residual(middle, beta)[0] > 0
            low, high = np.where(positive, middle, low), np.where(positive, high, middle)
        return 0.5 * (low + high)

    return Chebyshev.interpolate(roots, _DEGREE, domain=[0.0, 1.0])


def critical_phase(length_ratio: ArrayLike) -> NDArray[np.float64]:
    """x = K_cr l for beta = l/L in (0, 1]; exact to a few units in the last place (fit and one Newton step)."""
    beta = np.asarray(length_ratio, dtype=float)
    if not np.all((beta > 0) & (beta <= 1)):
        raise InvalidInput("dimensions.l", "the free length must be positive and not exceed the rod", "(0, L]")
    x = _fit()(beta)
    value, derivative = _residual(x, beta)
    return np.minimum(x - value / derivative, FIRST_ROOT_LIMITS[1])


def critical_parameter(length_ratio: ArrayLike) -> NDArray[np.float64]:
    """u = L sqrt(P_cr/EI), dimensionless, for beta = l/L in (0, 1]."""
    return critical_phase(length_ratio) / np.asarray(length_ratio, dtype=float)


def critical_coupling(length: ArrayLike, rod_length: float) -> NDArray[np.float64]:
    """-P_cr/EI [1/m^2], the (negative) coupling q at which the strip of this free length buckles."""
    length = np.asarray(length, dtype=float)
    return -((critical_phase(length / rod_length) / length) ** 2)


def critical_force(
    elastic_modulus: ArrayLike, b: ArrayLike, h: ArrayLike, length: ArrayLike, rod_length: float
) -> NDArray[np.float64]:
    """P_cr [N], about the axis of the smaller section modulus: the least of both buckling loads.

    Out of the crank's plane the rod is taken as hinged at the pin too. A crank pin that resists tilting would hold
    more, so a strip wider than thick (b >= h) is governed by bending in the crank's plane either way.
    """
    b, h = np.asarray(b, dtype=float), np.asarray(h, dtype=float)
    inertia = b * h * np.minimum(b, h) ** 2 / 12.0
    return np.asarray(elastic_modulus, dtype=float) * inertia * -critical_coupling(length, rod_length)
