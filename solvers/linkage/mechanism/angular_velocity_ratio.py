"""Kinematics of a change-point four-bar over the cycle between two blows, free of cancellation.

The crank angle phi runs from 0 (just after the blow) to 2 pi (just before the next); a negative phi means 2 pi - |phi|,
so that both ends can be approached to full precision. With c = cos(phi/2), s = sin(phi/2):

    T^2 = lambda0 lambda2 lambda3 c^2 + M s^2,  D = lambda3 c + T,  A = T + lambda0 lambda2 c
    tan(phi3/2) = N s/D,  b = (D^2 + N^2 s^2)/lambda3,  u31 = dphi3/dphi = N A/(T b)
    du31/dphi = s X,  X = N/(T b) [(A/b) G^2/T - lambda0 lambda2 M/(2 T^2)],  G = T - sigma lambda0 c

with sigma = +1 for the largest coupler and -1 for the other two.

For c < 0 both D and A are evaluated as quotients: D = (lambda3 kappa c^2 + M s^2)/(T - lambda3 c) and
A = (M s^2 - lambda0 lambda2 kappa c^2)/(T - lambda0 lambda2 c), kappa = lambda0 lambda2 - lambda3 = |N| e; where
sigma c > 0, G = M/(T + sigma lambda0 c). The textbook acos form loses all digits 1e-7 away from the change point. Near
a kite (R -> 0) u31 is almost constant over part of the cycle and the two terms of X nearly cancel there; peak loads,
which lie elsewhere, keep all digits.
Valid where M >= 0 (the crank rotates fully); lengths in cranks, angles in rad.
Derivation: docs/theory/impact-linkage.md; checked there against the raw loop equation to 60 digits.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel

INFINITE = 1e150
"""Magnitude of cot(phi/2) at the blow: its square is finite."""


@kernel
def transfer_and_slope(coefficients: Array, angles: Array) -> tuple[Array, Array]:
    """u31 and du31/dphi of a design (its row of coefficients) at crank angles in [-2 pi, 2 pi], (m,) each."""
    transfer, slope = np.empty(angles.size), np.empty(angles.size)
    for k in range(angles.size):
        s, c = abs(math.sin(0.5 * angles[k])), math.cos(0.5 * angles[k])
        transfer[k], rate, _ = ratio_at_half_angle(coefficients, s, -c if angles[k] < 0.0 else c)
        slope[k] = s * rate
    return transfer, slope


@kernel
def ratio_at_half_angle(coefficients: Array, s: float, c: float) -> tuple[float, float, float]:
    """u31, X = u31'/s and T of a design at a half angle."""
    base, coupler, rocker, numerator, margin, kappa, sigma = coefficients
    base_coupler, cc, ss = base * coupler, c * c, s * s
    root = np.sqrt(base_coupler * rocker * cc + margin * ss)
    if c >= 0.0:
        d, a = rocker * c + root, root + base_coupler * c
    else:
        d = (rocker * kappa * cc + margin * ss) / (root - rocker * c)
        a = (margin * ss - base_coupler * kappa * cc) / (root - base_coupler * c)
    signed_base = sigma * base * c
    gap = margin / (root + signed_base) if signed_base > 0.0 else root - signed_base
    b = (d * d + numerator * numerator * ss) / rocker
    factor = numerator / (root * b)
    rate = factor * (a / b * gap * gap / root - 0.5 * base_coupler * margin / (root * root))
    return factor * a, rate, root


@kernel
def resolving_cotangents(coefficients: Array, step: float, share: float) -> Array:
    """cot(phi/2) of a design over the cycle, decreasing, both ends included: scale sinh(t) at equal steps of t.

    Steps are even within the scale that resolves a second change point near pi, and beyond it in proportion to the
    distance from pi and then from the blow, down to a ``share`` of the angle e or sqrt(lambda3 kappa/M) within which a
    fast rocker turns.
    """
    base, coupler, rocker, numerator, margin, kappa, _ = coefficients
    margin = max(margin, 1e-30)
    scale = min(math.sqrt(margin / (base * coupler * rocker)), 1.0)
    least = share * min(math.sqrt(rocker * kappa / margin), 0.5 * kappa / abs(numerator), 1.0)
    half = math.ceil(math.asinh(1.0 / (least * scale)) / step) + 1
    out = np.empty(2 * half + 1)
    for k in range(out.size):
        out[k] = scale * math.sinh(step * (half - k))
    out[0], out[-1] = INFINITE, -INFINITE
    return out
