"""``solvers.rod.strip.beam_column`` compiled, for arrays too small to repay numpy's cost of a call.

The equations, their forms and their limits are those of that module; the tests hold the two against each other.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.rod.strip.beam_column import FORWARD_LIMIT
from solvers.rod.strip.stress_envelope import _SERIES_LIMIT, _remainders, beam_constants

Array = NDArray[np.float64]
_LIMIT = FORWARD_LIMIT
_UNSCALED = _SERIES_LIMIT


@kernel
def solve(q: Array, l: float, rod_length: float) -> tuple[Array, Array, Array, Array]:
    """C, D, V''(l) per unit stroke and the scaled determinant for every q, shape (n,)."""
    clamp, shear, head, det = np.empty(q.size), np.empty(q.size), np.empty(q.size), np.empty(q.size)
    for i in range(q.size):
        clamp[i], shear[i], head[i], det[i] = beam_constants(q[i], l, rod_length)
        if 0.0 < q[i] * l * l <= _UNSCALED:
            # The envelope needs the sign only and leaves the series unscaled.
            det[i] *= math.exp(-math.sqrt(q[i]) * l)
    return clamp, shear, head, det


@kernel
def curvature(q: Array, l: float, clamp: Array, shear: Array, head: Array, z: Array) -> Array:
    """V''(z) per unit stroke, shape (stations, couplings)."""
    out = np.empty((z.size, q.size))
    for i in range(q.size):
        if q[i] * l * l > _LIMIT:
            k = math.sqrt(q[i])
            span = -math.expm1(-2.0 * k * l)
            for j in range(z.size):
                down = math.exp(-k * z[j]) * -math.expm1(-2.0 * k * (l - z[j]))
                up = math.exp(-k * (l - z[j])) * -math.expm1(-2.0 * k * z[j])
                out[j, i] = (clamp[i] * down + head[i] * up) / span
            continue
        k = math.sqrt(abs(q[i]))
        for j in range(z.size):
            x = k * z[j]
            if x < 1e-4:
                # Beyond the next term lies less than 1e-18.
                s = q[i] * z[j] * z[j]
                c0, c1 = 1.0 + 0.5 * s, 1.0 + s / 6.0
            elif q[i] < 0.0:
                c0, c1 = math.cos(x), math.sin(x) / x
            else:
                c0, c1 = math.cosh(x), math.sinh(x) / x
            out[j, i] = clamp[i] * c0 + shear[i] * z[j] * c1
    return out


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
            if abs(t) <= _UNSCALED:
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


def warm_up() -> None:
    """Compile, or load from the cache, the three kernels."""
    q = np.array([-1.0, 1.0, 10.0])
    clamp, shear, head, _ = solve(q, 1.0, 2.0)
    curvature(q, 1.0, clamp, shear, head, np.array([0.0, 0.5]))
    deflection(q, 1.0, clamp, shear, head, np.array([0.0, 0.5]))
