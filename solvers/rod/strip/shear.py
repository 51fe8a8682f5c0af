"""Shear flexibility of the strip, after Engesser: the section's rotation psi differs from the slope V'.

    EI psi'' = P V' + Q,  m V' = psi - Q/(kGA),  m = 1 + P/(kGA),  k = 5/6
    psi(0) = V(0) = 0,  V(l) + e psi(l) = s,  M(L) = 0  (the rigid head follows psi)

Eliminating V' leaves the beam-column's own equation with q_s = q/m, so psi = C S1 + D S2 with Q = EI m D, and with
g = EI/(kGA), all c_k at t = -q_s l^2:

    det = l^3 (c2 - c3)/m + e l (l + m e) c1 + g l (c0 + e q l c1)
    C = s (l c1 + e m c0)/det,  D = -s (c0 + e q l c1)/det,  psi'(l) = s e m/det

Rigid in shear (g = 0, m = 1) this is ``beam_column``. Validity: P > -kGA, which always holds before buckling.
Source: F. Engesser (1891); Z. P. Bazant, L. Cedolin, Stability of Structures, section 1.7.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.numerics.jit import kernel
from solvers.rod.strip.buckling import first_root

_MAX_ITERATIONS = 100
_TOLERANCE = 4.0 * float(np.finfo(float).eps)


@kernel
def slope_of(rotation: float, softening: float, compliance: float, shear: float) -> float:
    """V' = psi/m - g D, from psi, m, g [m^2] and D [1/m^2]."""
    return rotation / softening - compliance * shear


@kernel
def _scaled_determinant(x: float, l: float, rod_length: float, compliance: float) -> float:
    """det/L^3 in compression."""
    e, scaled = rod_length - l, -((x / l) ** 2)
    softening = 1.0 / (1.0 - compliance * scaled)
    c0, sine = math.cos(x), math.sin(x)
    c1, difference = sine / x, (sine - x * c0) / (x * x * x)
    head_term = c0 + e * scaled * softening * l * c1
    det = l**3 * difference / softening + e * l * (l + softening * e) * c1 + compliance * l * head_term
    return det / rod_length**3


@kernel
def _first_root(l: float, rod_length: float, compliance: float, upper_bound: float) -> float:
    """First root of the determinant, by the Illinois variant of regula falsi, below the root without shear."""
    high, high_value = upper_bound, _scaled_determinant(upper_bound, l, rod_length, compliance)
    if not high_value < 0.0:
        return upper_bound
    low, low_value, last_side = 0.5 * upper_bound, 1.0, 0
    while True:
        low_value = _scaled_determinant(low, l, rod_length, compliance)
        if low_value > 0.0:
            break
        high, high_value, low = low, low_value, 0.5 * low
    for _ in range(_MAX_ITERATIONS):
        x = high - high_value * (high - low) / (high_value - low_value)
        value = _scaled_determinant(x, l, rod_length, compliance)
        if value == 0.0 or high - low <= _TOLERANCE * high:
            return x
        if value > 0.0:
            low, low_value = x, value
            high_value = 0.5 * high_value if last_side == 1 else high_value
            last_side = 1
        else:
            high, high_value = x, value
            low_value = 0.5 * low_value if last_side == -1 else low_value
            last_side = -1
    return high


@kernel
def critical_coupling_with_shear(length: float, rod_length: float, compliance: float) -> float:
    """-P_cr/EI [1/m^2] with shear, for g = EI/(kGA) [m^2]: the first zero of the determinant; rigid in shear if g = 0.

    With x^2 = -q_s l^2, m = 1/(1 + g x^2/l^2). Shear only softens the strip, so the root lies below that without shear.
    """
    x = first_root(min(length / rod_length, 1.0))[0]
    if compliance != 0.0:
        x = _first_root(length, rod_length, compliance, x)
    return -((x / length) ** 2) / (1.0 + compliance * (x / length) ** 2)
