"""Periodic response of the first mode over a revolution: a'' + eta Omega a' + Omega(phi)^2 a = -c''.

The equation is solved exactly on steps with constant Omega and linear c''. The periodicity condition depends on the
mode's phase after a revolution, which is shifted toward resonance by its uncertainty.

Source: G. Floquet (1883).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.periodic import TURN

_PHASE_ERROR, _PHASE_SHARE, _UNKNOWN_PHASE_SINE = 0.03, 3e-4, 0.2
"""Uncertainty of the first mode's phase after a revolution: absolute [rad] and relative; if the phase is unknown, the
assumed minimum of |sin| of half of it, which holds in seven of eight cases."""

_MIN_SINE = 1e-3
_MAX_STEP_RATIO = 4.0
"""Ratio of neighbouring steps up to which the parabola through three values is trusted for their slope."""
_MIN_DECAY = 1e-200


class Phase(NamedTuple):
    """The first mode's phase after a revolution.

    sine              |sin| of half of it
    sine_sensitivity  maximum relative change of the ringing per change of the sine within its uncertainty
    """

    sine: float
    sine_sensitivity: float


@kernel
def first_mode_response(
    angle: Array, projection: Array, frequency: Array, ends: NDArray[np.bool_], loss: float, smooth: bool
) -> tuple[Array, Array, Phase]:
    """Return the periodic response a at increasing angles of one revolution, the amplitude of its free vibration, and
    its phase, from c (``projection``) and Omega there.

    For a ``smooth`` load c'' is continuous and the angles are uniform; otherwise c'' has jumps where a piece of the
    load ``ends``.
    """
    n = angle.size
    width, start, end, slope_jump = np.empty(n), np.empty(n), np.empty(n), np.zeros(n)
    for i in range(n):
        width[i] = (angle[i + 1] if i < n - 1 else angle[0] + TURN) - angle[i]
    if smooth:
        for i in range(n):
            a, b = projection[i - 2 if i > 1 else n + i - 2], projection[i - 1 if i > 0 else n - 1]
            d, e = projection[(i + 1) % n], projection[(i + 2) % n]
            start[i] = (16.0 * (b + d) - a - e - 30.0 * projection[i]) / (12.0 * width[i] * width[i])
        for i in range(n):
            end[i] = start[(i + 1) % n]
    else:
        _fill_second_derivatives(angle, projection, width, ends, start, end, slope_jump)
    # Rows, per step: Omega, half the decay rate, and the cosine and sine of the damped phase times the decay over the
    # step.
    steps, damped_ratio = np.empty((4, n)), math.sqrt(1.0 - 0.25 * loss * loss)
    for i in range(n):
        omega = 0.5 * (frequency[i] + frequency[(i + 1) % n])
        decay = math.exp(-0.5 * loss * omega * width[i])
        steps[0, i], steps[1, i] = omega, 0.5 * loss * omega
        damped_phase = damped_ratio * omega * width[i]
        steps[2, i], steps[3, i] = decay * math.cos(damped_phase), decay * math.sin(damped_phase)
    # a and a' after a revolution: forced from rest, and free from unit initial values, the columns of the monodromy
    # matrix M.
    forced, first, second = np.zeros(2), np.array([1.0, 0.0]), np.array([0.0, 1.0])
    for i in range(n):
        forced[1] -= slope_jump[i]
        _advance(forced, steps[:, i], width[i], start[i], end[i])
        _advance(first, steps[:, i], width[i], 0.0, 0.0)
        _advance(second, steps[:, i], width[i], 0.0, 0.0)
    # Periodicity: (I - M)^-1 = adj(I - M)/(1 - tr M + det M), where det M = k^2 and tr M = 2 k cos theta; theta is the
    # phase and k the decay over a revolution. The determinant is |1 - k exp(i theta)|^2.
    phase = (frequency * width).sum()
    decay = max(math.exp(-0.5 * loss * phase), _MIN_DECAY)
    determinant = 1.0 - first[0] - second[1] + decay * decay
    sine = max(0.5 * math.sqrt(max((determinant - (1.0 - decay) ** 2) / decay, 0.0)), _MIN_SINE)
    reduced_sine = _conservative_sine(sine, phase)
    scale = 1.0 / (_closure_divisor(decay, sine) * _closure_divisor(decay, reduced_sine))
    motion, response, amplitude = np.empty(2), np.empty(n), np.empty(n)
    motion[0] = scale * ((1.0 - second[1]) * forced[0] + second[0] * forced[1])
    motion[1] = scale * (first[1] * forced[0] + (1.0 - first[0]) * forced[1])
    for i in range(n):
        motion[1] -= slope_jump[i]
        y, v = _free_vibration(motion, steps[:, i], width[i], start[i], end[i])
        response[i], amplitude[i] = motion[0], math.hypot(y, (v + steps[1, i] * y) / (damped_ratio * steps[0, i]))
        _advance(motion, steps[:, i], width[i], start[i], end[i])
    # The derivative of 1/_closure_divisor by the sine is sine/(width^2 + sine^2) of itself, largest where the sine is
    # the width.
    width = 0.5 * (1.0 - decay) / math.sqrt(decay)
    steepest = min(max(width, reduced_sine), max(sine, reduced_sine))
    sensitivity = steepest / (width * width + steepest * steepest)
    return response, amplitude, Phase(sine, sensitivity)


@kernel
def _fill_second_derivatives(
    angle: Array, projection: Array, width: Array, ends: NDArray[np.bool_], start: Array, end: Array, jump: Array
) -> None:
    """Fill in c'' at the ``start`` and ``end`` of each interval, linear in between, and the jump of c' at each angle.

    Each is taken from the cubic through four values within one piece of the load or, if the piece has fewer, from the
    cubic through the interval's values and slopes.
    """
    n = projection.size
    slope = np.empty(n)
    for i in range(n):
        h, g = width[i - 1 if i > 0 else n - 1], width[i]
        rise, next_rise = projection[i] - projection[i - 1 if i > 0 else n - 1], projection[(i + 1) % n] - projection[i]
        slope[i] = (rise / h * g + next_rise / g * h) / (h + g)
        if max(h, g) > _MAX_STEP_RATIO * min(h, g):
            # Next to a jump the parabola through three values overshoots; the true slope is limited by the secants.
            limit = 3.0 * min(abs(rise) / h, abs(next_rise) / g)
            slope[i] = min(max(slope[i], -limit), limit)
    for i in range(n):
        h, j = width[i], (i + 1) % n
        secant = (projection[j] - projection[i]) / h
        start[i] = (6.0 * secant - 4.0 * slope[i] - 2.0 * slope[j]) / h
        end[i] = (-6.0 * secant + 2.0 * slope[i] + 4.0 * slope[j]) / h
    x, value, slope_start, slope_end = np.empty(4), np.empty(4), np.zeros(n), np.zeros(n)
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
            x[k] = angle[j % n] + TURN * (j // n) - angle[i]
            value[k] = projection[j % n]
        # Divided differences.
        for order in range(1, 4):
            for k in range(3, order - 1, -1):
                value[k] = (value[k] - value[k - 1]) / (x[k] - x[k - order])
        start[i] = 2.0 * value[2] - 2.0 * value[3] * (x[0] + x[1] + x[2])
        end[i] = start[i] + 6.0 * value[3] * width[i]
        slope_start[i] = value[1] - value[2] * (x[0] + x[1]) + value[3] * (x[0] * x[1] + x[0] * x[2] + x[1] * x[2])
        slope_end[i] = slope_start[i] + 0.5 * (start[i] + end[i]) * width[i]
    for i in range(n):
        j = i - 1 if i > 0 else n - 1
        if ends[i] and slope_start[i] != 0.0 and slope_end[j] != 0.0:
            jump[i] = slope_start[i] - slope_end[j]


@kernel
def _closure_divisor(decay: float, sine: float) -> float:
    """|1 - k exp(i theta)|, whose inverse is the amplification by the periodicity condition, from the decay k and
    |sin(theta/2)|."""
    return math.sqrt((1.0 - decay) ** 2 + 4.0 * decay * sine * sine)


@kernel
def _conservative_sine(sine: float, phase: float) -> float:
    """Return |sin| of half the phase [rad] after a revolution, reduced by the uncertainty of the phase."""
    error = _PHASE_ERROR + _PHASE_SHARE * phase
    return max(sine - 0.5 * error, min(sine - 0.5 * _PHASE_ERROR, _UNKNOWN_PHASE_SINE), _MIN_SINE)


@kernel
def _free_vibration(motion: Array, step: Array, width: float, start: float, end: float) -> tuple[float, float]:
    """Return a and a' at the start of a step, less the particular solution -c''/w^2 + 2 g c'''/w^4."""
    square = step[0] * step[0]
    slope = (end - start) / width
    return motion[0] + (start - 2.0 * step[1] * slope / square) / square, motion[1] + slope / square


@kernel
def _advance(motion: Array, step: Array, width: float, start: float, end: float) -> None:
    """Advance a and a' by one step of a'' + 2 g a' + w^2 a = -c'' with c'' linear from ``start`` to ``end``; ``step``
    holds w, g, and the cosine and sine of the damped phase times exp(-g width)."""
    g, cosine, sine = step[1], step[2], step[3]
    square, damped = step[0] * step[0], math.sqrt(step[0] * step[0] - g * g)
    slope = (end - start) / width
    y, v = _free_vibration(motion, step, width, start, end)
    motion[0] = y * cosine + (v + g * y) / damped * sine - (end - 2.0 * g * slope / square) / square
    motion[1] = v * cosine - (square * y + g * v) / damped * sine - slope / square
