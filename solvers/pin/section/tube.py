"""Flexibility of a tube of given bore in terms of its material y = (D^2 - d^2)/l^2.

f = 1/(y (y + 2 kappa)) is the bending flexibility over 64/(E pi l^4), and by Cowper the shear flexibility over
4/(G pi l^2) is

    g = a/y + (b kappa/2) (f + 1/(y + 2 kappa)^2),

kappa = 1 with l the bore and 0 for a bar without one. With kappa = -1 and l the outer diameter they are the pin's
functions of u, f with its sign reversed (``solvers.pin.section.flexibility``). Both are convex for y > 0 if kappa is
not negative.

Source: Cowper's coefficient (see ``solvers.pin.section.flexibility``) with m^2 = d^2/D^2, in partial fractions.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel

Array = NDArray[np.float64]
_EPS = float(np.finfo(float).eps)


@kernel
def bending(y: float, kappa: float) -> tuple[float, float, float]:
    """f = 1/(y (y + 2 kappa)) with its first and second derivative."""
    f = 1.0 / (y * (y + 2.0 * kappa))
    return f, -2.0 * (y + kappa) * f * f, (6.0 / f + 8.0 * kappa * kappa) * f * f * f


@kernel
def shearing(y: float, kappa: float, a: float, b: float) -> tuple[float, float, float]:
    """g with its first and second derivative."""
    f, df, d2f = bending(y, kappa)
    c, h = 1.0 / (y + 2.0 * kappa), 0.5 * b * kappa
    return (
        a / y + h * (f + c * c),
        -a / (y * y) + h * (df - 2.0 * c * c * c),
        2.0 * a / (y * y * y) + h * (d2f + 6.0 * c * c * c * c),
    )


@kernel
def place_around(
    lam: float, w: float, bend: float, shear: float, low: float, kappa: float, a: float, b: float
) -> float:
    """argmin over y >= low of w y + lam (bend f + shear g), w > 0, kappa >= 0."""
    p, q = lam * bend / w, lam * shear / w
    if p == 0.0 and q == 0.0:
        return low
    thin = math.sqrt(0.5 * kappa * p + q * (a + 0.25 * b * kappa))
    y = thin if kappa > 0.0 else (2.0 * p) ** (1.0 / 3.0) + thin
    least, most = 0.0, np.inf
    for _ in range(200):
        df, d2f = bending(y, kappa)[1:]
        dg, d2g = shearing(y, kappa, a, b)[1:]
        pull = -(p * df + q * dg)
        if pull > 1.0:
            least = y
        else:
            most = y
        new = y * math.exp(math.log(pull) * pull / (y * (p * d2f + q * d2g)))
        if not least < new < most:
            if abs(new - y) <= 4.0 * _EPS * y:
                break
            new = 2.0 * y if most == np.inf else (math.sqrt(least) * math.sqrt(most) if least > 0.0 else 0.5 * y)
        if abs(new - y) <= 2.0 * _EPS * y:
            break
        y = new
    return max(y, low)
