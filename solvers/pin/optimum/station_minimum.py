"""Global minimisation of each station's Lagrangian term over u, for many stations at once.

At multiplier lambda a station costs u + lambda g, g = bend/v + shear phi. Where g is concave near the solid section
its convex envelope (``solvers.pin.section.flexibility``) has the same minimum: the minimiser is solid if 1/lambda is
less than the slope of the envelope's linear part, and otherwise lies below the start of that part, where g is convex
and lambda g' = -1. With the partial fractions of g' that is

    A/u^2 = k + E(u),   E = C/c^2 - D/c^3,   c = 2 - u,   k = 1/lambda,
    A = bend/2 + shear (a + b/4),   C = bend/2 + shear b/4,   D = shear b.

Q(u) = u sqrt(k + E) - sqrt(A) is increasing and nearly linear from thin walls to the solid section, so Newton's
method converges in a few steps from any start. The loop is branch-free and therefore vectorised; a block ends when
all of its stations have converged.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.section.flexibility import chord, flexibilities, line_from

Array = NDArray[np.float64]
_BLOCK = 256
_MAX_STEPS = 60
_STEP_TOLERANCE = 1e-9
"""Relative step after which the remaining error is below rounding."""
_MAX_STEPS_PER_ROUND = 12
"""Maximum steps per round. Convergence is slow where the curvature of g nearly vanishes at the solid section; the next
round starts closer. An unconverged u makes the part heavier but never too soft, because its deflection is evaluated at
that u."""


@kernel
def reach(low: float, bend: float, shear: float, a: float, b: float) -> tuple[float, float]:
    """Return the greatest non-solid minimiser u, and the k = 1/lambda below which the solid section is optimal."""
    top = max(line_from(bend, shear, a, b), low)
    return top, chord(top, bend, shear, a, b)


@kernel
def _initial_guess(k: float, low: Array, top: Array, bend: Array, shear: Array, a: float, b: float, u: Array) -> None:
    """Initial guess for u: E between its end values."""
    for i in range(u.size):
        x = math.sqrt((0.5 * bend[i] + shear[i] * (a + 0.25 * b)) / (k + 0.25 * bend[i]))
        x = x if x < top[i] else top[i]
        u[i] = x if x > low[i] else low[i]


@kernel
def _newton_step(
    k: float, low: float, top: float, solid_below: float, bend: float, shear: float, a: float, b: float, x: float
) -> float:  # fmt: skip
    """One Newton step on Q from x, clipped to [low, top]; 1 if the solid section is optimal."""
    half = 0.5 * bend
    inverse = 1.0 / (2.0 - x)
    second, third = half + 0.25 * shear * b, shear * b
    whole = k + inverse * inverse * (second - third * inverse)
    slope = whole + 0.5 * x * inverse * inverse * inverse * (2.0 * second - 3.0 * third * inverse)
    slope = slope if slope > 0.05 * whole else 0.05 * whole
    new = x - (x * whole - math.sqrt((half + shear * (a + 0.25 * b)) * whole)) / slope
    # If k + E is not positive, the cost decreases with u.
    new = new if whole > 0.0 else top
    new = new if new < top else top
    new = new if new > low else low
    return 1.0 if k < solid_below else new


@kernel
def lightest(
    k: float, low: float, bend: float, shear: float, start: float, a: float, b: float
) -> float:  # fmt: skip
    """Return one station's minimiser u in [low, 1], to rounding; a start outside (low, top) is ignored."""
    top, solid_below = reach(low, bend, shear, a, b)
    if k < solid_below:
        return 1.0
    u = start
    if not low < u < top:
        u = max(min(math.sqrt((0.5 * bend + shear * (a + 0.25 * b)) / (k + 0.25 * bend)), top), low)
    for _ in range(_MAX_STEPS):
        new = _newton_step(k, low, top, solid_below, bend, shear, a, b, u)
        if abs(new - u) <= _STEP_TOLERANCE * u:
            return new
        u = new
    return u


@kernel
def lightest_below(
    k: float, low: float, most: float, bend: float, shear: float, a: float, b: float
) -> float:  # fmt: skip
    """Return one station's minimiser u in [low, most] if that in [low, 1] lies above ``most``: the stationary point
    in the convex part, or ``most``."""
    u = max(min(math.sqrt((0.5 * bend + shear * (a + 0.25 * b)) / (k + 0.25 * bend)), most), low)
    for _ in range(_MAX_STEPS):
        new = _newton_step(k, low, most, 0.0, bend, shear, a, b, u)
        moved, u = abs(new - u), new
        if moved <= _STEP_TOLERANCE * u:
            break
    (f, g), (f_most, g_most) = flexibilities(u, -1.0, a, b), flexibilities(most, -1.0, a, b)
    return u if k * (u - most) + bend * (f - f_most) + shear * (g - g_most) < 0.0 else most


@kernel
def reaches(low: Array, bend: Array, shear: Array, a: float, b: float, top: Array, solid_below: Array) -> None:
    """Write ``reach`` of every station into ``top`` and ``solid_below``."""
    for i in range(low.size):
        top[i], solid_below[i] = reach(low[i], bend[i], shear[i], a, b)


@kernel
def _newton_steps(
    k: float, low: Array, top: Array, solid_below: Array, bend: Array, shear: Array, a: float, b: float, u: Array,
    tolerance: float,
) -> int:  # fmt: skip
    """One step for every station; returns how many moved by more than ``tolerance``, relative."""
    unsettled = 0
    for i in range(u.size):
        x = u[i]
        new = _newton_step(k, low[i], top[i], solid_below[i], bend[i], shear[i], a, b, x)
        u[i] = new
        unsettled += 1 if abs(new - x) > tolerance * x else 0
    return unsettled


@kernel
def _deflections_and_slopes(
    lam: float, share: Array, low: Array, top: Array, bend: Array, shear: Array, a: float, b: float,
    u: Array, deflection: Array, change: Array,
) -> None:  # fmt: skip
    """Every station's deflection and its derivative with respect to lambda."""
    pole = a + 0.25 * b
    for i in range(u.size):
        x = u[i]
        one, other = 1.0 / x, 1.0 / (2.0 - x)
        phi = one * (a + b * (1.0 - x) * other * other)
        fall = 0.5 * bend[i] * (one * one - other * other)
        fall += shear[i] * (one * one * pole - other * other * b * (0.25 - other))
        curve = 2.0 * pole * one * one * one + other * other * other * b * (0.5 - 3.0 * other)
        curve = shear[i] * curve + bend[i] * (one * one * one + other * other * other)
        deflection[i] = share[i] * (bend[i] * one * other + shear[i] * phi)
        moves = low[i] < x and x < top[i] and curve > 0.0
        change[i] = share[i] * fall * fall / (lam * curve) if moves else 0.0


@kernel
def all_lightest(
    lam: float, share: Array, low: Array, top: Array, solid_below: Array, bend: Array, shear: Array,
    a: float, b: float, u: Array, cold: bool, tolerance: float,
) -> tuple[float, float]:  # fmt: skip
    """Minimise every station over u in [low, 1] at multiplier ``lam``, in place, warm-started unless ``cold``.

    Returns the deflection sum s g and its derivative with respect to lambda, excluding stations that become solid.
    All arrays (n,); ``top`` and ``solid_below`` from ``reaches``; bend or shear must be positive at every station.
    The last relative step of a station was below ``tolerance``, so its error is about the square of that.
    """
    deflections, changes = np.empty(_BLOCK), np.empty(_BLOCK)
    total, change, k = 0.0, 0.0, 1.0 / lam
    for begin in range(0, u.size, _BLOCK):
        end = min(begin + _BLOCK, u.size)
        own_low, own_top, own_solid = low[begin:end], top[begin:end], solid_below[begin:end]
        own_bend, own_shear, own = bend[begin:end], shear[begin:end], u[begin:end]
        if cold:
            _initial_guess(k, own_low, own_top, own_bend, own_shear, a, b, own)
        for _ in range(_MAX_STEPS_PER_ROUND):
            if _newton_steps(k, own_low, own_top, own_solid, own_bend, own_shear, a, b, own, tolerance) == 0:
                break
        _deflections_and_slopes(
            lam, share[begin:end], own_low, own_top, own_bend, own_shear, a, b, own, deflections, changes
        )
        for i in range(end - begin):
            total += deflections[i]
            change -= changes[i]
    return total, change
