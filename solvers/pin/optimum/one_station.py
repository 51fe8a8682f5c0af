"""A single station of a pin or a bushing: the u that minimises its term, and its contribution to the deflection.

f and g, kappa and Cowper's constants a and b are those of ``solvers.pin.section.flexibility``.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.optimum.station_minimum import lightest, lightest_below
from solvers.pin.section.flexibility import curvatures, flexibilities, slopes

Array = NDArray[np.float64]
_EPS = float(np.finfo(float).eps)


@kernel
def _place_around(
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
        (df, dg), (d2f, d2g) = slopes(y, kappa, a, b), curvatures(y, kappa, a, b)
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


@kernel
def place(
    lam: float, weight: float, bend: float, shear: float, low: float, start: float, kappa: float, a: float, b: float
) -> float:  # fmt: skip
    """Return argmin over u >= low (for a pin, up to 1) of weight u + lam (bend f + shear g).

    The minimum is global, although the pin's g is concave near 1. At zero weight u is 1, or infinite for a bushing.
    """
    if lam * bend <= 0.0 and lam * shear <= 0.0:
        return low
    if weight <= 0.0:
        return 1.0 if kappa < 0.0 else np.inf
    if kappa < 0.0:
        return lightest(weight / lam, low, bend, shear, start, a, b) if low < 1.0 else 1.0
    return _place_around(lam, weight, bend, shear, low, kappa, a, b)


@kernel
def place_below(
    lam: float, weight: float, bend: float, shear: float, low: float, most: float, start: float,
    kappa: float, a: float, b: float,
) -> float:  # fmt: skip
    """As ``place`` over low <= u <= most."""
    u = place(lam, weight, bend, shear, low, start, kappa, a, b)
    if u <= most:
        return u
    if kappa >= 0.0 or weight <= 0.0:
        return most
    return lightest_below(weight / lam, low, most, bend, shear, a, b)


@kernel
def densities(u: Array, bend: Array, shear: Array, kappa: float, a: float, b: float) -> Array:
    """bend f + shear g at stations (n,): 0 where unloaded, inf where a loaded section has no wall."""
    out = np.zeros_like(u)
    for i in range(u.size):
        if bend[i] == 0.0 and shear[i] == 0.0:
            continue
        out[i] = np.inf
        if u[i] > 0.0:
            f, g = flexibilities(u[i], kappa, a, b)
            out[i] = bend[i] * f + shear[i] * g
    return out
