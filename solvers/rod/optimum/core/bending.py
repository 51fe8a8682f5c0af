"""Bending of a strip under one axial force, per unit stroke of the pin, in terms of spherical Bessel functions.

With q = 12 P tau/E, tau = 1/(b h^3), t = -q l^2 and

    g0 = c1 = j0(x),  g1 = c2 - c3 = j1(x)/x,  g2 = j2(x)/x^2,   x = sqrt(t),   dg_n/dt = -g_{n+1}/2,

the curvature of the beam-column of ``solvers.rod.strip.beam_column`` is, with e = L - l, at y = eta l from the head,

    V'' = N/det,  N = e c0 + y g0,  c0 = g0 - T g1 = cos x (all at T = eta^2 t),  det = l^3 g1 + e L l g0.

Valid up to the first buckling root of the clamped-pinned column, x = 4.493.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel

Array = NDArray[np.float64]

_SERIES_LIMIT = 1.0
_TERMS = 12
_COEFFICIENTS = np.zeros((3, _TERMS))
for _n in range(3):
    for _j in range(_TERMS):
        # j_n(x)/x^n = sum (-x^2/2)^j / (j! (2n+2j+1)!!)
        _odd = math.prod(range(1, 2 * _n + 2 * _j + 2, 2))
        _COEFFICIENTS[_n, _j] = (-0.5) ** _j / (math.factorial(_j) * _odd)

STRONG_TENSION = -400.0
"""t below which (strong tension) decaying exponentials replace the closed forms."""


@kernel
def bessel(t: float) -> tuple[float, float, float]:
    """g0, g1, g2 at t, for t from STRONG_TENSION to 20.2."""
    if abs(t) <= _SERIES_LIMIT:
        g0, g1, g2 = _COEFFICIENTS[0, _TERMS - 1], _COEFFICIENTS[1, _TERMS - 1], _COEFFICIENTS[2, _TERMS - 1]
        for j in range(_TERMS - 2, -1, -1):
            g0, g1, g2 = _COEFFICIENTS[0, j] + t * g0, _COEFFICIENTS[1, j] + t * g1, _COEFFICIENTS[2, j] + t * g2
        return g0, g1, g2
    if t > 0:
        x = math.sqrt(t)
        g0, c0 = math.sin(x) / x, math.cos(x)
    else:
        x = math.sqrt(-t)
        exponential = math.exp(x)
        g0, c0 = 0.5 * (exponential - 1.0 / exponential) / x, 0.5 * (exponential + 1.0 / exponential)
    g1 = (g0 - c0) / t
    return g0, g1, (3.0 * g1 - g0) / t


@kernel
def curvature(q: float, l: float, rod_length: float, eta: Array, out: Array) -> None:
    """Curvature V'' per unit stroke at y = eta l from the head, written to ``out``."""
    e, t = rod_length - l, -q * l * l
    if t >= STRONG_TENSION:
        at_clamp = bessel(t)
        det = l * l * l * at_clamp[1] + e * rod_length * l * at_clamp[0]
        for j in range(eta.size):
            T = eta[j] * eta[j] * t
            n0, n1, _ = at_clamp if eta[j] == 1.0 else bessel(T)
            out[j] = (e * (n0 - T * n1) + eta[j] * l * n0) / det
        return
    # cosh x and sinh x agree to the last digit and would cancel: V'' in decaying exponentials instead.
    x = math.sqrt(-t)
    det = l * (e * rod_length / x + l * l * (x - 1.0) / (x * x * x))
    for j in range(eta.size):
        s = eta[j]
        out[j] = (
            (e * (1.0 + math.exp(-2.0 * s * x)) + l / x * (1.0 - math.exp(-2.0 * s * x)))
            * math.exp((s - 1.0) * x)
            / det
        )


@kernel
def clamp(q: float, l: float, rod_length: float) -> tuple[float, float]:
    """Curvature at the clamp C = V''(0) per unit stroke, and the determinant (scaled in strong tension).

    The side force per unit stroke is k = (EI C + P)/L, because the beam's two constants satisfy C + L D + q = 0.
    """
    e, t = rod_length - l, -q * l * l
    if t >= STRONG_TENSION:
        g0, g1, _ = bessel(t)
        det = l * l * l * g1 + e * rod_length * l * g0
        return (e * (g0 - t * g1) + l * g0) / det, det
    x = math.sqrt(-t)
    det = l * (e * rod_length / x + l * l * (x - 1.0) / (x * x * x))
    return (e + l / x) / det, det
