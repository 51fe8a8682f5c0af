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
_SERIES_LIMIT = 1.0
_TERMS = 11
_C2 = np.array([(-1.0) ** j / math.factorial(2 * j + 2) for j in range(_TERMS)])
_C3 = np.array([(-1.0) ** j / math.factorial(2 * j + 3) for j in range(_TERMS)])


@kernel
def _remainders(t: float) -> tuple[float, float]:
    """c2, c3 by their series, for |t| <= 1 to the last place."""
    c2, c3 = _C2[_TERMS - 1], _C3[_TERMS - 1]
    for j in range(_TERMS - 2, -1, -1):
        c2 = _C2[j] + t * c2
        c3 = _C3[j] + t * c3
    return c2, c3


@kernel
def beam_constants(q: float, l: float, rod_length: float) -> tuple[float, float, float, float]:
    """C, D, V''(l) per unit stroke and the scaled determinant, as ``beam_column.solve`` defines them, for one q."""
    e = rod_length - l
    t = -q * l * l
    decay = 1.0
    if abs(t) <= _SERIES_LIMIT:
        c2, c3 = _remainders(t)
        c1, c0, difference = 1.0 - t * c3, 1.0 - t * c2, c2 - c3
    elif t > 0:
        x = math.sqrt(t)
        c0, sine = math.cos(x), math.sin(x)
        c1, difference = sine / x, (sine - x * c0) / (x * t)
    else:
        y = math.sqrt(-t)
        decay = math.exp(-y)
        c0, sine = 0.5 * (1.0 + decay * decay), -0.5 * math.expm1(-2.0 * y)
        c1, difference = sine / y, (y * c0 - sine) / (-y * t)
    det = l * l * l * difference + e * rod_length * l * c1
    return (l * c1 + e * c0) / det, -(c0 + e * q * l * c1) / det, e * decay / det, det


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

    Stations stand at equal steps from clamp to head, at least six, so that a step's own argument stays in the series'
    range even at buckling. Returns False, with nothing filled, if the strip buckles at one
    of the angles. ``force`` [N] and ``stroke`` [m] have one entry an angle.
    """
    angles, steps = force.size, high.shape[1] - 1
    step = l / steps
    coupling = 12.0 / (modulus * b * h * h * h)
    direct_scale, bending_scale = 1.0 / (b * h), 0.5 * modulus * h
    weak, strong = 0, angles
    direct, moment, change, factor = np.empty(angles), np.empty(angles), np.empty(angles), np.empty(angles)
    near, far, head_near, head_far = np.empty(angles), np.empty(angles), np.empty(angles), np.empty(angles)
    for i in range(angles):
        q = force[i] * coupling
        clamp, shear, head, det = beam_constants(q, l, rod_length)
        if not det > 0.0:
            return False
        scale = bending_scale * stroke[i]
        clamp, shear, head = clamp * scale, shear * scale, head * scale
        if q * l * l <= FORWARD_LIMIT:
            t = -q * step * step
            c2, c3 = _remainders(t)
            factor[weak] = -2.0 * t * c2
            moment[weak] = clamp
            change[weak] = 0.5 * factor[weak] * clamp + shear * step * (1.0 - t * c3)
            direct[weak] = force[i] * direct_scale
            weak += 1
        else:
            strong -= 1
            k = math.sqrt(q)
            ratio = math.exp(-k * step)
            whole = math.exp(-k * l)
            span = -math.expm1(-2.0 * k * l)
            factor[strong] = ratio
            change[strong] = min(1.0 / ratio, 1e300) if ratio > 0.0 else 1e300
            near[strong], far[strong] = clamp / span, clamp / span * whole * whole
            head_near[strong], head_far[strong] = head / span * whole, head / span * whole
            direct[strong] = force[i] * direct_scale
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
    high, low = np.empty((1, 2, 3)), np.empty((1, 2, 3))
    stress_envelopes(np.sin(angle), np.cos(angle), 2e11, np.array([[9e-3, 5e-4, 2e-2]]), 4e-2, high, low)
