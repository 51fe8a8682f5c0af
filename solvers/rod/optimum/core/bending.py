"""A strip's bending under one axial force, per unit of the pin's stroke, in spherical Bessel functions.

With q = 12 P tau/E, tau = 1/(b h^3), t = -q l^2 and

    g0 = c1 = j0(x),  g1 = c2 - c3 = j1(x)/x,  g2 = j2(x)/x^2,   x = sqrt(t),   dg_n/dt = -g_{n+1}/2,

the beam-column of ``solvers.rod.strip.beam_column`` is, with e = L - l and at y = eta l from the head,

    V'' = N/det,  N = e c0 + y g0,  c0 = g0 - T g1 = cos x (all at T = eta^2 t),  det = l^3 g1 + e L l g0.

Valid up to the first buckling root of the clamped-pinned column, x = 4.493.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel

Array = NDArray[np.float64]

_SERIES = 1.0
_TERMS = 12
_G = np.zeros((3, _TERMS))
for _n in range(3):
    for _j in range(_TERMS):
        # j_n(x)/x^n = sum (-x^2/2)^j / (j! (2n+2j+1)!!)
        _odd = math.prod(range(1, 2 * _n + 2 * _j + 2, 2))
        _G[_n, _j] = (-0.5) ** _j / (math.factorial(_j) * _odd)

STRONG = -400.0
"""t below which decaying exponentials take the place of the closed forms."""


@kernel
def bessel(t: float) -> tuple[float, float, float]:
    """g0, g1, g2 at t, for t from STRONG to 20.2."""
    if abs(t) <= _SERIES:
        g0, g1, g2 = _G[0, _TERMS - 1], _G[1, _TERMS - 1], _G[2, _TERMS - 1]
        for j in range(_TERMS - 2, -1, -1):
            g0, g1, g2 = _G[0, j] + t * g0, _G[1, j] + t * g1, _G[2, j] + t * g2
        return g0, g1, g2
    if t > 0:
        x = math.sqrt(t)
        g0, c0 = math.sin(x) / x, math.cos(x)
    else:
        x = math.sqrt(-t)
        grown = math.exp(x)
        g0, c0 = 0.5 * (grown - 1.0 / grown) / x, 0.5 * (grown + 1.0 / grown)
    g1 = (g0 - c0) / t
    return g0, g1, (3.0 * g1 - g0) / t


@kernel
def curvature(q: float, l: float, rod_length: float, eta: Array, out: Array) -> None:
    """V'' per unit stroke at y = eta l from the head, to ``out``."""
    e, t = rod_length - l, -q * l * l
    if t >= STRONG:
        at_clamp = bessel(t)
        det = l * l * l * at_clamp[1] + e * rod_length * l * at_clamp[0]
        for j in range(eta.size):
            T = eta[j] * eta[j] * t
            n0, n1, _ = at_clamp if eta[j] == 1.0 else bessel(T)
            out[j] = (e * (n0 - T * n1) + eta[j] * l * n0) / det
        return
    # cosh x and sinh x are equal to the last place and cancel: V'' = (e x + y ...)/det in decaying exponentials.
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
    """C = V''(0) per unit stroke, and det (scaled in strong tension).

    The side force per unit stroke is k = (EI C + P)/L, because C + L D + q = 0 for the beam's two constants.
    """
    e, t = rod_length - l, -q * l * l
    if t >= STRONG:
        g0, g1, _ = bessel(t)
        det = l * l * l * g1 + e * rod_length * l * g0
        return (e * (g0 - t * g1) + l * g0) / det, det
    x = math.sqrt(-t)
    det = l * (e * rod_length / x + l * l * (x - 1.0) / (x * x * x))
    return (e + l / x) / det, det
