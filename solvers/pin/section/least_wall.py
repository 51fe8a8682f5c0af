"""Minimum walls of pins and bushings under strength constraints (``solvers.pin.section.strength``).

Pin: v(w) = F(w). v is concave and F convex, so v - F is concave; at the start it is not positive, so Newton's method
converges monotonically from below for every load. Two starting values lie below the root: the w at which v = F(1),
since F decreases (close to the root for heavy loads), and the intersection of the tangents of v and F at w = 0 (close
to it for light loads).

Bushing: G(t) = 1 for a given bore d. Each term of G decreases at least as 1/t (thin wall) and at most as 1/t^3 (no
bore), hence so does G: d ln G/d ln t lies in [-3, -1]. So every value of G brackets the root, which exists for every
finite load, and Newton's method in ln t converges to it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.pin.load.macaulay import LIMIT_TOLERANCE
from solvers.pin.section.strength import StrengthConstraint, utilisation

_EPS = float(np.finfo(float).eps)
_MAX_STEPS = 200
_TINY = 1e-140
"""F below which its square approaches underflow; the wall is then F/4 to full precision."""
_QUADRATIC = 1e-9
"""Relative step, or magnitude of ln G, below which one more Newton step is exact to rounding."""


def least_wall(constraints: Sequence[StrengthConstraint], floor: float, stations: int) -> Array:
    """Return the least relative wall w of a pin at every station, (n,), at least ``floor``; NaN where the solid
    section fails by more than LIMIT_TOLERANCE.

    Valid for any load; the relative error is a few rounding errors times the condition number of the problem, which is
    unbounded only for F(1) -> 1 without shear (1 - w is the fourth root of the margin).
    """
    out = np.full(stations, floor)
    for c in constraints:
        _raise_walls(c.bending, c.shear, c.axial, c.torsion, c.law.c0, c.law.c1, c.law.c2, out)
    return out


def least_bushing_wall(constraints: Sequence[StrengthConstraint], bore: float, floor: float, stations: int) -> Array:
    """Return the minimum t = D - d [m] of a bushing at every station, (n,), not below ``floor``."""
    out = np.full(stations, floor)
    for c in constraints:
        _raise_bushing_walls(c.bending, c.shear, c.axial, c.torsion, c.law.c0, c.law.c1, c.law.c2, bore, out)
    return out


@kernel
def _raise_walls(m: Array, q: Array, n: float, t: float, c0: float, c1: float, c2: float, out: Array) -> None:
    for i in range(out.size):
        p, r = m[i] + n, q[i] * (c0 + (c1 + c2)) + t
        full = math.sqrt(p * p + r * r)
        if not full < 1.0:
            if not full <= 1.0 + LIMIT_TOLERANCE:
                out[i] = np.nan
            elif out[i] < 1.0:
                out[i] = 1.0
            continue
        p, r = m[i] + 2.0 * n, q[i] * c0 + t
        w = 0.25 * math.hypot(p, r)
        if w > _TINY:
            b, square = math.sqrt(math.sqrt(1.0 - full)), p * p + r * r
            # The tangents' intersection is F/(4 - F'), with F F' = -2 n p + c1 q r.
            light = square / (4.0 * math.sqrt(square) + (2.0 * n * p - c1 * q[i] * r))
            w = max(full / ((1.0 + b) * (1.0 + b * b)), light)
            for _ in range(_MAX_STEPS):
                b = 1.0 - w
                p, r = m[i] + n * (1.0 + b * b), q[i] * (c0 + w * (c1 + w * c2)) + t
                f = math.sqrt(p * p + r * r)
                excess = f - w * (2.0 - w) * (1.0 + b * b)
                # f times the slope of v - F.
                slope = 4.0 * b * b * b * f + (2.0 * n * b * p - q[i] * (c1 + 2.0 * c2 * w) * r)
                step = excess * f / slope if excess > 0.0 else 0.0
                w = min(w + step, 1.0)
                # The curvature is below 20, so unless the slope is small the step after a small one is below rounding.
                if step <= (_QUADRATIC if slope > 0.1 * f else 2.0 * _EPS) * w:
                    break
        # Remains NaN where another constraint fails.
        if w > out[i]:
            out[i] = w


@kernel
def _raise_bushing_walls(
    bending: Array, shear: Array, n: float, s: float, c0: float, c1: float, c2: float, d: float, out: Array
) -> None:  # fmt: skip
    last = 0.0
    for i in range(out.size):
        m, q = bending[i], shear[i]
        if m == 0.0 and n == 0.0 and q == 0.0 and s == 0.0:
            continue
        # Start from the neighbour's value; without one, from the cube root of the bending term and the square roots of
        # the shear and axial terms.
        t = last if last > 0.0 else (m + s) ** (1.0 / 3.0) + math.sqrt(q * (c0 + c1 + c2)) + math.sqrt(n)
        low, high, previous = 0.0, np.inf, np.inf
        for _ in range(_MAX_STEPS):
            g, exponent = utilisation(t, d, m, n, q, s, c0, c1, c2)
            root = g ** (1.0 / 3.0)
            low, high = max(low, t * min(g, root)), min(high, t * max(g, root))
            log_utilisation = math.log(g)
            if abs(log_utilisation) <= 2.0 * _EPS:
                break
            if not low < high:
                # The bracket has collapsed to rounding error.
                t = 0.5 * (low + high)
                break
            new = t * math.exp(log_utilisation / min(max(exponent, 1.0), 3.0))
            done = abs(log_utilisation) <= _QUADRATIC and low < new < high
            if not done and (not low < new < high or abs(log_utilisation) > 0.5 * previous):
                new = math.sqrt(low) * math.sqrt(high)
            previous = abs(log_utilisation)
            done = done or abs(new - t) <= _EPS * t
            t = new
            if done:
                break
        last = t
        out[i] = max(out[i], t)
