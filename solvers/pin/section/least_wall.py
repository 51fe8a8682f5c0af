"""Minimum wall under one strength constraint, for many stations at once: v(w) = F(w) by Newton's method.

v - F is concave (v is, F is convex) and not positive at the start, so Newton's method converges monotonically from
below for every load. Two starting values lie below the root: where v reaches F(1), since F decreases, which is close
for heavy loads, and where the tangents of v and F at w = 0 intersect, which is close for light ones.

All stations of a block take the same branch-free steps, which are vectorised; a block ends when all of its stations
have converged.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel

Array = NDArray[np.float64]
_EPS = float(np.finfo(float).eps)
_MAX_STEPS = 100
_BLOCK = 256
_TINY = 1e-140
"""F below which its squares approach underflow; the wall is then F/4 to full precision."""


@kernel
def _start(m: Array, q: Array, n: float, t: float, c0: float, c1: float, c2: float, wall: Array) -> int:
    """Write starting walls below the roots, NaN where F(1) > 1; return the number of nearly unloaded stations."""
    light = 0
    whole = c0 + (c1 + c2)
    for i in range(wall.size):
        p, r = m[i] + n, q[i] * whole + t
        full = math.sqrt(p * p + r * r)
        b = math.sqrt(math.sqrt(1.0 - full))
        heavy_start = full / ((1.0 + b) * (1.0 + b * b))
        p, r = m[i] + 2.0 * n, q[i] * c0 + t
        square = p * p + r * r
        f = math.sqrt(square)
        # F/(4 - F'), F F' = -2 n p + c1 q r.
        light_start = square / (4.0 * f + (2.0 * n * p - c1 * q[i] * r))
        wall[i] = light_start if light_start > heavy_start else heavy_start
        light += 1 if f < _TINY else 0
    return light


@kernel
def _newton_steps(m: Array, q: Array, n: float, t: float, c0: float, c1: float, c2: float, wall: Array) -> int:
    """One Newton step for every station; return the number not yet converged."""
    unsettled = 0
    for i in range(wall.size):
        w = wall[i]
        b = 1.0 - w
        p, r = m[i] + n * (1.0 + b * b), q[i] * (c0 + w * (c1 + w * c2)) + t
        f = math.sqrt(p * p + r * r)
        short = f - w * (2.0 - w) * (1.0 + b * b)
        # f times the slope of v - F.
        slope = 4.0 * b * b * b * f + (2.0 * n * b * p - q[i] * (c1 + 2.0 * c2 * w) * r)
        step = short * f / slope
        step = step if step > 0.0 else 0.0
        wall[i] = 1.0 if w + step > 1.0 else w + step
        # The curvature is below 20, so unless the slope is small the step after a small one is below rounding.
        unsettled += 1 if step > (1e-9 if slope > 0.1 * f else 2.0 * _EPS) * w else 0
    return unsettled


@kernel
def least_walls(m: Array, q: Array, n: float, t: float, c0: float, c1: float, c2: float, out: Array) -> None:
    """Raise ``out`` to the minimum walls of a constraint with m and q per station; NaN where F(1) > 1, or already
    NaN."""
    block = np.empty(_BLOCK)
    for begin in range(0, out.size, _BLOCK):
        end = min(begin + _BLOCK, out.size)
        wall, own_m, own_q = block[: end - begin], m[begin:end], q[begin:end]
        light = _start(own_m, own_q, n, t, c0, c1, c2, wall)
        for _ in range(_MAX_STEPS):
            if _newton_steps(own_m, own_q, n, t, c0, c1, c2, wall) == 0:
                break
        if light > 0:
            for i in range(wall.size):
                f = math.hypot(own_m[i] + 2.0 * n, own_q[i] * c0 + t)
                if f < _TINY:
                    wall[i] = 0.25 * f
        for i in range(wall.size):
            if wall[i] > out[begin + i] or math.isnan(wall[i]):
                out[begin + i] = wall[i]
