"""Oscillating contributions to a smooth function over one revolution: modes in closed form.

  Re sum_n Z_n(x),   Z_n = start_n exp(phase_n(x)) (shape_n(x) . weights)

Phase and shape are polynomials on elements of the revolution, so that the cost of a mode does not depend on its
frequency. Weights select which combination of a shape's parts is evaluated. For the maximum of a function with ripple,
see ``ripple_peaks``.
"""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np

from solvers.numerics.arrays import Array, Complex
from solvers.numerics.jit import fusing_kernel, kernel
from solvers.numerics.radau import Radau, interpolation_weights, radau

TURN = 2.0 * math.pi
_MARGIN = 1.2
"""Safety factor on the amplitude of a mode on an element, sampled at three points."""
_PROBES = 3
KINDS = 6
"""Columns of a table per mode."""


class Ripple(NamedTuple):
    """Modes on elements over one revolution, at the points of a rule in each.

    edges      (elements + 1,)
    start      (elements, modes), complex amplitudes at an element's start
    phase      (elements, modes, points), complex, accumulated from there
    rate       (elements, modes, points), its derivative
    frequency  (elements, modes), largest imaginary part of the rate
    shape      (elements, modes, points, 2, parts), real and imaginary parts to which weights are applied
    probe      (elements, modes, 3, 2, parts), shape times amplitude at an element's first, middle and last point

    and of the elements' rule its points, their weights and the matrix of first derivatives (``radau``).
    """

    edges: Array
    start: Complex
    phase: Complex
    rate: Complex
    frequency: Array
    shape: Array
    probe: Array
    points: Array
    weights: Array
    first: Array

    @property
    def modes(self) -> int:
        return self.start.shape[1]


@kernel
def ripple_of(edges: Array, start: Complex, phase: Complex, shape: Array, rule: Radau) -> Ripple:
    """Build from amplitudes (elements, modes), phases (elements, modes, points) and shapes (elements, modes, points, 2,
    parts)."""
    count, modes, p, _, parts = shape.shape
    rate, frequency = np.zeros((count, modes, p), np.complex128), np.zeros((count, modes))
    probe = np.empty((count, modes, _PROBES, 2, parts))
    for e in range(count):
        for n in range(modes):
            for i in range(p):
                for k in range(p):
                    rate[e, n, i] += rule.first[i, k] / (edges[e + 1] - edges[e]) * phase[e, n, k]
                frequency[e, n] = max(frequency[e, n], abs(rate[e, n, i].imag))
            for k in range(_PROBES):
                i = (0, p // 2, p - 1)[k]
                size = abs(start[e, n]) * math.exp(phase[e, n, i].real)
                for side in range(2):
                    for part in range(parts):
                        probe[e, n, k, side, part] = shape[e, n, i, side, part] * size
    return Ripple(edges, start, phase, rate, frequency, shape, probe, rule.points, rule.weights, rule.first)


def no_ripple(parts: int, rule: Radau) -> Ripple:
    """A ripple without modes."""
    return _empty_ripple(parts, rule.points.size - 1)


@cache
def _empty_ripple(parts: int, stages: int) -> Ripple:
    rule, none = radau(stages), np.empty((1, 0), np.complex128)
    p, edges = rule.points.size, np.array([0.0, TURN])
    phase, shape = np.empty((1, 0, p), np.complex128), np.empty((1, 0, p, 2, parts))
    probe = np.empty((1, 0, _PROBES, 2, parts))
    return Ripple(edges, none, phase, phase, np.empty((1, 0)), shape, probe, rule.points, rule.weights, rule.first)


@kernel
def amplitude_bounds(ripple: Ripple, weights: Array) -> Array:
    """Amplitude bound of every mode on every element, (elements, modes)."""
    elements, modes = ripple.start.shape
    bounds = np.zeros((elements, modes))
    if modes == 0:
        return bounds
    weighted = np.dot(ripple.probe.reshape(elements * modes * _PROBES * 2, weights.size), weights)
    for e in range(elements):
        for n in range(modes):
            start = (e * modes + n) * _PROBES * 2
            for k in range(_PROBES):
                real, imag = weighted[start + 2 * k], weighted[start + 2 * k + 1]
                bounds[e, n] = max(bounds[e, n], real * real + imag * imag)
            bounds[e, n] = _MARGIN * math.sqrt(bounds[e, n])
    return bounds


@kernel
def ripple_at(ripple: Ripple, modes: int, weights: Array, angle: Array) -> Array:
    """Contribution of the first ``modes`` modes for several weights (rows, parts) at angles: (rows, angles)."""
    rows, p = weights.shape[0], ripple.points.size
    out, last = np.zeros((rows, angle.size)), -1
    table, interpolated, z = np.empty((rows, p, KINDS * modes)), np.empty(KINDS * modes), np.empty((2, modes))
    share = np.empty(p)
    for i in range(angle.size):
        position = _position(ripple, angle[i])
        e = element_at(ripple, position)
        for row in range(rows):
            if e != last:
                tabulate(ripple, weights[row], e, modes, table[row])
            out[row, i] = modes_at(ripple, e, position, table[row], share, interpolated, z)[0]
        last = e
    return out


@kernel
def parts_at(ripple: Ripple, angle: Array) -> Array:
    """Contribution of all modes to every part at angles: (parts, angles)."""
    modes, p, parts = ripple.shape.shape[1], ripple.shape.shape[2], ripple.shape.shape[4]
    out, row, share = np.zeros((parts, angle.size)), np.empty(parts), np.empty(p)
    for i in range(angle.size if modes > 0 else 0):
        position = _position(ripple, angle[i])
        e = element_at(ripple, position)
        x = (position - ripple.edges[e]) / (ripple.edges[e + 1] - ripple.edges[e])
        interpolation_weights(ripple.points, ripple.weights, x, share)
        row[:] = 0.0
        for n in range(modes):
            factor = 0.0j
            for k in range(p):
                factor += share[k] * ripple.phase[e, n, k]
            factor = ripple.start[e, n] * np.exp(factor)
            for k in range(p):
                real, imag = share[k] * factor.real, share[k] * factor.imag
                for b in range(parts):
                    row[b] += real * ripple.shape[e, n, k, 0, b] - imag * ripple.shape[e, n, k, 1, b]
        for b in range(parts):
            out[b, i] = row[b]
    return out


@kernel
def _position(ripple: Ripple, angle: float) -> float:
    """The angle modulo a revolution, in the one that starts at the first element."""
    turns = (angle - ripple.edges[0]) / TURN
    return ripple.edges[0] + (turns - math.floor(turns)) * TURN


@kernel
def element_at(ripple: Ripple, position: float) -> int:
    """The element of an angle within the revolution that starts at the first element."""
    return min(max(np.searchsorted(ripple.edges, position, side="right"), 1), ripple.edges.size - 1) - 1


@fusing_kernel
def tabulate(ripple: Ripple, weights: Array, e: int, modes: int, table: Array) -> None:
    """Fill ``table`` (points, 6 modes) with what is interpolated on an element: real and imaginary parts of the phases,
    of the weighted shapes, and of their derivatives including the phase's."""
    p, h = ripple.points.size, ripple.edges[e + 1] - ripple.edges[e]
    weighted = np.dot(ripple.shape[e, :modes].reshape(modes * p * 2, weights.size), weights)
    for k in range(p):
        for n in range(modes):
            table[k, n], table[k, modes + n] = ripple.phase[e, n, k].real, ripple.phase[e, n, k].imag
            at = 2 * (n * p + k)
            table[k, 2 * modes + n], table[k, 3 * modes + n] = weighted[at], weighted[at + 1]
    shape, slope = table[:, 2 * modes : 4 * modes], table[:, 4 * modes :]
    for k in range(p):
        for n in range(modes):
            rate = ripple.rate[e, n, k]
            slope[k, n] = rate.real * shape[k, n] - rate.imag * shape[k, modes + n]
            slope[k, modes + n] = rate.real * shape[k, modes + n] + rate.imag * shape[k, n]
        for j in range(p):
            share = ripple.first[k, j] / h
            for n in range(2 * modes):
                slope[k, n] += share * shape[j, n]


@fusing_kernel
def modes_at(
    ripple: Ripple, e: int, position: float, table: Array, share: Array, interpolated: Array, z: Array
) -> tuple[float, float]:
    """The modes' sum and its derivative; ``z`` (2, modes) receives real and imaginary parts of every Z."""
    modes, p = z.shape[1], share.size
    interpolation_weights(
        ripple.points, ripple.weights, (position - ripple.edges[e]) / (ripple.edges[e + 1] - ripple.edges[e]), share
    )
    interpolated[:] = 0.0
    for k in range(p):
        for i in range(interpolated.size):
            interpolated[i] += share[k] * table[k, i]
    value, slope = 0.0, 0.0
    for n in range(modes):
        factor, angle = math.exp(interpolated[n]), interpolated[modes + n]
        c, s = factor * math.cos(angle), factor * math.sin(angle)
        start = ripple.start[e, n]
        c, s = c * start.real - s * start.imag, c * start.imag + s * start.real
        a, b = interpolated[2 * modes + n], interpolated[3 * modes + n]
        z[0, n], z[1, n] = c * a - s * b, c * b + s * a
        value += z[0, n]
        slope += c * interpolated[4 * modes + n] - s * interpolated[5 * modes + n]
    return value, slope
