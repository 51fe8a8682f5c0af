"""Section of a bushing: the least t = D - d, twice the wall, that carries given forces around a bore d.

With D = d + t and D^4 - d^4 = t (2d + t)(D^2 + d^2), free of cancellation for a thin wall, a criterion requires

    G(t) = sqrt(p^2 + r^2)/(stress (D^4 - d^4)) <= 1,   p = (32/pi) M D + (4/pi) N (D^2 + d^2),
    r = k (Q (c0 D^2 + c1 D t + c2 t^2) + (16/pi) T D).

Each term of G decreases between 1/t (thin wall) and 1/t^3 (no bore), and so does G: d ln G/d ln t lies in [-3, -1].
So every value of G brackets the root, one exists for every finite load, and Newton's method in ln t converges to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.load.internal_forces import InternalForces
from solvers.pin.scene import PinMaterial
from solvers.pin.section.criteria import ALLOWABLE_SHEAR, CombinedCriterion, Criterion, Share, ShearLaw

Array = NDArray[np.float64]
_EPS = float(np.finfo(float).eps)
_MAX_STEPS = 200
_QUADRATIC = 1e-9
"""Size of ln G from which one more step of Newton's method is exact to rounding."""


@dataclass(frozen=True)
class OutsideConstraint:
    """The forces in a strength constraint at every station, (4, n): bending, axial, shear, torsion; over ``stress``."""

    name: str
    parts: Array
    law: ShearLaw
    stress: float


def outside_constraints(
    forces: InternalForces, criterion: Criterion, material: PinMaterial
) -> tuple[OutsideConstraint, ...]:
    """Return the strength constraints of one load case, including a separate shear allowable."""
    law = criterion.law(material)

    def constraint(share: Share, stress: float) -> OutsideConstraint:
        own, k = share.forces, share.factor
        full = np.ones_like(own.moment_total)
        parts = [
            32.0 / math.pi * own.moment_total,
            4.0 / math.pi * abs(own.axial_force) * full,
            k * own.shear_total,
            k * 16.0 / math.pi * abs(own.torque) * full,
        ]
        return OutsideConstraint(share.name, np.stack(parts) / stress, law, stress)

    found = [constraint(share, material.allowable_stress) for share in criterion.shares(forces)]
    if material.allowable_shear is not None:
        # Shear alone: bending and axial force do not enter.
        only = InternalForces(np.zeros_like(forces.moment), forces.shear, 0.0, forces.torque)
        found.append(constraint(CombinedCriterion(ALLOWABLE_SHEAR, 1.0).shares(only)[0], material.allowable_shear))
    return tuple(found)


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
def _least_gap(parts: Array, c0: float, c1: float, c2: float, d: float, out: Array) -> None:
    last = 0.0
    for i in range(out.size):
        m, n, q, s = parts[0, i], parts[1, i], parts[2, i], parts[3, i]
        if m == 0.0 and n == 0.0 and q == 0.0 and s == 0.0:
            out[i] = 0.0
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
        out[i] = last = t


def least_gap(constraint: OutsideConstraint, bore: float) -> Array:
    """Return the least t = D - d [m] of every station, (n,); 0 where unloaded."""
    out = np.empty(constraint.parts.shape[1])
    _least_gap(
        np.ascontiguousarray(constraint.parts), constraint.law.c0, constraint.law.c1, constraint.law.c2, bore, out
    )
    return out


def utilisation(constraint: OutsideConstraint, bore: float, gap: Array) -> Array:
    """G at t of shape (n,): inf where a loaded section has no wall, 0 where unloaded."""
    d, t, law = bore, gap, constraint.law
    outer = d + t
    full = t * (2.0 * d + t) * (outer**2 + d * d)
    m, n, q, s = constraint.parts
    p = m * outer + n * (outer**2 + d * d)
    r = q * (law.c0 * outer**2 + law.c1 * outer * t + law.c2 * t * t) + s * outer
    f = np.hypot(p, r)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(f > 0.0, f / full, 0.0)
