"""Section of a bushing: the least t = D - d, twice the wall, that carries given forces around a bore d.

Each term of G (``solvers.pin.section.strength``) decreases between 1/t (thin wall) and 1/t^3 (no bore), and so does G:
d ln G/d ln t lies in [-3, -1].
So every value of G brackets the root, one exists for every finite load, and Newton's method in ln t converges to it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.section.strength import StrengthConstraint, utilisation

Array = NDArray[np.float64]
_EPS = float(np.finfo(float).eps)
_MAX_STEPS = 200
_QUADRATIC = 1e-9
"""Size of ln G from which one more step of Newton's method is exact to rounding."""


@kernel
def _raise_gaps(
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
        low, high, before = 0.0, np.inf, np.inf
        for _ in range(_MAX_STEPS):
            g, fall = utilisation(t, d, m, n, q, s, c0, c1, c2)
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


def least_gap(constraints: Sequence[StrengthConstraint], bore: float, floor: float, stations: int) -> Array:
    """Return the least t = D - d [m] of every station, (n,), at least ``floor``."""
    out = np.full(stations, floor)
    for c in constraints:
        _raise_gaps(c.bending, c.shear, c.axial, c.torsion, c.law.c0, c.law.c1, c.law.c2, bore, out)
    return out
