"""Bounds of a strip's bending over a box of designs: the basis of the proof of global optimality.

In ln tau and ln l, with tau = 1/(b h^3), q = 12 P tau/E, t = -q l^2 and the spherical Bessel functions

    g0 = c1 = j0(x),  g1 = c2 - c3 = j1(x)/x,  g2 = j2(x)/x^2,   x = sqrt(t),   dg_n/dt = -g_{n+1}/2,

the beam-column of ``solvers.rod.strip.beam_column`` is, per unit stroke and with y = eta l measured from the head,

    V'' = N/det,  N = e (g0 - T g1) + y g0 (at T = eta^2 t),  det = l^3 g1 + e L l g0,
    side stiffness k = (E/12 tau) Q/det,  Q = g0 - t g1 - (e/l) t g0.

g0, g1, g2 decrease with t up to the first buckling root of the clamped-pinned column (x = 4.493), so their ranges over
an interval of t are given by its ends. Ranges of V'' and k over a box follow from the value at its centre and the
ranges of the derivatives, with an error quadratic in the box's size, and at the clamp also from the corners: C = V''(0)
decreases with l, and with tau increases in tension and decreases in compression, since C is increasing in q; k
decreases with tau and with l (energy: k is a minimum over shapes whose class grows with l and whose energy grows with
EI). Every range is widened by about 1e-12 of its magnitude against rounding.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.rod.strip.buckling import FIRST_ROOT_LIMITS

Array = NDArray[np.float64]

_SERIES = 1.0
_TERMS = 12
_G = np.zeros((3, _TERMS))
for _n in range(3):
    for _j in range(_TERMS):
        # j_n(x)/x^n = sum (-x^2/2)^j / (j! (2n+2j+1)!!)
        _odd = math.prod(range(1, 2 * _n + 2 * _j + 2, 2))
        _G[_n, _j] = (-0.5) ** _j / (math.factorial(_j) * _odd)

FIRST_ROOT_SQUARED = FIRST_ROOT_LIMITS[1] ** 2

STRONG = -400.0
"""t below which ranges come from corners and signs alone: those of the closed forms would be too wide."""

_ROUNDING = 1e-12

UNKNOWN = 1e200
"""Represents infinity where a product with zero must be zero."""


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
def product(a: float, b: float, c: float, d: float) -> tuple[float, float]:
    """[a, b] [c, d]."""
    p, q, r, s = a * c, a * d, b * c, b * d
    return min(min(p, q), min(r, s)), max(max(p, q), max(r, s))


@kernel
def curvature_and_stiffness(q: float, l: float, rod_length: float, eta: Array, out: Array) -> tuple[float, float]:
    """V'' at y = eta l from the head to ``out``; returns k/EI and det (scaled in strong tension), per unit stroke."""
    e, t = rod_length - l, -q * l * l
    if t >= STRONG:
        g0, g1, _ = bessel(t)
        det = l * l * l * g1 + e * rod_length * l * g0
        for j in range(eta.size):
            y = eta[j] * l
            T = eta[j] * eta[j] * t
            n0, n1, _ = bessel(T)
            out[j] = (e * (n0 - T * n1) + y * n0) / det
        return (g0 - t * g1 - e / l * t * g0) / det, det
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
    return (1.0 + e / l * x) / det, det


@kernel
def clamp(q: float, l: float, rod_length: float) -> tuple[float, float, float]:
    """C = V''(0) and k/EI per unit stroke, and det (scaled in strong tension)."""
    e, t = rod_length - l, -q * l * l
    if t >= STRONG:
        g0, g1, _ = bessel(t)
        det = l * l * l * g1 + e * rod_length * l * g0
        return (e * (g0 - t * g1) + l * g0) / det, (g0 - t * g1 - e / l * t * g0) / det, det
    x = math.sqrt(-t)
    det = l * (e * rod_length / x + l * l * (x - 1.0) / (x * x * x))
    return (e + l / x) / det, (1.0 + e / l * x) / det, det


@kernel
def bending_ranges(
    force: float,
    modulus: float,
    rod_length: float,
    tau: Array,
    l: Array,
    eta: Array,
    centre: Array,
    slope: Array,
    low: Array,
    high: Array,
) -> tuple[bool, float, float, float]:
    """Ranges of V'' per unit stroke over a box, for one axial force [N], at every station.

    ``tau`` and ``l`` hold lower end, centre, upper end. Fills per station the value at the ``centre``, the ranges of
    the derivatives by ln tau and ln l, ``slope`` of shape (stations, 4), and the range ``low`` … ``high`` of V''.
    Returns whether the derivatives are bounded (else ``slope`` is invalid), and k/EI at the centre and at the corners
    of its minimum and maximum [1/m^3], without EI's own variation: k_low, k_high are Q/det alone.
    """
    scale = 12.0 * force / modulus
    middle, _ = curvature_and_stiffness(scale * tau[1], l[1], rod_length, eta, centre)
    corner_low, least, det_least = clamp(scale * tau[2], l[2], rod_length)
    corner_high, stout, _ = clamp(scale * tau[0], l[0], rod_length)
    # Beyond x = 4.493 the determinant may be positive again, between higher roots.
    standing = det_least > 0.0 and -scale * tau[2] * l[2] * l[2] < FIRST_ROOT_SQUARED
    if not standing:
        least = -UNKNOWN
    # Corners at the clamp: C decreases with l; with tau it increases in tension and decreases in compression.
    clamp_low, clamp_high = corner_low if standing else -UNKNOWN, corner_high
    if force > 0.0:
        clamp_low, _, _ = clamp(scale * tau[0], l[2], rod_length)
        clamp_high, _, _ = clamp(scale * tau[2], l[0], rod_length)
    t1, t2 = -scale * tau[0] * l[0] * l[0], -scale * tau[2] * l[2] * l[2]
    if t1 > t2:
        t1, t2 = t2, t1
    if t1 < STRONG or not standing:
        for j in range(eta.size):
            # In tension V'' has one sign and decays from the clamp; otherwise nothing is known.
            low[j] = 0.0 if force > 0.0 else -UNKNOWN
            high[j] = clamp_high if force > 0.0 else UNKNOWN
        low[0], high[0] = clamp_low, clamp_high
        _widen(low, high)
        return False, middle, least, stout
    rx, ry = 0.5 * math.log(tau[2] / tau[0]), 0.5 * math.log(l[2] / l[0])
    L, e1, e2 = rod_length, rod_length - l[2], rod_length - l[0]
    a0, a1, a2 = bessel(t2)
    b0, b1, b2 = bessel(t1)
    cube1, cube2 = l[0] * l[0] * l[0], l[2] * l[2] * l[2]
    reach1, reach2 = e1 * L * l[0], e2 * L * l[2]
    n1, n2 = product(reach1, reach2, a0, b0)
    det1, det2 = cube1 * a1 + n1, cube2 * b1 + n2
    inverse1, inverse2 = 1.0 / det2, 1.0 / det1
    bounded = det1 > 0.0
    if bounded:
        # d det: by ln tau -(t/2)(l^3 g2 + e L l g1), by ln l twice that + 3 l^3 g1 + L l (e - l) g0
        fall1, fall2 = product(t1, t2, cube1 * a2 + reach1 * a1, cube2 * b2 + reach2 * b1)
        own1, own2 = product(
            L * l[0] * (e1 - l[2]) if e1 > l[2] else L * l[2] * (e1 - l[2]),
            L * l[2] * (e2 - l[0]) if e2 > l[0] else L * l[0] * (e2 - l[0]),
            a0,
            b0,
        )
        det_x1, det_x2 = -0.5 * fall2, -0.5 * fall1
        det_y1, det_y2 = -fall2 + 3.0 * cube1 * a1 + own1, -fall1 + 3.0 * cube2 * b1 + own2
        for j in range(eta.size):
            s = eta[j]
            T1, T2 = s * s * t1, s * s * t2
            if s == 1.0:
                p0, p1, m0, m1 = a0, a1, b0, b1
            else:
                p0, p1, _ = bessel(T2)
                m0, m1, _ = bessel(T1)
            y1, y2 = s * l[0], s * l[2]
            z1, z2 = (1.0 - s) * l[0], (1.0 - s) * l[2]
            tg1, tg2 = product(T1, T2, p1, m1)
            c1, c2 = p0 - tg2, m0 - tg1
            u1, u2 = product(e1, e2, c1, c2)
            w1, w2 = product(y1, y2, p0, m0)
            v1, v2 = product(u1 + w1, u2 + w2, inverse1, inverse2)
            # d N: by ln tau -(T/2)(e g0 + y g1), by ln l -(l - y) g0 - T e g0 + T (l - y) g1
            eg1, eg2 = product(e1, e2, p0, m0)
            yg1, yg2 = product(y1, y2, p1, m1)
            x1, x2 = product(T1, T2, eg1 + yg1, eg2 + yg2)
            x1, x2 = -0.5 * x2, -0.5 * x1
            zg1, zg2 = product(z1, z2, p0, m0)
            te1, te2 = product(T1, T2, eg1, eg2)
            tz1, tz2 = product(z1, z2, tg1, tg2)
            d1, d2 = -zg2 - te2 + tz1, -zg1 - te1 + tz2
            f1, f2 = product(v1, v2, det_x1, det_x2)
            slope[j, 0], slope[j, 1] = product(x1 - f2, x2 - f1, inverse1, inverse2)
            f1, f2 = product(v1, v2, det_y1, det_y2)
            slope[j, 2], slope[j, 3] = product(d1 - f2, d2 - f1, inverse1, inverse2)
            reach = max(abs(slope[j, 0]), abs(slope[j, 1])) * rx + max(abs(slope[j, 2]), abs(slope[j, 3])) * ry
            low[j], high[j] = max(v1, centre[j] - reach), min(v2, centre[j] + reach)
    else:
        for j in range(eta.size):
            low[j], high[j] = -UNKNOWN, UNKNOWN
    low[0], high[0] = max(low[0], clamp_low), min(high[0], clamp_high)
    _widen(low, high)
    return bounded, middle, least, stout


@kernel
def _widen(low: Array, high: Array) -> None:
    for j in range(low.size):
        margin = _ROUNDING * max(abs(low[j]), abs(high[j]))
        low[j], high[j] = low[j] - margin, high[j] + margin
