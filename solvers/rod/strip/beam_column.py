"""The strip as a beam-column: clamped in the piston, with a rigid head hinged on the crank pin.

    EI V'''' - P V'' = 0 on [0, l],   q = P/EI (signed, tension positive), e = L - l
    V(0) = V'(0) = 0,   V(l) + e V'(l) = s,   V''(l) + e V'''(l) = 0

with the lateral displacement s = r sin(phi) of the crank pin. With S_k(z) = z^k c_k(-q z^2) and Stumpff's c_k,

    V = C S2 + D S3,  V' = C S1 + D S2,  V'' = C S0 + D S1,  V''' = q C S1 + D S0,
    det = l^3 (c2 - c3) + e L l c1,   C = s (l c1 + e c0)/det,   D = -s (c0 + e q l c1)/det

all c_k at t = -q l^2. The determinant in this form is a sum of positive terms from the strongest tension down to half
the buckling load, and its first zero is the stability boundary. Because c0^2 + t c1^2 = 1, the curvature at the head
is V''(l) = s e/det; the equilibrium of the whole rod is C + L D + q s = 0.

All quantities here are per unit lateral displacement (s = 1): curvatures in 1/m^2. The small-displacement theory is
linear in s. Validity: P above the first buckling load (det > 0), V/l < 0.15.

Source: T. A. Obolenskaya, A. S. Klochko, flexible rod of a crank-slider mechanism (2014), equations (1)-(4); the
constants were rederived from the boundary conditions.
"""

from __future__ import annotations

import math

from solvers.numerics.jit import fusing_kernel, kernel

FORWARD_LIMIT = 4.0
"""q l^2 up to which the shape is integrated from the clamp.

From the clamp, a decaying solution is the small difference of two growing ones and loses a factor cosh(sqrt(q l^2));
above the limit V'' is computed from its values at both ends, where both parts are positive and decay inward.
"""

_SERIES_LIMIT = 10.0
_C2 = tuple((-1.0) ** j / math.factorial(2 * j + 2) for j in range(16))
_C3 = tuple((-1.0) ** j / math.factorial(2 * j + 3) for j in range(16))


# Estrin's scheme: independent pairs take a third of the time of Horner's chain of dependent steps.
@fusing_kernel
def _remainders(t: float) -> tuple[float, float]:
    """Stumpff's c2 and c3 for |t| <= 10."""
    t2 = t * t
    t4 = t2 * t2
    a = (_C2[0] + t * _C2[1]) + t2 * (_C2[2] + t * _C2[3]) + t4 * ((_C2[4] + t * _C2[5]) + t2 * (_C2[6] + t * _C2[7]))
    b = (_C3[0] + t * _C3[1]) + t2 * (_C3[2] + t * _C3[3]) + t4 * ((_C3[4] + t * _C3[5]) + t2 * (_C3[6] + t * _C3[7]))
    c = (_C2[8] + t * _C2[9]) + t2 * (_C2[10] + t * _C2[11])
    d = (_C3[8] + t * _C3[9]) + t2 * (_C3[10] + t * _C3[11])
    c += t4 * ((_C2[12] + t * _C2[13]) + t2 * (_C2[14] + t * _C2[15]))
    d += t4 * ((_C3[12] + t * _C3[13]) + t2 * (_C3[14] + t * _C3[15]))
    return a + t4 * t4 * c, b + t4 * t4 * d


@kernel
def constants(q: float, l: float, rod_length: float, compliance: float) -> tuple[float, float, float, float, float]:
    """q_s, m, C, D and psi'(l) per unit lateral displacement for the coupling q = P/EI.

        det = l^3 (c2 - c3)/m + e l (l + m e) c1 + g l (c0 + e q l c1)
        C = (l c1 + e m c0)/det,  D = -(c0 + e q l c1)/det,  psi'(l) = e m/det,      c_k at t = -q_s l^2

    Without shear det is a sum of positive terms from the strongest tension to half the buckling load. In tension all
    c_k are scaled by exp(-sqrt(q_s) l).
    """
    e, m = rod_length - l, 1.0 + compliance * q
    scaled = q / m
    t = -scaled * l * l
    half_decay = 1.0
    if abs(t) <= _SERIES_LIMIT:
        c2, c3 = _remainders(t)
        c1, c0, difference = 1.0 - t * c3, 1.0 - t * c2, c2 - c3
    elif t > 0.0:
        x = math.sqrt(t)
        c0, sine = math.cos(x), math.sin(x)
        c1, difference = sine / x, (sine - x * c0) / (x * t)
    else:
        y = math.sqrt(-t)
        # The decay is applied in two factors, as it may underflow.
        half_decay = math.exp(-0.5 * y)
        decay = half_decay * half_decay
        c0, sine = 0.5 * (1.0 + decay * decay), -0.5 * math.expm1(-2.0 * y)
        c1, difference = sine / y, (y * c0 - sine) / (-y * t)
    head_term = c0 + e * q * l * c1
    det = l * l * l * difference / m + e * l * (l + m * e) * c1 + compliance * l * head_term
    return scaled, m, (l * c1 + e * m * c0) / det, -head_term / det, e * m * half_decay / det * half_decay
