"""Every station's lightest wall at a price of the deflection, for many stations at once, where the law is convex.

At price lambda a station's u is where lambda g' = -1, g = bend/v + shear phi. With the partial fractions of g' that is

    A/u^2 = k + E(u),   E = C/c^2 - D/c^3,   c = 2 - u,   k = 1/lambda,
    A = bend/2 + shear (a + b/4),   C = bend/2 + shear b/4,   D = shear b,

and beyond the knee of phi the same with shear's slope, a constant there, moved to k. Q(u) = u sqrt(k + E) - sqrt(A)
rises and is nearly straight from thin walls to the solid section, so that Newton's method settles in a few steps from
anywhere. It knows no branches, and the processor takes several stations at a time; a block ends when all of its
stations have settled.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.flexibility import bending, phi_slope

Array = NDArray[np.float64]
_BLOCK = 256
_MOST_STEPS = 60
_CLOSE = 1e-9
"""After a step as short as this one, relative, what is left is below rounding."""
_STEPS = 12
"""Where phi's curvature vanishes at the knee, a station that hardly bends settles slowly: the rest is left to the next
round, whose start is better. What a station's u lacks makes an answer heavier, never too soft: its deflection is taken
where it stands."""


@kernel
def _guess(k: float, low: Array, bend: Array, shear: Array, a: float, b: float, u: Array) -> None:
    """A first u: E between its values at the two ends."""
    for i in range(u.size):
        x = math.sqrt((0.5 * bend[i] + shear[i] * (a + 0.25 * b)) / (k + 0.25 * bend[i]))
        x = x if x < 1.0 else 1.0
        u[i] = x if x > low[i] else low[i]


@kernel
def _better(
    k: float, low: float, bend: float, shear: float, a: float, b: float, knee: float,
    knee_bend: float, knee_shear: float, x: float,
) -> float:  # fmt: skip
    """One step of Newton's method on Q from x, kept in [low, 1] and on its side of the knee, where -1/v and -phi have
    the slopes ``knee_bend`` and ``knee_shear``."""
    half = 0.5 * bend
    beyond = k < bend * knee_bend + shear * knee_shear
    first = half if beyond else half + shear * (a + 0.25 * b)
    second = half if beyond else half + 0.25 * shear * b
    third = 0.0 if beyond else shear * b
    level = k - shear * knee_shear if beyond else k
    least, most = low, knee
    if beyond:
        least, most = least if least > knee else knee, 1.0
    inverse = 1.0 / (2.0 - x)
    whole = level + inverse * inverse * (second - third * inverse)
    slope = whole + 0.5 * x * inverse * inverse * inverse * (2.0 * second - 3.0 * third * inverse)
    slope = slope if slope > 0.05 * whole else 0.05 * whole
    new = x - (x * whole - math.sqrt(first * whole)) / slope
    # Where k + E is not positive, more wall always pays.
    new = new if whole > 0.0 else most
    new = new if new < most else most
    return new if new > least else least


@kernel
def lightest(k: float, low: float, bend: float, shear: float, start: float, a: float, b: float, knee: float) -> float:
    """One station's lightest u in [low, 1], to rounding; a start outside of it is none."""
    knee_bend, knee_shear = -bending(knee)[1], -phi_slope(knee, a, b, knee)
    u = start
    if not low < u < 1.0:
        u = max(min(math.sqrt((0.5 * bend + shear * (a + 0.25 * b)) / (k + 0.25 * bend)), 1.0), low)
    for _ in range(_MOST_STEPS):
        new = _better(k, low, bend, shear, a, b, knee, knee_bend, knee_shear, u)
        if abs(new - u) <= _CLOSE * u:
            return new
        u = new
    return u


@kernel
def _approach(
    k: float, low: Array, bend: Array, shear: Array, a: float, b: float, knee: float, u: Array, tolerance: float
) -> int:
    """One step for every station; how many moved by more than ``tolerance``, relative."""
    unsettled = 0
    knee_bend, knee_shear = -bending(knee)[1], -phi_slope(knee, a, b, knee)
    for i in range(u.size):
        x = u[i]
        new = _better(k, low[i], bend[i], shear[i], a, b, knee, knee_bend, knee_shear, x)
        u[i] = new
        unsettled += 1 if abs(new - x) > tolerance * x else 0
    return unsettled


@kernel
def _respond(
    lam: float, share: Array, low: Array, bend: Array, shear: Array, a: float, b: float, knee: float,
    u: Array, deflection: Array, change: Array,
) -> None:  # fmt: skip
    """Every station's deflection and its derivative by lambda."""
    knee_shear = -phi_slope(knee, a, b, knee)
    knee_inverse, knee_other = 1.0 / knee, 1.0 / (2.0 - knee)
    pole = a + 0.25 * b
    for i in range(u.size):
        x = u[i]
        beyond = x > knee
        one, other = 1.0 / x, 1.0 / (2.0 - x)
        at = knee if beyond else x
        p, q = knee_inverse if beyond else one, knee_other if beyond else other
        phi = p * (a + b * (1.0 - at) * q * q)
        phi = phi - knee_shear * (x - knee) if beyond else phi
        fall = 0.5 * bend[i] * (one * one - other * other) + shear[i] * (p * p * pole - q * q * b * (0.25 - q))
        curve = 0.0 if beyond else 2.0 * pole * p * p * p + q * q * q * b * (0.5 - 3.0 * q)
        curve = shear[i] * curve + bend[i] * (one * one * one + other * other * other)
        deflection[i] = share[i] * (bend[i] * one * other + shear[i] * phi)
        moves = low[i] < x and x < 1.0 and x != knee and curve > 0.0
        change[i] = share[i] * fall * fall / (lam * curve) if moves else 0.0


@kernel
def all_lightest(
    lam: float, share: Array, low: Array, bend: Array, shear: Array, a: float, b: float, knee: float,
    u: Array, cold: bool, tolerance: float,
) -> tuple[float, float]:  # fmt: skip
    """Every station's lightest u in [low, 1] at price ``lam``, into ``u``, from where it stands unless ``cold``; the
    deflection sum s g and its derivative by lambda.

    All arrays (n,); bend or shear must be positive at every station, the law convex. The last step of a station was
    below ``tolerance`` relative, its error therefore about the square of that.
    """
    deflections, changes = np.empty(_BLOCK), np.empty(_BLOCK)
    total, change = 0.0, 0.0
    for begin in range(0, u.size, _BLOCK):
        end = min(begin + _BLOCK, u.size)
        own_low, own_bend, own_shear, own = low[begin:end], bend[begin:end], shear[begin:end], u[begin:end]
        if cold:
            _guess(1.0 / lam, own_low, own_bend, own_shear, a, b, own)
        for _ in range(_STEPS):
            if _approach(1.0 / lam, own_low, own_bend, own_shear, a, b, knee, own, tolerance) == 0:
                break
        _respond(lam, share[begin:end], own_low, own_bend, own_shear, a, b, knee, own, deflections, changes)
        for i in range(end - begin):
            total += deflections[i]
            change -= changes[i]
    return total, change
