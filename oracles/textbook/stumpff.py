"""Stumpff functions: cosine, sine and their remainders as entire functions of one signed argument.

    c_k(t) = sum_{j >= 0} (-t)^j / (2 j + k)!

For t > 0, with x = sqrt(t):   c0 = cos x, c1 = sin x / x, c2 = (1 - cos x)/x^2, c3 = (x - sin x)/x^3;
for t < 0, with y = sqrt(-t):  c0 = cosh y, c1 = sinh y / y, c2 = (cosh y - 1)/y^2, c3 = (sinh y - y)/y^3.

Tension, no load and compression of a beam are three ranges of one argument, so no case distinction is needed at zero
load. Recurrence: c_k = 1/k! - t c_{k+2}. Derivative: 2 t c_k' = c_{k-1} - k c_k.

Source: K. Stumpff, Himmelsmechanik I (1959); E. L. Stiefel, G. Scheifele, Linear and Regular Celestial
Mechanics (1971), section 11.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solvers.numerics.jit import kernel

SERIES_LIMIT = 4.0
"""|t| below which the remainders c2, c3 come from their series.

At |t| = 4 the closed form of c3 loses less than two bits to cancellation; it loses more as |t| decreases.
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
    return _at(t, _plain)


def stumpff_scaled(t: ArrayLike) -> Stumpff:
    """exp(-sqrt(-t)) c_k(t) for t < 0, c_k(t) itself for t >= 0: finite for every argument."""
    return _at(t, _scaled)


def _at(t: ArrayLike, function: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> Stumpff:
    t = np.asarray(t, dtype=float)
    return Stumpff(*function(t.ravel()).reshape(4, *t.shape))


@kernel
def _series(t: float) -> tuple[float, float, float, float]:
    c2, c3 = _C2[_TERMS - 1], _C3[_TERMS - 1]
    for j in range(_TERMS - 2, -1, -1):
        c2 = _C2[j] + t * c2
        c3 = _C3[j] + t * c3
    return 1.0 - t * c2, 1.0 - t * c3, c2, c3


@kernel
def _oscillating(t: float) -> tuple[float, float, float, float]:
    x = math.sqrt(t)
    sine, half = math.sin(x), math.sin(0.5 * x) / x
    return math.cos(x), sine / x, 2.0 * half * half, (x - sine) / (x * x * x)


@kernel
def _plain(t: NDArray[np.float64]) -> NDArray[np.float64]:
    out = np.empty((4, t.size))
    for i in range(t.size):
        if abs(t[i]) <= SERIES_LIMIT:
            c = _series(t[i])
        elif t[i] > 0.0:
            c = _oscillating(t[i])
        else:
            y = math.sqrt(-t[i])
            sine, half = math.sinh(y), math.sinh(0.5 * y) / y
            c = math.cosh(y), sine / y, 2.0 * half * half, (sine - y) / y / y / y
        out[0, i], out[1, i], out[2, i], out[3, i] = c
    return out


@kernel
def _scaled(t: NDArray[np.float64]) -> NDArray[np.float64]:
    out = np.empty((4, t.size))
    for i in range(t.size):
        if t[i] >= -SERIES_LIMIT:
            scale = math.exp(-math.sqrt(-t[i])) if t[i] < 0.0 else 1.0
            c = _oscillating(t[i]) if t[i] > SERIES_LIMIT else _series(t[i])
            c = scale * c[0], scale * c[1], scale * c[2], scale * c[3]
        else:
            # exp(-y) cosh y = (1 + e^-2y)/2 and so on, with expm1 where a difference would lose digits.
            y = math.sqrt(-t[i])
            decay, sine = math.exp(-y), -0.5 * math.expm1(-2.0 * y)
            half = -0.5 * math.expm1(-y) / y  # exp(-y/2) sinh(y/2)/y
            c = 0.5 * (1.0 + decay * decay), sine / y, 2.0 * half * half, (sine - y * decay) / y / y / y
        out[0, i], out[1, i], out[2, i], out[3, i] = c
    return out
