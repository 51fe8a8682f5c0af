"""Functions of one turn that ripple: a smooth part on panels, and beside it modes in closed form.

    F(x) = f(x) + Re sum_n Z_n(x),   Z_n = start_n exp(phase_n(x)) (shape_n(x) . weights)

f is a polynomial on every panel (``solvers.numerics.panels``); phase and shape are polynomials on elements of their
own, so that a mode costs as much however fast it oscillates. The greatest F is looked for by halving intervals and
leaving out those that cannot hold it. In an interval of half width r about m, with the modes' frequencies w_n,

    F <= F(m) + |F'(m)| r + (max|f''| + sum |Z_n| w_n^2) r^2/2   and   F <= max f + sum max Re(Z_n exp(i t)), |t| <= w_n r

the former close where no mode turns far, the latter where all do. What the modes reach bounds from the start where the
greatest may be, so that a small ripple is looked at in narrow places alone.

Source: for the search, R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis (2009), chapter 5.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import fusing_kernel, kernel
from solvers.numerics.panels import Rule, greatest, panel_error
from solvers.numerics.radau import Radau

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

TURN = 2.0 * math.pi
_MARGIN = 1.2
"""On a mode's amplitude on an element, known at three of its points, and on the bend of f, known at a panel's."""
_ONE_TOP = 0.5
"""Radians of the fastest mode, in half an interval, that hold no more than one maximum."""
_NEGLIGIBLE = 0.3
"""Of the tolerance, that the fastest modes may be left out for."""
_DEEPEST = 200
_MOST_STEPS = 30
_PROBED = 3
_EPS = float(np.finfo(float).eps)


class Ripple(NamedTuple):
    """Modes on elements over one turn, with the points of ``rule`` in each.

    edges   (elements + 1,)
    start   (elements, modes), complex amplitudes at an element's first end
    phase   (elements, modes, points), complex, grown since there
    rate    (elements, modes, points), its derivative
    pace    (elements, modes), its greatest imaginary part
    shape   (elements, modes, points, 2, parts), real and imaginary parts of what weights are laid on
    probe   (elements, modes, 3, 2, parts), shape times amplitude at an element's first, middle and last point
    """

    edges: Array
    start: Complex
    phase: Complex
    rate: Complex
    pace: Array
    shape: Array
    probe: Array
    rule: Radau

    @property
    def modes(self) -> int:
        return self.start.shape[1]


def ripple_of(edges: Array, start: Complex, phase: Complex, shape: Complex, rule: Radau) -> Ripple:
    """From amplitudes (elements, modes), phases (elements, modes, points), shapes (elements, modes, points, parts)."""
    rate = np.ascontiguousarray(phase @ rule.first.T / np.diff(edges)[:, None, None])
    both = np.ascontiguousarray(np.stack([shape.real, shape.imag], axis=-2))
    few = [0, rule.points.size // 2, rule.points.size - 1]
    size = np.abs(start[:, :, None] * np.exp(phase[:, :, few].real))
    probe = np.ascontiguousarray(both[:, :, few] * size[..., None, None])
    pace = np.abs(rate.imag).max(axis=2, initial=0.0)
    return Ripple(edges, np.ascontiguousarray(start), np.ascontiguousarray(phase), rate, pace, both, probe, rule)


def no_ripple(parts: int, rule: Radau) -> Ripple:
    """No mode at all."""
    empty = np.empty((1, 0, rule.points.size, parts), np.complex128)
    return ripple_of(np.array([0.0, TURN]), empty[:, :, 0, 0], empty[..., 0], empty, rule)


@fusing_kernel
def reaches(ripple: Ripple, weights: Array) -> Array:
    """How far every mode reaches on every element, (elements, modes)."""
    elements, modes = ripple.start.shape
    out = np.zeros((elements, modes))
    if modes == 0:
        return out
    seen = np.dot(ripple.probe.reshape(elements * modes * _PROBED * 2, weights.size), weights)
    for e in range(elements):
        for n in range(modes):
            at = (e * modes + n) * _PROBED * 2
            for k in range(_PROBED):
                real, imag = seen[at + 2 * k], seen[at + 2 * k + 1]
                out[e, n] = max(out[e, n], real * real + imag * imag)
            out[e, n] = _MARGIN * math.sqrt(out[e, n])
    return out


@kernel
def ripple_at(ripple: Ripple, modes: int, weights: Array, angle: Array) -> Array:
    """What the first so many modes make of several weights (rows, parts) at angles: (rows, angles)."""
    out = np.zeros((weights.shape[0], angle.size))
    last, p = -1, ripple.rule.points.size
    shape, slope = np.empty((weights.shape[0], modes, p), np.complex128), np.empty((modes, p), np.complex128)
    share, z = np.empty(p), np.empty(modes, np.complex128)
    for i in range(angle.size):
        place = _place(ripple.edges, angle[i])
        e = _element(ripple.edges, place)
        if e != last:
            for row in range(weights.shape[0]):
                _weigh(ripple, weights[row], e, modes, shape[row], slope)
            last = e
        for row in range(weights.shape[0]):
            _modes_at(ripple, e, place, modes, shape[row], share, z)
            for n in range(modes):
                out[row, i] += z[n].real
    return out


@kernel
def _place(edges: Array, angle: float) -> float:
    """The angle in the turn that begins with the first element."""
    turns = (angle - edges[0]) / TURN
    return edges[0] + (turns - math.floor(turns)) * TURN


@kernel
def _element(edges: Array, place: float) -> int:
    return min(max(np.searchsorted(edges, place, side="right"), 1), edges.size - 1) - 1


@fusing_kernel
def _weigh(ripple: Ripple, weights: Array, e: int, modes: int, shape: Complex, slope: Complex) -> None:
    """An element's shapes with weights laid on them, and what the derivative has in their place, (modes, points)."""
    p, h = ripple.rule.points.size, ripple.edges[e + 1] - ripple.edges[e]
    for n in range(modes):
        for k in range(p):
            real, imag = 0.0, 0.0
            for b in range(weights.size):
                real += ripple.shape[e, n, k, 0, b] * weights[b]
                imag += ripple.shape[e, n, k, 1, b] * weights[b]
            shape[n, k] = complex(real, imag)
        for k in range(p):
            total = ripple.rate[e, n, k] * shape[n, k]
            for j in range(p):
                total += ripple.rule.first[k, j] / h * shape[n, j]
            slope[n, k] = total


@fusing_kernel
def _shares(ripple: Ripple, e: int, place: float, share: Array) -> None:
    """The shares that an element's points have in polynomials at a place."""
    x, total = (place - ripple.edges[e]) / (ripple.edges[e + 1] - ripple.edges[e]), 0.0
    for k in range(share.size):
        apart = x - ripple.rule.points[k]
        if apart == 0.0:
            share[:] = 0.0
            share[k] = 1.0
            return
        share[k] = ripple.rule.weights[k] / apart
        total += share[k]
    for k in range(share.size):
        share[k] /= total


@fusing_kernel
def _modes_at(ripple: Ripple, e: int, place: float, modes: int, shape: Complex, share: Array, z: Complex) -> None:
    """Z of the first so many modes."""
    _shares(ripple, e, place, share)
    for n in range(modes):
        real, imag, c, d = 0.0, 0.0, 0.0, 0.0
        for k in range(share.size):
            real += share[k] * ripple.phase[e, n, k].real
            imag += share[k] * ripple.phase[e, n, k].imag
            c += share[k] * shape[n, k].real
            d += share[k] * shape[n, k].imag
        z[n] = ripple.start[e, n] * math.exp(real) * complex(math.cos(imag), math.sin(imag)) * complex(c, d)


@fusing_kernel
def _slope_at(ripple: Ripple, e: int, modes: int, shape: Complex, slope: Complex, share: Array, z: Complex) -> float:
    """The derivative of what they make, from their Z and shares at the same place."""
    out = 0.0
    for n in range(modes):
        a, b, c, d = 0.0, 0.0, 0.0, 0.0
        for k in range(share.size):
            a += share[k] * shape[n, k].real
            b += share[k] * shape[n, k].imag
            c += share[k] * slope[n, k].real
            d += share[k] * slope[n, k].imag
        size = a * a + b * b
        if size > 0.0:
            # Z slope/shape, its real part.
            out += (z[n].real * (a * c + b * d) - z[n].imag * (a * d - b * c)) / size
    return out


class _Place(NamedTuple):
    """What is read at one panel and element: values and slopes of f by the angle, middle and half width of the panel,
    element, so many modes, their shapes and slopes, room for shares and Z."""

    f: Array
    slope: Array
    middle: float
    half: float
    e: int
    modes: int
    shape: Complex
    shape_slope: Complex
    share: Array
    z: Complex


@fusing_kernel
def _both(rule: Rule, ripple: Ripple, at: _Place, sign: float, x: float) -> tuple[float, float, float, float]:
    """f, its slope, and what the modes add to both at the angle x, all times ``sign``; leaves Z in its room."""
    u = (x - at.middle) / at.half
    below, value, steep, exact = 0.0, 0.0, 0.0, -1
    for j in range(rule.points.size):
        apart = u - rule.points[j]
        if apart == 0.0:
            exact = j
            break
        share = rule.weights[j] / apart
        below += share
        value += share * at.f[j]
        steep += share * at.slope[j]
    if exact >= 0:
        value, steep = at.f[exact], at.slope[exact]
    else:
        value, steep = value / below, steep / below
    # From the middle of the element's part, since ends of panels and elements meet.
    place = _place(ripple.edges, x)
    if place - ripple.edges[at.e] > 0.5 * TURN + ripple.edges[at.e + 1] - ripple.edges[at.e]:
        place -= TURN
    elif ripple.edges[at.e + 1] - place > 0.5 * TURN + ripple.edges[at.e + 1] - ripple.edges[at.e]:
        place += TURN
    _modes_at(ripple, at.e, place, at.modes, at.shape, at.share, at.z)
    more = _slope_at(ripple, at.e, at.modes, at.shape, at.shape_slope, at.share, at.z)
    ring = 0.0
    for n in range(at.modes):
        ring += at.z[n].real
    return sign * value, sign * steep, sign * ring, sign * more


@fusing_kernel
def _highest(z: complex, turn: float, reach: float) -> float:
    """The greatest real part of z exp(i t), |t| <= turn; ``reach`` where that is too far to know |z|."""
    if turn >= 0.5 * math.pi:
        return reach
    imag, c, s = abs(z.imag), math.cos(turn), math.sin(turn)
    ahead = imag * c - z.real * s
    # The turn leads past the real axis, or to its near side.
    return (math.hypot(z.real, imag) if ahead <= 0.0 and z.real > 0.0 else z.real * c + imag * s) + 0.1 * turn * reach


@fusing_kernel
def _top(
    rule: Rule, ripple: Ripple, at: _Place, sign: float, a: float, b: float, tolerance: float
) -> tuple[float, float]:
    """The greatest value and its angle in an interval that holds no more than one maximum."""
    f, df, g, dg = _both(rule, ripple, at, sign, a)
    left, best, x = df + dg, f + g, a
    f, df, g, dg = _both(rule, ripple, at, sign, b)
    right = df + dg
    if f + g > best:
        best, x = f + g, b
    if not (left > 0.0 and right < 0.0):
        return best, x
    bend = (left - right) / (b - a)
    for _ in range(_MOST_STEPS):
        middle = b - right * (b - a) / (right - left)
        f, df, g, dg = _both(rule, ripple, at, sign, middle)
        steep = df + dg
        if f + g > best:
            best, x = f + g, middle
        # A value misses its top by its slope squared over twice the bend.
        if steep * steep <= tolerance * bend or b - a <= 8.0 * _EPS * TURN:
            break
        if steep * right < 0.0:
            a, left = b, right
        else:
            left *= 0.5
        b, right = middle, steep
    return best, x


@fusing_kernel
def greatest_with_ripple(
    edges: Array, rule: Rule, f: Array, sign: float, tolerance: float, ripple: Ripple, weights: Array
) -> tuple[float, float, float]:
    """Greatest value of sign F over the turn, how far off it may be, and its angle; ``tolerance`` is absolute."""
    best, missed, where = greatest(edges, rule, f, sign, tolerance)
    if ripple.start.shape[1] == 0:
        return best, missed, where
    n, p = rule.points.size, ripple.rule.points.size
    reach = reaches(ripple, weights)
    elements, modes = reach.shape
    # The fastest modes may be left out where all of them do not reach far.
    left_out = 0.0
    while modes > 0:
        most = 0.0
        for e in range(elements):
            most = max(most, reach[e, modes - 1])
        if left_out + most > _NEGLIGIBLE * tolerance:
            break
        left_out += most
        modes -= 1
    if modes == 0:
        return best, missed + left_out, where
    tall, bends, pace = np.zeros(elements), np.zeros(elements), np.zeros(elements)
    for e in range(elements):
        for k in range(modes):
            tall[e] += reach[e, k]
            bends[e] += reach[e, k] * (ripple.pace[e, k] + 1.0) ** 2
            pace[e] = max(pace[e], ripple.pace[e, k])
    shape, shape_slope = np.empty((modes, p), np.complex128), np.empty((modes, p), np.complex128)
    share, z, slope = np.empty(p), np.empty(modes, np.complex128), np.empty(n)
    stack, enough = np.empty((_DEEPEST, 2)), 0.5 * tolerance
    best, top = -np.inf, -1
    # First the panel of the smooth part's own top, since what is found there leaves little to be looked at elsewhere.
    first = min(max(np.searchsorted(edges, where, side="right"), 1), edges.size - 1) - 1
    for turn in range(edges.size - 1):
        panel = first if turn == 0 else turn - 1 if turn <= first else turn
        g, a, b = f[panel * n : (panel + 1) * n], edges[panel], edges[panel + 1]
        middle, half = 0.5 * (a + b), 0.5 * (b - a)
        highest, jump = -np.inf, 0.0
        for j in range(n):
            highest = max(highest, sign * g[j])
            if j > 0:
                jump = max(jump, abs(g[j] - g[j - 1]))
        bend = -1.0
        begin = a
        while begin < b - 1e-9 * half:
            place = _place(ripple.edges, begin + 1e-9 * half)
            e = _element(ripple.edges, place)
            end = min(b, begin + 1e-9 * half + ripple.edges[e + 1] - place)
            start, begin = begin, end
            if highest + 0.5 * jump + tall[e] <= best + enough:
                continue
            if bend < 0.0:
                for j in range(n):
                    total = 0.0
                    for k in range(n):
                        total += rule.derivative[j, k] * g[k]
                    slope[j] = total / half
                for j in range(n):
                    total = 0.0
                    for k in range(n):
                        total += rule.derivative[j, k] * slope[k]
                    bend = max(bend, _MARGIN * abs(total) / half)
            _weigh(ripple, weights, e, modes, shape, shape_slope)
            at = _Place(g, slope, middle, half, e, modes, shape, shape_slope, share, z)
            for j in range(n - 1):
                low, high = middle + half * rule.points[j], middle + half * rule.points[j + 1]
                if high <= start or low >= end:
                    continue
                over = max(sign * g[j], sign * g[j + 1]) + 0.125 * bend * (high - low) ** 2
                if over + tall[e] <= best + enough:
                    continue
                stack[0, 0], stack[0, 1] = max(low, start), min(high, end)
                count = 1
                while count > 0:
                    count -= 1
                    low, high = stack[count, 0], stack[count, 1]
                    x, r = 0.5 * (low + high), 0.5 * (high - low)
                    value, steep, ring, more = _both(rule, ripple, at, sign, x)
                    if value + ring > best:
                        best, where, top = value + ring, x, panel
                    close = value + ring + abs(steep + more) * r + 0.5 * (bend + bends[e]) * r * r
                    far = value + abs(steep) * r + 0.5 * bend * r * r
                    for k in range(modes):
                        far += _highest(sign * z[k], ripple.pace[e, k] * r, reach[e, k])
                    if min(close, far) <= best + enough:
                        continue
                    if pace[e] * r <= _ONE_TOP or count + 2 > _DEEPEST:
                        found, place = _top(rule, ripple, at, sign, low, high, 0.1 * tolerance)
                        if found > best:
                            best, where, top = found, place, panel
                        continue
                    stack[count, 0], stack[count, 1] = low, x
                    stack[count + 1, 0], stack[count + 1, 1] = x, high
                    count += 2
    error = panel_error(f[top * n : (top + 1) * n], rule)
    return best, error + left_out + enough + 4.0 * _EPS * abs(best), where
