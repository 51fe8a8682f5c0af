"""The compiled heart of check and design: the extremes of both fibres' stresses over the cycle, section by section.

    sigma+-(z, phi) = P(phi)/(b h) +- (E h/2) V''(z; P/EI) r sin(phi)

No trigonometry stands in the loop over sections. V'' obeys M'' = q M, so along equal steps it follows a recurrence:
from the clamp in compression and weak tension, in difference form so that nothing cancels as q -> 0; from both ends by
decaying powers in strong tension. Angles lie innermost, where the processor takes several at once.
Per-angle constants are those of ``solvers.rod.beam_column``, against which the tests hold every number.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel, reducing_kernel

Array = NDArray[np.float64]

FORWARD_LIMIT = 4.0
LEAST_STEPS = 12
"""Fewest steps along the strip: a step's argument stays below 0.15 even at buckling, so a short series serves it."""

_SERIES_LIMIT = 1.0
_TERMS = 11
_C2 = np.array([(-1.0) ** j / math.factorial(2 * j + 2) for j in range(_TERMS)])
_C3 = np.array([(-1.0) ** j / math.factorial(2 * j + 3) for j in range(_TERMS)])
_Q2 = tuple((-1.0) ** j / math.factorial(2 * j + 2) for j in range(13))
_Q3 = tuple((-1.0) ** j / math.factorial(2 * j + 3) for j in range(13))


@kernel
def _remainders(t: float) -> tuple[float, float]:
    """c2, c3 by their series, for |t| <= 1 to the last place."""
    c2, c3 = _C2[_TERMS - 1], _C3[_TERMS - 1]
    for j in range(_TERMS - 2, -1, -1):
        c2 = _C2[j] + t * c2
        c3 = _C3[j] + t * c3
    return c2, c3


# Written out term by term: the compiler takes several angles at once only where no loop stands inside the loop.
@reducing_kernel
def _long_series(t: float) -> tuple[float, float]:
    """c2, c3 for |t| <= 5.1."""
    c = _Q2[12]
    c = _Q2[11] + t * c
    c = _Q2[10] + t * c
    c = _Q2[9] + t * c
    c = _Q2[8] + t * c
    c = _Q2[7] + t * c
    c = _Q2[6] + t * c
    c = _Q2[5] + t * c
    c = _Q2[4] + t * c
    c = _Q2[3] + t * c
    c = _Q2[2] + t * c
    c = _Q2[1] + t * c
    c = _Q2[0] + t * c
    c2 = c
    c = _Q3[12]
    c = _Q3[11] + t * c
    c = _Q3[10] + t * c
    c = _Q3[9] + t * c
    c = _Q3[8] + t * c
    c = _Q3[7] + t * c
    c = _Q3[6] + t * c
    c = _Q3[5] + t * c
    c = _Q3[4] + t * c
    c = _Q3[3] + t * c
    c = _Q3[2] + t * c
    c = _Q3[1] + t * c
    c = _Q3[0] + t * c
    return c2, c


@reducing_kernel
def _short_series(t: float) -> tuple[float, float]:
    """c2, c3 for |t| <= 0.15."""
    c = _Q2[6]
    c = _Q2[5] + t * c
    c = _Q2[4] + t * c
    c = _Q2[3] + t * c
    c = _Q2[2] + t * c
    c = _Q2[1] + t * c
    c = _Q2[0] + t * c
    c2 = c
    c = _Q3[6]
    c = _Q3[5] + t * c
    c = _Q3[4] + t * c
    c = _Q3[3] + t * c
    c = _Q3[2] + t * c
    c = _Q3[1] + t * c
    c = _Q3[0] + t * c
    return c2, c


@reducing_kernel
def _weak_constants(q: Array, count: int, l: float, rod_length: float, clamp: Array, shear: Array) -> bool:
    """C and D per unit stroke for the first ``count`` couplings, q l^2 <= 4; False if one is at or beyond buckling.

    c2 and c3 by their series at a quarter of the argument, doubled once (c2(4t) = c1(t)^2/2, c3(4t) = (c2 + c0 c3)/4):
    straight-line code that the processor does for several angles at once, where sine and cosine would be one by one.
    """
    e = rod_length - l
    least = np.inf
    for i in range(count):
        t = -q[i] * l * l
        quarter = 0.25 * t
        c2, c3 = _long_series(quarter)
        s1, s0 = 1.0 - quarter * c3, 1.0 - quarter * c2
        c3 = 0.25 * (c2 + s0 * c3)
        c2 = 0.5 * s1 * s1
        c1, c0 = s0 * s1, 1.0 - t * c2
        det = l * l * l * (c2 - c3) + e * rod_length * l * c1
        least = min(least, det)
        clamp[i] = (l * c1 + e * c0) / det
        shear[i] = -(c0 - e * t * c1 / l) / det
    return least > 0.0


@kernel
def beam_constants(q: float, l: float, rod_length: float) -> tuple[float, float, float, float]:
    """C, D, V''(l) per unit stroke and the scaled determinant, as ``beam_column.solve`` defines them, for one q."""
    e = rod_length - l
    t = -q * l * l
    half = 1.0
    if abs(t) <= _SERIES_LIMIT:
        c2, c3 = _remainders(t)
        c1, c0, difference = 1.0 - t * c3, 1.0 - t * c2, c2 - c3
    elif t > 0:
        x = math.sqrt(t)
        c0, sine = math.cos(x), math.sin(x)
        c1, difference = sine / x, (sine - x * c0) / (x * t)
    else:
        y = math.sqrt(-t)
        # Half the decay at a time: all of it may be too small a number to keep its digits.
        half = math.exp(-0.5 * y)
        decay = half * half
        c0, sine = 0.5 * (1.0 + decay * decay), -0.5 * math.expm1(-2.0 * y)
        c1, difference = sine / y, (y * c0 - sine) / (-y * t)
    det = l * l * l * difference + e * rod_length * l * c1
    return (l * c1 + e * c0) / det, -(c0 + e * q * l * c1) / det, e * half / det * half, det


@reducing_kernel
def stress_envelope(
    force: Array,
    stroke: Array,
    modulus: float,
    b: float,
    h: float,
    l: float,
    rod_length: float,
    high: Array,
    low: Array,
) -> bool:
    """Fill ``high`` and ``low``, shape (2, stations), with each fibre's greatest and least stress [Pa] over the angles.

    Stations stand at equal steps from clamp to head, at least ``LEAST_STEPS`` of them. Returns False, with nothing
    filled, if the strip buckles at one of the angles. ``force`` [N] and ``stroke`` [m] have one entry an angle.
    """
    angles, steps = force.size, high.shape[1] - 1
    step = l / steps
    coupling = 12.0 / (modulus * b * h * h * h)
    direct_scale, bending_scale = 1.0 / (b * h), 0.5 * modulus * h
    weak, strong = 0, angles
    room = np.empty((10, angles))
    q, direct, scale, moment, change, factor = room[0], room[1], room[2], room[3], room[4], room[5]
    near, far, head_near, head_far = room[6], room[7], room[8], room[9]
    for i in range(angles):
        value = force[i] * coupling
        if value * l * l <= FORWARD_LIMIT:
            place = weak
            weak += 1
        else:
            strong -= 1
            place = strong
        q[place], direct[place], scale[place] = value, force[i] * direct_scale, stroke[i] * bending_scale
    if not _weak_constants(q, weak, l, rod_length, moment, change):
        return False
    for i in range(weak):
        t = -q[i] * step * step
        c2, c3 = _short_series(t)
        factor[i] = -2.0 * t * c2
        change[i] = scale[i] * (0.5 * factor[i] * moment[i] + change[i] * step * (1.0 - t * c3))
        moment[i] *= scale[i]
    for i in range(strong, angles):
        clamp, _, head, _ = beam_constants(q[i], l, rod_length)
        k = math.sqrt(q[i])
        factor[i] = math.exp(-k * step)
        change[i] = min(1.0 / factor[i], 1e300) if factor[i] > 0.0 else 1e300
        whole, span = math.exp(-k * l), -math.expm1(-2.0 * k * l)
        clamp, head = clamp * scale[i] / span, head * scale[i] / span
        near[i], far[i] = clamp, clamp * whole * whole
        head_near[i], head_far[i] = head * whole, head * whole
    for j in range(steps + 1):
        upper_high, upper_low, lower_high, lower_low = -np.inf, np.inf, -np.inf, np.inf
        for i in range(weak):
            bending, axial = moment[i], direct[i]
            upper, lower = axial + bending, axial - bending
            upper_high, upper_low = max(upper_high, upper), min(upper_low, upper)
            lower_high, lower_low = max(lower_high, lower), min(lower_low, lower)
            moment[i] = bending + change[i]
            change[i] += factor[i] * moment[i]
        for i in range(strong, angles):
            bending, axial = near[i] - far[i] + head_near[i] - head_far[i], direct[i]
            upper, lower = axial + bending, axial - bending
            upper_high, upper_low = max(upper_high, upper), min(upper_low, upper)
            lower_high, lower_low = max(lower_high, lower), min(lower_low, lower)
            near[i] *= factor[i]
            far[i] *= change[i]
            head_near[i] *= change[i]
            head_far[i] *= factor[i]
        high[0, j], low[0, j], high[1, j], low[1, j] = upper_high, upper_low, lower_high, lower_low
    return True


@kernel
def stress_envelopes(
    force: Array, stroke: Array, modulus: float, designs: Array, rod_length: float, high: Array, low: Array
) -> Array:
    """``stress_envelope`` for many strips, ``designs`` of shape (n, 3) with b, h, l; high, low (n, 2, stations).

    Returns 1.0 for each strip that stands, 0.0 for each that buckles.
    """
    stands = np.empty(designs.shape[0])
    for n in range(designs.shape[0]):
        b, h, l = designs[n]
        stands[n] = 1.0 if stress_envelope(force, stroke, modulus, b, h, l, rod_length, high[n], low[n]) else 0.0
    return stands


def warm_up() -> None:
    """Compile, or load from the cache, every kernel of this module."""
    angle = np.linspace(0.0, 6.0, 8)
    high, low = np.empty((1, 2, 13)), np.empty((1, 2, 13))
    stress_envelopes(np.sin(angle), np.cos(angle), 2e11, np.array([[9e-3, 5e-4, 2e-2]]), 4e-2, high, low)
