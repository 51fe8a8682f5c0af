"""Shear flexibility of the strip, after Engesser: the section's turn psi and the slope V' part ways.

    EI psi'' = P V' + Q,  m V' = psi - Q/(kGA),  m = 1 + P/(kGA),  k = 5/6
    psi(0) = V(0) = 0,  V(l) + e psi(l) = s,  M(L) = 0  (the rigid head follows psi)

Eliminating V' leaves the beam-column's own equation with q_s = q/m, so psi = C S1 + D S2 with Q = EI m D, and with
g = EI/(kGA), all c_k at t = -q_s l^2:

    det = l^3 (c2 - c3)/m + e l (l + m e) c1 + g l (c0 + e q l c1)
    C = s (l c1 + e m c0)/det,  D = -s (c0 + e q l c1)/det,  psi'(l) = s e m/det

Rigid in shear (g = 0, m = 1) this is ``beam_column``. Validity: P > -kGA, always so before buckling.
Source: F. Engesser (1891); Z. P. Bazant, L. Cedolin, Stability of Structures, section 1.7.
"""

from __future__ import annotations

from solvers.numerics.stumpff import stumpff
from solvers.rod.strip.buckling import critical_phase


def _determinant(
    c0: float,
    c1: float,
    c2_minus_c3: float,
    q: float,
    softening: float,
    l: float,
    e: float,
    compliance: float,
) -> float:
    return l**3 * c2_minus_c3 / softening + e * l * (l + softening * e) * c1 + compliance * l * (c0 + e * q * l * c1)


def critical_coupling(length: float, rod_length: float, compliance: float) -> float:
    """-P_cr/EI [1/m^2] with shear, for g = EI/(kGA) [m^2]: the first zero of the determinant.

    With x^2 = -q_s l^2, m = 1/(1 + g x^2/l^2). Shear can only soften, so the root lies below that without it.
    """
    from scipy.optimize import brentq

    e = rod_length - length

    def determinant(x: float) -> float:
        scaled = -((x / length) ** 2)
        softening = 1.0 / (1.0 - compliance * scaled)
        c = stumpff(x * x)
        q = scaled * softening
        return float(_determinant(c.c0, c.c1, c.c2 - c.c3, q, softening, length, e, compliance)) / rod_length**3

    rigid = float(critical_phase(length / rod_length))
    root = brentq(determinant, 1e-3, rigid, xtol=1e-15, rtol=8.9e-16) if determinant(rigid) < 0 else rigid
    return -((root / length) ** 2) / (1.0 + compliance * (root / length) ** 2)
