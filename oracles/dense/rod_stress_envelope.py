"""The extremes of both fibres' stresses over the cycle, section by section, as general optimizers are given them.

    sigma+-(z, phi) = P(phi)/(b h) +- (E h/2) V''(z; P/EI) r sin(phi)

The loop over sections contains only additions and products. V'' obeys M'' = q M; measured from the head, at x = l - z,
it is V'' = (e c0(x) + x c1(x))/det with e = L - l and det = l^3 (c2 - c3) + e L l c1 (``beam_column``). At equal steps
it follows a recurrence from the head, in difference form, so that nothing cancels as q -> 0; in tension it grows along
the way, which damps errors. det is one power series in q l^2. In strong tension V'' is the sum of powers decaying from
both ends. The loop over angles is innermost and vectorised; it computes forces, which become stresses by 1/(b h) at the
end. Tests compare every number with ``oracles.textbook.rod_beam_column``.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from solvers.numerics.jit import fusing_kernel, kernel
from solvers.rod.strip.beam_column import constants

Array = NDArray[np.float64]

LEAST_STEPS = 12
"""Minimum number of steps along the strip: the argument of a step then stays below 0.15 even at buckling, and a short
series suffices."""

_Q2 = tuple((-1.0) ** j / math.factorial(2 * j + 2) for j in range(6))
_Q3 = tuple((-1.0) ** j / math.factorial(2 * j + 3) for j in range(6))

_WEAK_LIMIT = 20.25
"""q l^2 above which tension counts as strong. In compression every strip has buckled before: u^2 <= 20.191 for all l <=
L."""
_NEAR = 8.0
"""|q l^2| up to which fourteen terms of det are accurate to the last place; beyond it, nineteen are."""
_DET = np.array([
    [(-1.0) ** j * (2 * j + 2) / math.factorial(2 * j + 3) for j in range(19)],
    [(-1.0) ** j / math.factorial(2 * j + 1) for j in range(19)],
])  # fmt: skip
"""det/l = l^2 [c2 - c3] + e L [c1] as power series in t = -q l^2."""

# Python's ``max`` compiles to a comparison and a selection, which LLVM does not recognise as a maximum and does not
# vectorise; here the intrinsic is called by name.
_DOUBLE = ir.DoubleType()
_TWO_TO_ONE = ir.FunctionType(_DOUBLE, [_DOUBLE, _DOUBLE])
_SIGNATURE = types.float64(types.float64, types.float64)


@intrinsic
def greater(typing_context: Any, one: Any, other: Any) -> Any:
    """The greater of two floats."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.call(builder.module.declare_intrinsic("llvm.maxnum", [_DOUBLE], _TWO_TO_ONE), arguments)

    return _SIGNATURE, code


@intrinsic
def lesser(typing_context: Any, one: Any, other: Any) -> Any:
    """The lesser of two floats."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.call(builder.module.declare_intrinsic("llvm.minnum", [_DOUBLE], _TWO_TO_ONE), arguments)

    return _SIGNATURE, code


# Written out term by term: the compiler vectorises over angles only without an inner loop.
@fusing_kernel
def _short_series(t: float) -> tuple[float, float]:
    """c2, c3 for |t| <= 0.15."""
    c = _Q2[5]
    c = _Q2[4] + t * c
    c = _Q2[3] + t * c
    c = _Q2[2] + t * c
    c = _Q2[1] + t * c
    c = _Q2[0] + t * c
    c2, c = c, _Q3[5]
    c = _Q3[4] + t * c
    c = _Q3[3] + t * c
    c = _Q3[2] + t * c
    c = _Q3[1] + t * c
    c = _Q3[0] + t * c
    return c2, c


@fusing_kernel
def _weak_constants(
    force: Array, lateral: Array, count: int, per_force: float, widest: float, scale: float, l: float,
    rod_length: float, steps: int, series: Array, moment: Array, change: Array, factor: Array,
) -> bool:  # fmt: skip
    """V'' at the head, its first difference and the recurrence's factor for the first ``count`` angles.

    ``per_force`` is t/P, ``widest`` the greatest |t|; V'' comes times ``lateral`` and ``scale``. False if buckled.
    """
    e, step, part, a = rod_length - l, l / steps, 1.0 / (steps * steps), series
    for j in range(a.size):
        a[j] = l * l * _DET[0, j] + e * rod_length * _DET[1, j]
    # The higher terms matter for few designs only; they are omitted per design, not per angle.
    for i in range(count):
        factor[i] = a[13]
    if widest > _NEAR:
        for i in range(count):
            t = per_force * force[i]
            p = a[18]
            p = a[17] + t * p
            p = a[16] + t * p
            p = a[15] + t * p
            p = a[14] + t * p
            factor[i] = a[13] + t * p
    least = np.inf
    for i in range(count):
        t = per_force * force[i]
        p = factor[i]
        p = a[12] + t * p
        p = a[11] + t * p
        p = a[10] + t * p
        p = a[9] + t * p
        p = a[8] + t * p
        p = a[7] + t * p
        p = a[6] + t * p
        p = a[5] + t * p
        p = a[4] + t * p
        p = a[3] + t * p
        p = a[2] + t * p
        p = a[1] + t * p
        p = a[0] + t * p
        least = lesser(least, p)
        gain = scale * lateral[i] / p
        s = part * t
        c2, c3 = _short_series(s)
        twice = -2.0 * s * c2
        factor[i] = twice
        moment[i] = gain * e
        change[i] = gain * (0.5 * e * twice + step * (1.0 - s * c3))
    return least > 0.0


@fusing_kernel
def _weak_extremes(
    force: Array, count: int, moment: Array, change: Array, factor: Array, n: int, high: Array, low: Array
) -> None:
    """Extremes over the first ``count`` angles at every station, from the head on, as forces [N]."""
    for j in range(high.shape[2] - 1, -1, -1):
        upper_high, upper_low, lower_high, lower_low = -np.inf, np.inf, -np.inf, np.inf
        for i in range(count):
            bending, axial = moment[i], force[i]
            upper, lower = axial + bending, axial - bending
            upper_high, upper_low = greater(upper_high, upper), lesser(upper_low, upper)
            lower_high, lower_low = greater(lower_high, lower), lesser(lower_low, lower)
            following = bending + change[i]
            moment[i] = following
            change[i] += factor[i] * following
        high[n, 0, j], low[n, 0, j], high[n, 1, j], low[n, 1, j] = upper_high, upper_low, lower_high, lower_low


@fusing_kernel
def _strong_extremes(
    force: Array, lateral: Array, weak: int, coupling: float, scale: float, l: float, rod_length: float, n: int,
    high: Array, low: Array,
) -> None:  # fmt: skip
    """Widen the extremes by the angles from ``weak`` on, all in strong tension: decaying powers from both ends."""
    steps = high.shape[2] - 1
    room = np.empty((6, force.size - weak))
    near, far, head_near, head_far, fall, rise = room[0], room[1], room[2], room[3], room[4], room[5]
    for i in range(near.size):
        q = coupling * force[weak + i]
        _, _, clamp, _, head = constants(q, l, rod_length, 0.0)
        k = math.sqrt(q)
        fall[i] = math.exp(-k * l / steps)
        rise[i] = min(1.0 / fall[i], 1e300) if fall[i] > 0.0 else 1e300
        whole, span = math.exp(-k * l), -math.expm1(-2.0 * k * l)
        clamp, head = clamp * scale * lateral[weak + i] / span, head * scale * lateral[weak + i] / span
        near[i], far[i] = clamp, clamp * whole * whole
        head_near[i], head_far[i] = head * whole, head * whole
    for j in range(steps + 1):
        upper_high, upper_low, lower_high, lower_low = high[n, 0, j], low[n, 0, j], high[n, 1, j], low[n, 1, j]
        for i in range(near.size):
            bending, axial = near[i] - far[i] + head_near[i] - head_far[i], force[weak + i]
            upper, lower = axial + bending, axial - bending
            upper_high, upper_low = greater(upper_high, upper), lesser(upper_low, upper)
            lower_high, lower_low = greater(lower_high, lower), lesser(lower_low, lower)
            near[i] *= fall[i]
            far[i] *= rise[i]
            head_near[i] *= rise[i]
            head_far[i] *= fall[i]
        high[n, 0, j], low[n, 0, j], high[n, 1, j], low[n, 1, j] = upper_high, upper_low, lower_high, lower_low


@fusing_kernel
def stress_envelopes(
    force: Array, lateral: Array, modulus: float, designs: Array, rod_length: float, high: Array, low: Array
) -> Array:
    """Fill ``high`` and ``low`` with each fibre's greatest and least stress [Pa] over the angles, strip by strip.

    ``force`` [N] and ``lateral`` [m] have one entry per angle, ``designs`` one row b, h, l [m] per strip; high and low
    have the shape (n, 2, stations), stations at equal steps from clamp to head, at least ``LEAST_STEPS`` steps. Returns
    1.0 for each stable strip and 0.0 for each buckled one, whose entries are left unchanged.
    """
    angles, steps = force.size, high.shape[2] - 1
    moment, change, factor = np.empty(angles), np.empty(angles), np.empty(angles)
    series, stands = np.empty(_DET.shape[1]), np.zeros(designs.shape[0])
    sorted_force, sorted_lateral = np.empty(angles), np.empty(angles)
    push, pull = 0.0, 0.0
    for i in range(angles):
        push, pull = greater(push, -force[i]), greater(pull, force[i])
    for n in range(designs.shape[0]):
        b, h, l = designs[n, 0], designs[n, 1], designs[n, 2]
        coupling, scale = 12.0 / (modulus * b * h * h * h), 0.5 * modulus * b * h * h
        squared = coupling * l * l
        if push * squared > _WEAK_LIMIT:
            continue
        loads, laterals, weak = force, lateral, angles
        if pull * squared > _WEAK_LIMIT:
            loads, laterals, weak, strong = sorted_force, sorted_lateral, 0, angles
            for i in range(angles):
                if force[i] * squared <= _WEAK_LIMIT:
                    place, weak = weak, weak + 1
                else:
                    place = strong = strong - 1
                loads[place], laterals[place] = force[i], lateral[i]
        widest = greater(push, pull) * squared
        if not _weak_constants(
            loads, laterals, weak, -squared, widest, scale / l, l, rod_length, steps, series, moment, change, factor
        ):
            continue
        _weak_extremes(loads, weak, moment, change, factor, n, high, low)
        if weak < angles:
            _strong_extremes(loads, laterals, weak, coupling, scale, l, rod_length, n, high, low)
        area = b * h
        for fibre in range(2):
            for j in range(steps + 1):
                high[n, fibre, j] /= area
                low[n, fibre, j] /= area
        stands[n] = 1.0
    return stands


@kernel
def stress_envelope(
    force: Array, lateral: Array, modulus: float, b: float, h: float, l: float, rod_length: float,
    high: Array, low: Array,
) -> bool:  # fmt: skip
    """``stress_envelopes`` for one strip: high, low of shape (2, stations), contiguous; False if it buckles."""
    shape = (1, 2, high.shape[1])
    designs = np.array([[b, h, l]])
    stands = stress_envelopes(force, lateral, modulus, designs, rod_length, high.reshape(shape), low.reshape(shape))
    return stands[0] > 0.0


def warm_up() -> None:
    """Compile, or load from the cache, every kernel of this module."""
    force, lateral = np.linspace(-1.0, 1.0, 8), np.ones(8)
    high, low = np.empty((2, 13)), np.empty((2, 13))
    stress_envelope(force, lateral, 2e11, 9e-3, 5e-4, 2e-2, 4e-2, high, low)
    stress_envelopes(force, lateral, 2e11, np.array([[9e-3, 5e-4, 2e-2]]), 4e-2, high[np.newaxis], low[np.newaxis])
