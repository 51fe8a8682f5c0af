"""The first mode's own motion over a periodic revolution: a'' + eta Omega a' + Omega(phi)^2 a = -c''.

It is solved exactly on steps with constant Omega and linear c''. The periodic closure depends on the phase after a
revolution, which is shifted toward resonance by its uncertainty.

Source: G. Floquet (1883).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel

Array = NDArray[np.float64]

_PHASE_ERROR, _PHASE_SHARE, _UNKNOWN = 0.03, 3e-4, 0.2
"""Uncertainty of the first mode's phase after a revolution: absolute [rad] and relative; if it is unknown, the minimum
assumed |sin| of half the phase, which holds in seven of eight cases."""

_TURN = 2.0 * math.pi
_MIN_SINE = 1e-3
_UNEVEN = 4.0
_LEAST_KEPT = 1e-200


class Phase(NamedTuple):
    """``sine``, ``nearer`` and ``detuning`` of ``inertia.Motion``."""

    sine: float
    nearer: float
    detuning: float


@kernel
def own_motion(
    angle: Array, share: Array, pace: Array, ends: NDArray[np.bool_], loss: float, smooth: bool, nearer: float
) -> tuple[Array, Array, Array, Phase]:
    """a at increasing angles of one revolution, from c and Omega there; what it would be without ringing, of both
    sides of a jump the greater; the amplitude of its free vibration; and its phase.

    For a ``smooth`` load c'' is continuous, and the angles are uniform; otherwise it has jumps, at the ``ends`` of the
    load's pieces.
    """
    n = angle.size
    width, begin, end, kick = np.empty(n), np.empty(n), np.empty(n), np.zeros(n)
    for i in range(n):
        width[i] = (angle[i + 1] if i < n - 1 else angle[0] + _TURN) - angle[i]
    if smooth:
        for i in range(n):
            a, b = share[i - 2 if i > 1 else n + i - 2], share[i - 1 if i > 0 else n - 1]
            d, e = share[(i + 1) % n], share[(i + 2) % n]
            begin[i] = (16.0 * (b + d) - a - e - 30.0 * share[i]) / (12.0 * width[i] * width[i])
        for i in range(n):
            end[i] = begin[(i + 1) % n]
    else:
        _fill_curvatures(angle, share, width, ends, begin, end, kick)
    # Per step: Omega, half the rate of decay, and the cosine and sine of the damped phase times the decay over the
    # step.
    turn, slower = np.empty((4, n)), math.sqrt(1.0 - 0.25 * loss * loss)
    for i in range(n):
        w = 0.5 * (pace[i] + pace[(i + 1) % n])
        kept = math.exp(-0.5 * loss * w * width[i])
        turn[0, i], turn[1, i] = w, 0.5 * loss * w
        turn[2, i], turn[3, i] = kept * math.cos(slower * w * width[i]), kept * math.sin(slower * w * width[i])
    # d and d' after a revolution: forced from rest, and free from unit initial values.
    forced, first, second = np.zeros(2), np.array([1.0, 0.0]), np.array([0.0, 1.0])
    for i in range(n):
        forced[1] -= kick[i]
        _advance(forced, turn[:, i], width[i], begin[i], end[i])
        _advance(first, turn[:, i], width[i], 0.0, 0.0)
        _advance(second, turn[:, i], width[i], 0.0, 0.0)
    # (I - M)^-1 = adj(I - M)/(1 - tr M + det M), where det M = k^2 and tr M = 2 k cos theta; theta is the phase and k
    # the decay over a revolution. The divisor is |1 - k exp(i theta)|^2.
    phase = (pace * width).sum()
    kept = max(math.exp(-0.5 * loss * phase), _LEAST_KEPT)
    left = 1.0 - first[0] - second[1] + kept * kept
    sine = max(0.5 * math.sqrt(max((left - (1.0 - kept) ** 2) / kept, 0.0)), _MIN_SINE)
    certain = max(sine - nearer, _MIN_SINE) if nearer >= 0.0 else certain_sine(sine, phase)
    scale = 1.0 / (divisor(kept, sine) * divisor(kept, certain))
    state, out, still, free = np.empty(2), np.empty(n), np.empty(n), np.empty(n)
    state[0] = scale * ((1.0 - second[1]) * forced[0] + second[0] * forced[1])
    state[1] = scale * (first[1] * forced[0] + (1.0 - first[0]) * forced[1])
    for i in range(n):
        state[1] -= kick[i]
        y, v = _free_part(state, turn[:, i], width[i], begin[i], end[i])
        before = end[i - 1 if i > 0 else n - 1]
        still[i] = -(begin[i] if abs(begin[i]) >= abs(before) else before) / pace[i] ** 2
        out[i], free[i] = state[0], math.hypot(y, (v + turn[1, i] * y) / (slower * turn[0, i]))
        _advance(state, turn[:, i], width[i], begin[i], end[i])
    # 1/divisor changes with the sine by sine/(width^2 + sine^2) of itself, at most where it is the width.
    width = 0.5 * (1.0 - kept) / math.sqrt(kept)
    steepest = min(max(width, certain), max(sine, certain))
    return out, still, free, Phase(sine, sine - certain, steepest / (width * width + steepest * steepest))


@kernel
def _fill_curvatures(
    angle: Array, share: Array, width: Array, ends: NDArray[np.bool_], begin: Array, end: Array, kick: Array
) -> None:
    """c'' at the begin and the end of each interval, linear in it.

    It is that of the cubic through four values of the same piece of the load; where there are fewer, of the cubic
    through the interval's values and slopes.
    """
    n = share.size
    slope = np.empty(n)
    for i in range(n):
        h, g = width[i - 1 if i > 0 else n - 1], width[i]
        rise, follow = share[i] - share[i - 1 if i > 0 else n - 1], share[(i + 1) % n] - share[i]
        slope[i] = (rise / h * g + follow / g * h) / (h + g)
        if max(h, g) > _UNEVEN * min(h, g):
            # Next to a jump the parabola through three values overshoots; the true slope is limited by the secants.
            most = 3.0 * min(abs(rise) / h, abs(follow) / g)
            slope[i] = min(max(slope[i], -most), most)
    for i in range(n):
        h, j = width[i], (i + 1) % n
        secant = (share[j] - share[i]) / h
        begin[i] = (6.0 * secant - 4.0 * slope[i] - 2.0 * slope[j]) / h
        end[i] = (-6.0 * secant + 2.0 * slope[i] + 4.0 * slope[j]) / h
    at, value, before, after = np.empty(4), np.empty(4), np.zeros(n), np.zeros(n)
    for i in range(n):
        first, last = i, i + 1
        while last - first < 3 and not (ends[first % n] and ends[last % n]):
            if not ends[first % n] and (i - first <= last - i - 1 or ends[last % n]):
                first -= 1
            else:
                last += 1
        if last - first < 3:
            continue
        for k in range(4):
            j = first + k
            at[k] = angle[j % n] + _TURN * (j // n) - angle[i]
            value[k] = share[j % n]
        # Divided differences.
        for order in range(1, 4):
            for k in range(3, order - 1, -1):
                value[k] = (value[k] - value[k - 1]) / (at[k] - at[k - order])
        begin[i] = 2.0 * value[2] - 2.0 * value[3] * (at[0] + at[1] + at[2])
        end[i] = begin[i] + 6.0 * value[3] * width[i]
        before[i] = value[1] - value[2] * (at[0] + at[1]) + value[3] * (at[0] * at[1] + at[0] * at[2] + at[1] * at[2])
        after[i] = before[i] + 0.5 * (begin[i] + end[i]) * width[i]
    for i in range(n):
        j = i - 1 if i > 0 else n - 1
        if ends[i] and before[i] != 0.0 and after[j] != 0.0:
            kick[i] = before[i] - after[j]


@kernel
def divisor(kept: float, sine: float) -> float:
    """|1 - k exp(i theta)| from k and |sin(theta/2)|."""
    return math.sqrt((1.0 - kept) ** 2 + 4.0 * kept * sine * sine)


@kernel
def certain_sine(sine: float, phase: float) -> float:
    """|sin| of half the phase [rad] after a revolution, reduced by its uncertainty."""
    error = _PHASE_ERROR + _PHASE_SHARE * phase
    return max(sine - 0.5 * error, min(sine - 0.5 * _PHASE_ERROR, _UNKNOWN), _MIN_SINE)


@kernel
def _free_part(state: Array, turn: Array, width: float, begin: float, end: float) -> tuple[float, float]:
    """d and d' less the particular solution -c''/w^2 + 2 g c'''/w^4 at the step's begin."""
    square = turn[0] * turn[0]
    slope = (end - begin) / width
    return state[0] + (begin - 2.0 * turn[1] * slope / square) / square, state[1] + slope / square


@kernel
def _advance(state: Array, turn: Array, width: float, begin: float, end: float) -> None:
    """One step of d'' + 2 g d' + w^2 d = -c'' with c'' from ``begin`` to ``end``; ``turn``: w, g, and the cosine and
    sine of the damped phase times exp(-g width)."""
    g, cosine, sine = turn[1], turn[2], turn[3]
    square, slower = turn[0] * turn[0], math.sqrt(turn[0] * turn[0] - g * g)
    slope = (end - begin) / width
    y, v = _free_part(state, turn, width, begin, end)
    state[0] = y * cosine + (v + g * y) / slower * sine - (end - 2.0 * g * slope / square) / square
    state[1] = v * cosine - (square * y + g * v) / slower * sine - slope / square
