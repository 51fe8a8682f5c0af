"""The strip as a beam-column: clamped in the piston, carrying a rigid head that is hinged on the crank pin.

    EI V'''' - P V'' = 0 on [0, l],   q = P/EI (signed, tension positive), e = L - l
    V(0) = V'(0) = 0,   V(l) + e V'(l) = s,   V''(l) + e V'''(l) = 0

with the lateral stroke s = r sin(phi) of the crank pin. With S_k(z) = z^k c_k(-q z^2) and Stumpff's c_k,

    V = C S2 + D S3,  V' = C S1 + D S2,  V'' = C S0 + D S1,  V''' = q C S1 + D S0,
    det = l^3 (c2 - c3) + e L l c1,   C = s (l c1 + e c0)/det,   D = -s (c0 + e q l c1)/det

all c_k at t = -q l^2. The determinant in this form is a sum of positive terms from the strongest tension down to
half-way to buckling, and its first zero is the stability boundary. Because c0^2 + t c1^2 = 1, the curvature at the
head is V''(l) = s e/det; the equilibrium of the whole rod is C + L D + q s = 0.

Everything here is per unit stroke (s = 1): curvatures in 1/m^2. The small-displacement theory is linear in the stroke.
Validity: P above the first buckling load (det > 0), V/l < 0.15.

Source: T. A. Obolenskaya, A. S. Klochko, flexible rod of a crank-slider mechanism (2014), equations (1)-(4); the
constants were rebuilt from the boundary conditions.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel

Array = NDArray[np.float64]

FORWARD_LIMIT = 4.0
"""q l^2 up to which the shape is built up from the clamp.

From the clamp, a decaying solution is the small difference of two growing ones and loses a factor cosh(sqrt(q l^2));
above the limit V'' comes from its values at the two ends, where both parts are positive and decay inward.
"""
_LIMIT = FORWARD_LIMIT

_SERIES_LIMIT = 1.0
_TERMS = 11
_C2 = np.array([(-1.0) ** j / math.factorial(2 * j + 2) for j in range(_TERMS)])
_C3 = np.array([(-1.0) ** j / math.factorial(2 * j + 3) for j in range(_TERMS)])


@kernel
def _remainders(t: float) -> tuple[float, float]:
    """c2, c3 by their series, for |t| <= 1 to the last place."""
    c2, c3 = _C2[_TERMS - 1], _C3[_TERMS - 1]
    for j in range(_TERMS - 2, -1, -1):
        c2 = _C2[j] + t * c2
        c3 = _C3[j] + t * c3
    return c2, c3


@kernel
def beam_constants(q: float, l: float, rod_length: float) -> tuple[float, float, float, float]:
    """C [1/m^2], D [1/m^3], V''(l) [1/m^2] per unit stroke and the determinant [m^3] for one q [1/m^2]; l, L in m.

    The determinant is positive up to buckling. In tension beyond q l^2 = 1 it comes times exp(-sqrt(q) l).
    """
    e = rod_length - l
    t = -q * l * l
    half = 1.0
    if abs(t) <= _SERIES_LIMIT:
        c2, c3 = _remainders(t)
        c1, c0, difference = 1.0 - t * c3, 1.0 - t * c2, c2 - c3
    elif t > 0:
        x = math.sqrt(t)
        c0, sine = math.cos(x), math.sin(x)
        c1, difference = sine / x, (sine - x * c0) / (x * t)
    else:
        y = math.sqrt(-t)
        # Half the decay at a time: all of it may be too small a number to keep its digits.
        half = math.exp(-0.5 * y)
        decay = half * half
        c0, sine = 0.5 * (1.0 + decay * decay), -0.5 * math.expm1(-2.0 * y)
        c1, difference = sine / y, (y * c0 - sine) / (-y * t)
    det = l * l * l * difference + e * rod_length * l * c1
    return (l * c1 + e * c0) / det, -(c0 + e * q * l * c1) / det, e * half / det * half, det


@kernel
def solve(q: Array, l: float, rod_length: float) -> tuple[Array, Array, Array, Array]:
    """``beam_constants`` for every q, shape (n,); the determinant times exp(-sqrt(max(q, 0)) l)."""
    clamp, shear, head, det = np.empty(q.size), np.empty(q.size), np.empty(q.size), np.empty(q.size)
    for i in range(q.size):
        clamp[i], shear[i], head[i], det[i] = beam_constants(q[i], l, rod_length)
        if 0.0 < q[i] * l * l <= _SERIES_LIMIT:
            det[i] *= math.exp(-math.sqrt(q[i]) * l)
    return clamp, shear, head, det


@kernel
def deflection(q: Array, l: float, clamp: Array, shear: Array, head: Array, z: Array) -> Array:
    """V(z) per unit stroke (dimensionless), shape (stations, couplings)."""
    out = np.empty((z.size, q.size))
    for i in range(q.size):
        if q[i] * l * l > _LIMIT:
            # Integrated twice: q V = V'' - C - D z, with V'' from its two ends.
            k = math.sqrt(q[i])
            span = -math.expm1(-2.0 * k * l)
            for j in range(z.size):
                down = math.exp(-k * z[j]) * -math.expm1(-2.0 * k * (l - z[j]))
                up = math.exp(-k * (l - z[j])) * -math.expm1(-2.0 * k * z[j])
                out[j, i] = ((clamp[i] * down + head[i] * up) / span - clamp[i] - shear[i] * z[j]) / q[i]
            continue
        for j in range(z.size):
            t = -q[i] * z[j] * z[j]
            if abs(t) <= _SERIES_LIMIT:
                c2, c3 = _remainders(t)
            elif t > 0.0:
                x = math.sqrt(t)
                half = math.sin(0.5 * x) / x
                c2, c3 = 2.0 * half * half, (x - math.sin(x)) / (x * t)
            else:
                y = math.sqrt(-t)
                half = math.sinh(0.5 * y) / y
                c2, c3 = 2.0 * half * half, (math.sinh(y) - y) / (y * -t)
            out[j, i] = z[j] * z[j] * (clamp[i] * c2 + shear[i] * z[j] * c3)
    return out
