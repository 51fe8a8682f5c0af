"""Section of a bushing: the least t = D - d, twice the wall, that carries given forces around a bore d.

With D = d + t and D^4 - d^4 = t (2d + t)(D^2 + d^2), free of cancellation for a thin wall, a criterion requires

    G(t) = sqrt(p^2 + r^2)/(stress (D^4 - d^4)) <= 1,   p = (32/pi) M D + (4/pi) N (D^2 + d^2),
    r = k (Q (c0 D^2 + c1 D t + c2 t^2) + (16/pi) T D),

the coefficients being those of a ``StrengthConstraint`` for a diameter of 1 m.

Each term of G decreases between 1/t (thin wall) and 1/t^3 (no bore), and so does G: d ln G/d ln t lies in [-3, -1].
So every value of G brackets the root, one exists for every finite load, and Newton's method in ln t converges to it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.section.criteria import ALLOWABLE_SHEAR
from solvers.pin.section.strength import StrengthConstraint

Array = NDArray[np.float64]
_EPS = float(np.finfo(float).eps)
_MAX_STEPS = 200
_QUADRATIC = 1e-9
"""Size of ln G from which one more step of Newton's method is exact to rounding."""


@kernel
def _use(t: float, d: float, m: float, n: float, q: float, s: float, c0: float, c1: float, c2: float):
    """Return G(t) and -d ln G/d ln t."""
    D = d + t
    full = t * (2.0 * d + t) * (D * D + d * d)
    shape = d * (c0 * d + (2.0 * c0 + c1) * t) + (c0 + c1 + c2) * t * t
    p, dp = m * D + n * (D * D + d * d), m + 2.0 * n * D
    r, dr = q * shape + s * D, q * (d * (2.0 * c0 + c1) + 2.0 * (c0 + c1 + c2) * t) + s
    size = max(abs(p), abs(r))
    if size == 0.0:
        return 0.0, 1.0
    a, b = p / size, r / size
    f = math.sqrt(a * a + b * b)
    fall = 4.0 * D * D * D * t / full - t * (a * dp + b * dr) / (size * f * f)
    return size * f / full, fall


@kernel
def _raise_gaps(
    bending: Array, shear: Array, n: float, s: float, c0: float, c1: float, c2: float, d: float, out: Array
) -> None:  # fmt: skip
    last = 0.0
    for i in range(out.size):
        m, q = bending[i], shear[i]
        if m == 0.0 and n == 0.0 and q == 0.0 and s == 0.0:
            continue
        # The neighbour's; without a bore a cube root of the bending term, a square root of the shear and axial ones.
        t = last if last > 0.0 else (m + s) ** (1.0 / 3.0) + math.sqrt(q * (c0 + c1 + c2)) + math.sqrt(n)
        low, high, before = 0.0, np.inf, np.inf
        for _ in range(_MAX_STEPS):
            g, fall = _use(t, d, m, n, q, s, c0, c1, c2)
            root = g ** (1.0 / 3.0)
            low, high = max(low, t * min(g, root)), min(high, t * max(g, root))
            off = math.log(g)
            if abs(off) <= 2.0 * _EPS:
                break
            if not low < high:
                # The bracket has collapsed to rounding error.
                t = 0.5 * (low + high)
                break
            new = t * math.exp(off / min(max(fall, 1.0), 3.0))
            done = abs(off) <= _QUADRATIC and low < new < high
            if not done and (not low < new < high or abs(off) > 0.5 * before):
                new = math.sqrt(low) * math.sqrt(high)
            before = abs(off)
            done = done or abs(new - t) <= _EPS * t
            t = new
            if done:
                break
        last = t
        out[i] = max(out[i], t)


@kernel
def _raise_uses(
    bending: Array, shear: Array, n: float, s: float, c0: float, c1: float, c2: float, d: float, gap: Array, out: Array
) -> None:  # fmt: skip
    for i in range(out.size):
        if max(bending[i], shear[i], n, s) > 0.0:
            use = _use(gap[i], d, bending[i], n, shear[i], s, c0, c1, c2)[0] if gap[i] > 0.0 else np.inf
            out[i] = max(out[i], use)


def least_gap(constraints: Sequence[StrengthConstraint], bore: float, floor: float, stations: int) -> Array:
    """Return the least t = D - d [m] of every station, (n,), at least ``floor``."""
    out = np.full(stations, floor)
    for c in constraints:
        _raise_gaps(c.bending, c.shear, c.axial, c.torsion, c.law.c0, c.law.c1, c.law.c2, bore, out)
    return out


def outside_uses(constraints: Sequence[StrengthConstraint], bore: float, gap: Array) -> Array:
    """Return the maximum G at t (n,), of the criterion and of the shear allowable, (2, n): inf where a loaded section
    has no wall, 0 where unloaded."""
    out = np.zeros((2, gap.size))
    for c in constraints:
        row = out[int(c.name == ALLOWABLE_SHEAR)]
        _raise_uses(c.bending, c.shear, c.axial, c.torsion, c.law.c0, c.law.c1, c.law.c2, bore, gap, row)
    return out
