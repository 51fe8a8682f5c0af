"""Global minimum of one station's term of the Lagrangian over u, for pins and bushings.

At multiplier lambda a station costs u + lambda h, h = bend f + shear g, with f and g, kappa and Cowper's constants a
and b of ``solvers.pin.section.flexibility``. A bushing's cost is convex. Where a pin's h is concave near the solid
section its convex envelope has the same minimum: the minimiser is solid if 1/lambda is less than the slope of the
envelope's linear part, and otherwise lies below the start of that part, where h is convex and lambda h' = -1. With
the partial fractions of h' that is

    A/u^2 = k + E(u),   E = C/c^2 - D/c^3,   c = 2 - u,   k = 1/lambda,
    A = bend/2 + shear (a + b/4),   C = bend/2 + shear b/4,   D = shear b.

Q(u) = u sqrt(k + E) - sqrt(A) is increasing and nearly linear from thin walls to the solid section, so Newton's
method converges in a few steps from any start.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.numerics.jit import kernel
from solvers.pin.section.flexibility import (
    Flexibility,
    chord_decrease,
    curvatures,
    envelope_line_start,
    slopes,
)

_EPS = float(np.finfo(float).eps)
_MAX_STEPS = 60
"""Maximum number of Newton steps: convergence is slow where the curvature of h nearly vanishes at the solid section."""
STEP_TOLERANCE = 1e-9
"""Relative step after which the remaining error is below rounding."""


@kernel
def solid_threshold(low: float, bend: float, shear: float, law: Flexibility) -> tuple[float, float]:
    """Return the greatest minimiser u below the solid section, and the k = 1/lambda below which the solid section is
    optimal."""
    top = max(envelope_line_start(bend, shear, law), low)
    return top, chord_decrease(top, bend, shear, law)


@kernel
def stationary(
    k: float, low: float, top: float, bend: float, shear: float, start: float, law: Flexibility, tolerance: float
) -> float:  # fmt: skip
    """Return the minimiser u in [low, top], where h is convex; a start outside (low, top) is ignored.

    The last relative step was below ``tolerance``, so its error is about the square of that.
    """
    half, (_, a, b) = 0.5 * bend, law
    second, third, first = half + 0.25 * shear * b, shear * b, half + shear * (a + 0.25 * b)
    u = start
    if not low < u < top:
        # E between its end values.
        u = max(min(math.sqrt(first / (k + 0.5 * half)), top), low)
    for _ in range(_MAX_STEPS):
        inverse = 1.0 / (2.0 - u)
        whole = k + inverse * inverse * (second - third * inverse)
        # If k + E is not positive, the cost decreases with u.
        new = top
        if whole > 0.0:
            slope = whole + 0.5 * u * inverse * inverse * inverse * (2.0 * second - 3.0 * third * inverse)
            new = u - (u * whole - math.sqrt(first * whole)) / max(slope, 0.05 * whole)
            new = max(min(new, top), low)
        moved, u = abs(new - u), new
        if moved <= tolerance * u:
            break
    return u


@kernel
def _bushing_minimiser(lam: float, w: float, bend: float, shear: float, low: float, law: Flexibility) -> float:
    """argmin over y >= low of w y + lam (bend f + shear g), w > 0, kappa >= 0: Newton's method in ln y, bracketed."""
    (kappa, a, b), p, q = law, lam * bend / w, lam * shear / w
    if p == 0.0 and q == 0.0:
        return low
    thin = math.sqrt(0.5 * kappa * p + q * (a + 0.25 * b * kappa))
    y = thin if kappa > 0.0 else (2.0 * p) ** (1.0 / 3.0) + thin
    least, most = 0.0, np.inf
    for _ in range(200):
        (df, dg), (d2f, d2g) = slopes(y, law), curvatures(y, law)
        steepness = -(p * df + q * dg)
        if steepness > 1.0:
            least = y
        else:
            most = y
        new = y * math.exp(math.log(steepness) * steepness / (y * (p * d2f + q * d2g)))
        if not least < new < most:
            if abs(new - y) <= 4.0 * _EPS * y:
                break
            new = 2.0 * y if most == np.inf else (math.sqrt(least) * math.sqrt(most) if least > 0.0 else 0.5 * y)
        if abs(new - y) <= 2.0 * _EPS * y:
            break
        y = new
    return max(y, low)


@kernel
def minimiser(
    lam: float, weight: float, bend: float, shear: float, low: float, start: float, law: Flexibility
) -> float:
    """Return argmin over u >= low (for a pin, up to 1) of weight u + lam (bend f + shear g), to rounding.

    A start outside the range of the minimum is ignored. At zero weight u is 1, or infinite for a bushing.
    """
    if lam * bend <= 0.0 and lam * shear <= 0.0:
        return low
    if weight <= 0.0:
        return 1.0 if law.kappa < 0.0 else np.inf
    if law.kappa >= 0.0:
        return _bushing_minimiser(lam, weight, bend, shear, low, law)
    top, solid_below = solid_threshold(low, bend, shear, law)
    if low >= 1.0 or weight / lam < solid_below:
        return 1.0
    return stationary(weight / lam, low, top, bend, shear, start, law, STEP_TOLERANCE)
