"""Flexibility of a tubular section in bending and shear, as functions of its measure of material u.

For a pin u = 1 - (d/D)^2, in units of the solid section. Bending: f = 1/v = 1/(u (2 - u)), convex. Shear: Cowper's
coefficient of a tube, 1/(k A) = g(u)/A0 with

    g(u) = A/u + B (1 - u)/(u (2 - u)^2),   A = (7 + 6 nu)/(6 (1 + nu)),   B = (20 + 12 nu)/(6 (1 + nu)),

decreasing, convex up to about u = 0.9 and concave from there to the solid section. The flexibility of a station,
bend f + shear g, may therefore be concave close to the solid section. Its convex envelope follows it up to the point
whose tangent passes through its value at 1, and that tangent from there on. The envelope is never above it, and equal
to it wherever the minimum of u + lambda (bend f + shear g) can lie. The third derivatives of f and g are negative for
every u.

For a bushing u = (D^2 - d^2)/l^2, l the bore, or any length for a bar without one. Both cases are

    f = 1/(u |u + 2 kappa|),   g = A/u + (B/2) (|kappa| f + kappa/(u + 2 kappa)^2)

with kappa = -1 for the pin, 1 for the bushing and 0 without a bore, f over 64/(E pi l^4) and g over 4/(G pi l^2), for
the pin with l its outer diameter. If kappa is not negative, both are convex.

Source: G. R. Cowper (1966), The shear coefficient in Timoshenko's beam theory, with m^2 = d^2/D^2.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel


class Flexibility(NamedTuple):
    """kappa of f and g, and the constants A and B of g."""

    kappa: float
    a: float
    b: float


@kernel
def flexibilities(u: float, law: Flexibility) -> tuple[float, float]:
    """Return f and g."""
    kappa, a, b = law
    c = 1.0 / abs(u + 2.0 * kappa)
    f = c / u
    return f, a / u + 0.5 * b * (abs(kappa) * f + kappa * c * c)


@kernel
def slopes(u: float, law: Flexibility) -> tuple[float, float]:
    """Return f' and g'."""
    kappa, a, b = law
    r, c = 1.0 / u, 1.0 / (u + 2.0 * kappa)
    df = -r * abs(c) * (r + c)
    return df, -a * r * r + 0.5 * b * abs(kappa) * (df - 2.0 * abs(c * c * c))


@kernel
def curvatures(u: float, law: Flexibility) -> tuple[float, float]:
    """Return f'' and g''; for the pin g'' decreases and is zero at the inflection point."""
    kappa, a, b = law
    r, c = 1.0 / u, 1.0 / (u + 2.0 * kappa)
    d2f = 2.0 * r * abs(c) * (r * r + r * c + c * c)
    return d2f, 2.0 * a * r * r * r + 0.5 * b * (abs(kappa) * d2f + 6.0 * kappa * c * c * c * c)


@kernel
def envelope_line_start(bend: float, shear: float, law: Flexibility) -> float:
    """Return the u from which the convex envelope of a pin's h = bend f + shear g is linear, up to u = 1; 1: nowhere.

    h + h' e = h(1) with e = 1 - u; divided by the common factor e^2 this is
    shear b (1 - 3e) = bend (1 + e)(1 + e^2) + shear a (1 + e)^3, decreasing on the left, increasing on the right.
    """
    _, a, b = law
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
def chord_decrease(u: float, bend: float, shear: float, law: Flexibility) -> float:
    """Return (h(u) - h(1))/(1 - u), -h'(1) at u = 1: rate of decrease of a pin's h along the chord to the solid
    section."""
    e = 1.0 - u
    c = 1.0 + e
    return (bend * e / c + shear * (law.a + law.b / (c * c))) / u


def densities(u: Array, bend: Array, shear: Array, law: Flexibility) -> Array:
    """Return bend f + shear g at stations, (n,): 0 where unloaded, inf where a loaded section has no wall."""
    # Named tuples take longer to hand over than the sum itself.
    return _densities(u, bend, shear, *law)


@kernel
def _densities(u: Array, bend: Array, shear: Array, kappa: float, a: float, b: float) -> Array:
    out, law = np.zeros_like(u), Flexibility(kappa, a, b)
    for i in range(u.size):
        if bend[i] == 0.0 and shear[i] == 0.0:
            continue
        out[i] = np.inf
        if u[i] > 0.0:
            f, g = flexibilities(u[i], law)
            out[i] = bend[i] * f + shear[i] * g
    return out


@cache
def cowper(poisson: float, kappa: float = -1.0) -> Flexibility:
    """Return the law with Cowper's constants for this Poisson's ratio, by default of a pin."""
    k = 6.0 * (1.0 + poisson)
    return Flexibility(kappa, (7.0 + 6.0 * poisson) / k, (20.0 + 12.0 * poisson) / k)


@cache
def inflection(poisson: float) -> float:
    """Return the u above which a pin's g is concave, 0.90 to 0.91."""
    law, low, high = cowper(poisson), 0.5, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if curvatures(middle, law)[1] > 0.0 else (low, middle)
    return low
