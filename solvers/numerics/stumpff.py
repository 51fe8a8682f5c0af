"""Stumpff functions: cosine, sine and their remainders as entire functions of one signed argument.

    c_k(t) = sum_{j >= 0} (-t)^j / (2 j + k)!

For t > 0, with x = sqrt(t):   c0 = cos x, c1 = sin x / x, c2 = (1 - cos x)/x^2, c3 = (x - sin x)/x^3;
for t < 0, with y = sqrt(-t):  c0 = cosh y, c1 = sinh y / y, c2 = (cosh y - 1)/y^2, c3 = (sinh y - y)/y^3.

Tension, no load and compression of a beam are three stretches of one argument, so nothing has to be switched
at zero load. Recurrence: c_k = 1/k! - t c_{k+2}. Derivative: 2 t c_k' = c_{k-1} - k c_k.

Source: K. Stumpff, Himmelsmechanik I (1959); E. L. Stiefel, G. Scheifele, Linear and Regular Celestial
Mechanics (1971), section 11.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

SERIES_LIMIT = 4.0
"""|t| below which the remainders c2, c3 come from their series.

At |t| = 4 the closed form of c3 has lost less than two bits; below, it would lose more with every halving.
"""

_TERMS = 15
"""Terms of the series: 4^15 * 2! / 32! < 1e-26, far below one unit in the last place of the sum."""

_C2 = tuple((-1.0) ** j / math.factorial(2 * j + 2) for j in range(_TERMS))
_C3 = tuple((-1.0) ** j / math.factorial(2 * j + 3) for j in range(_TERMS))


@dataclass(frozen=True)
class Stumpff:
    """The four functions at the same arguments, each an array of the argument's shape."""

    c0: NDArray[np.float64]
    c1: NDArray[np.float64]
    c2: NDArray[np.float64]
    c3: NDArray[np.float64]


def stumpff(t: ArrayLike) -> Stumpff:
    """c0 … c3 at the arguments t (any shape, dimensionless), exact to a few units in the last place.

    Relative error at most 8 eps max(1, kappa), with kappa = |t c_k'(t)/c_k(t)| the condition number in t,
    on [-1e4, 30]. The functions overflow to inf below about t = -5e5; use ``stumpff_scaled`` there.
    """
    t = np.asarray(t, dtype=float)
    x = np.sqrt(np.abs(t))
    series = np.abs(t) <= SERIES_LIMIT
    small = np.where(series, t, 0.0)
    c2 = np.full_like(t, _C2[-1])
    c3 = np.full_like(t, _C3[-1])
    for a2, a3 in zip(_C2[-2::-1], _C3[-2::-1], strict=True):
        c2 = a2 + small * c2
        c3 = a3 + small * c3
    safe = np.where(series, 1.0, x)
    positive = t > 0
    with np.errstate(over="ignore"):
        sine = np.where(positive, np.sin(safe), np.sinh(safe))
        half = np.where(positive, np.sin(0.5 * safe), np.sinh(0.5 * safe))
        cosine = np.where(positive, np.cos(safe), np.cosh(safe))
    return Stumpff(
        c0=np.where(series, 1.0 - small * c2, cosine),
        c1=np.where(series, 1.0 - small * c3, sine / safe),
        c2=np.where(series, c2, 2.0 * (half / safe) ** 2),
        c3=np.where(series, c3, np.where(positive, safe - sine, sine - safe) / safe**3),
    )


def stumpff_scaled(t: ArrayLike) -> Stumpff:
    """exp(-sqrt(-t)) c_k(t) for t < 0, c_k(t) itself for t >= 0: finite for every argument."""
    t = np.asarray(t, dtype=float)
    strong = t < -SERIES_LIMIT
    near = stumpff(np.where(strong, 0.0, t))
    y = np.sqrt(np.where(strong, -t, 1.0))
    decay = np.exp(-y)
    # exp(-y) cosh y = (1 + e^-2y)/2 and so on, with expm1 where a difference would lose digits.
    cosine = 0.5 * (1.0 + decay**2)
    sine = -0.5 * np.expm1(-2.0 * y)
    half = -0.5 * np.expm1(-y)  # exp(-y/2) sinh(y/2)
    weak_scale = np.where(t < 0, np.exp(-np.sqrt(np.where(strong, 0.0, np.abs(t)))), 1.0)
    return Stumpff(
        c0=np.where(strong, cosine, weak_scale * near.c0),
        c1=np.where(strong, sine / y, weak_scale * near.c1),
        c2=np.where(strong, 2.0 * (half / y) ** 2, weak_scale * near.c2),
        c3=np.where(strong, (sine - y * decay) / y / y / y, weak_scale * near.c3),
    )
