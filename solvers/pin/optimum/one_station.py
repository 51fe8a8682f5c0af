"""A single station of a pin or a bushing: bending and shear flexibilities f and g, and the u that minimises its
term.

``kappa`` is -1 for the pin's bore inside a given outer diameter (``solvers.pin.section.flexibility``), 0 or 1 for an
outer diameter around a given bore (``solvers.pin.section.tube``); a and b are Cowper's constants.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.optimum.station_minimum import lightest, lightest_below
from solvers.pin.section.flexibility import bending, phi, phi_curvature, phi_slope
from solvers.pin.section.tube import bending as tube_bending
from solvers.pin.section.tube import place_around, shearing

Array = NDArray[np.float64]


@kernel
def flexibilities(u: float, kappa: float, a: float, b: float) -> tuple[float, float]:
    """f and g."""
    if kappa < 0.0:
        return bending(u)[0], phi(u, a, b)
    return tube_bending(u, kappa)[0], shearing(u, kappa, a, b)[0]


@kernel
def slopes(u: float, kappa: float, a: float, b: float) -> tuple[float, float]:
    """f' and g'."""
    if kappa < 0.0:
        return bending(u)[1], phi_slope(u, a, b)
    return tube_bending(u, kappa)[1], shearing(u, kappa, a, b)[1]


@kernel
def curvatures(u: float, kappa: float, a: float, b: float) -> tuple[float, float]:
    """f'' and g''."""
    if kappa < 0.0:
        return bending(u)[2], phi_curvature(u, a, b)
    return tube_bending(u, kappa)[2], shearing(u, kappa, a, b)[2]


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
    return place_around(lam, weight, bend, shear, low, kappa, a, b)


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
