"""The bent strip at one section for many crank angles, from the constants C, D and psi'(l) of every angle.

    psi' = C S0 + D S1,  psi = C S1 + D S2,  V' = psi/m - g D,  V = (C S2 + D S3)/m - g D z

(``strip.beam_column``, ``strip.shear``). Up to q z^2 = 4 the S_k are computed by series only, at a quarter of the
argument followed by one doubling step, which vectorises over angles. Beyond, in tension, a decaying solution integrated
from the clamp would be the small difference of two growing ones; there psi' is computed from its values at both ends,
where both parts decay inward, and psi and V from the integrated equation itself, q V'' = V''''.
"""

from __future__ import annotations

import math

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel, reducing_kernel
from solvers.rod.strip.beam_column import FORWARD_LIMIT

_TERMS = 12
_C2 = tuple((-1.0) ** j / math.factorial(2 * j + 2) for j in range(_TERMS))
_C3 = tuple((-1.0) ** j / math.factorial(2 * j + 3) for j in range(_TERMS))


# Unrolled by hand: the compiler vectorises over angles only if the loop contains no inner loop.
@reducing_kernel
def _remainders(t: float) -> tuple[float, float]:
    """Stumpff's c2 and c3 for |t| <= 5.1, accurate to the last place."""
    a = _C2[6] + t * (_C2[7] + t * (_C2[8] + t * (_C2[9] + t * (_C2[10] + t * _C2[11]))))
    a = _C2[0] + t * (_C2[1] + t * (_C2[2] + t * (_C2[3] + t * (_C2[4] + t * (_C2[5] + t * a)))))
    b = _C3[6] + t * (_C3[7] + t * (_C3[8] + t * (_C3[9] + t * (_C3[10] + t * _C3[11]))))
    b = _C3[0] + t * (_C3[1] + t * (_C3[2] + t * (_C3[3] + t * (_C3[4] + t * (_C3[5] + t * b)))))
    return a, b


@reducing_kernel
def _from_clamp(q: float, clamp: float, shear: float, z: float) -> tuple[float, float, float]:
    """psi', psi and its integral for q z^2 <= 4, from the constants at the clamp."""
    t = -q * z * z
    quarter = 0.25 * t
    c2, c3 = _remainders(quarter)
    s1, s0 = 1.0 - quarter * c3, 1.0 - quarter * c2
    c3 = 0.25 * (c2 + s0 * c3)
    c2 = 0.5 * s1 * s1
    c1, linear = s0 * s1, shear * z
    return (
        clamp * (1.0 - t * c2) + linear * c1,
        z * (clamp * c1 + linear * c2),
        z * z * (clamp * c2 + linear * c3),
    )


@kernel
def _from_ends(
    q: float, clamp: float, shear: float, head: float, l: float, z: float
) -> tuple[float, float, float]:  # fmt: skip
    """psi', psi and its integral in strong tension, from psi' at both ends."""
    k = math.sqrt(q)
    span = -math.expm1(-2.0 * k * l)
    near, far = math.exp(-k * z), math.exp(-k * (l - z))
    near_image, far_image = math.exp(-k * (2.0 * l - z)), math.exp(-k * (l + z))
    curvature = (clamp * (near - near_image) + head * (far - far_image)) / span
    derivative = k * (head * (far + far_image) - clamp * (near + near_image)) / span
    return curvature, (derivative - shear) / q, (curvature - clamp - shear * z) / q


@kernel
def bend_at(q: float, clamp: float, shear: float, head: float, l: float, z: float) -> tuple[float, float, float]:
    """psi' [1/m], psi and int psi dz [m] at the section z, at one angle."""
    if q * l * l > FORWARD_LIMIT:
        return _from_ends(q, clamp, shear, head, l, z)
    return _from_clamp(q, clamp, shear, z)


@reducing_kernel
def bend(
    q: Array, clamp: Array, shear: Array, head: Array, l: float, z: float, curvature: Array, rotation: Array,
    integral: Array,
) -> None:  # fmt: skip
    """Write psi' [1/m], psi and int psi dz [m] at the section z for all angles, each (n,)."""
    limit = FORWARD_LIMIT / (l * l)
    for i in range(q.size):
        curvature[i], rotation[i], integral[i] = _from_clamp(min(q[i], limit), clamp[i], shear[i], z)
    for i in range(q.size):
        if q[i] > limit:
            curvature[i], rotation[i], integral[i] = _from_ends(q[i], clamp[i], shear[i], head[i], l, z)
