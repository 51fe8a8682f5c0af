"""Maximisation, root finding and quadrature in arbitrary precision."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import Any

import mpmath as mp

Number = Any
"""A float or a number of mpmath."""
Function = Callable[[Number], Number]


def unwatched() -> None:
    """The default watch, which never stops a calculation.

    A watch is called between steps and may raise an exception.
    """


def brent(f: Function, a: Number, m: Number, b: Number, tolerance: Number) -> tuple[Number, Number]:
    """(position, maximum) of f in (a, b) from an interior point m, by golden section and parabolic interpolation.

    Source: R. P. Brent, Algorithms for Minimization without Derivatives (1973).
    """
    golden = (3 - mp.sqrt(5)) / 2
    x = w = v = m
    fx = fw = fv = f(m)
    step = previous = mp.mpf(0)
    for _ in range(400):
        middle = (a + b) / 2
        if abs(x - middle) <= 2 * tolerance - (b - a) / 2:
            break
        parabolic = False
        if abs(previous) > tolerance:
            r, q = (x - w) * (fx - fv), (x - v) * (fx - fw)
            p = (x - v) * q - (x - w) * r
            q = 2 * (q - r)
            p, q = (-p, q) if q > 0 else (p, -q)
            if abs(p) < abs(q * previous / 2) and q * (a - x) < p < q * (b - x):
                previous, step, parabolic = step, p / q, True
        if not parabolic:
            previous = (a if x >= middle else b) - x
            step = golden * previous
        u = x + (step if abs(step) >= tolerance else tolerance * (1 if step > 0 else -1))
        fu = f(u)
        if fu >= fx:
            a, b = (x, b) if u >= x else (a, x)
            v, fv, w, fw, x, fx = w, fw, x, fx, u, fu
        else:
            a, b = (u, b) if u < x else (a, u)
            if fu >= fw or w == x:
                v, fv, w, fw = w, fw, u, fu
            elif fu >= fv or v in (x, w):
                v, fv = u, fu
    return x, fx


def refined_maximum(f: Function, a: Number, m: Number, b: Number) -> tuple[Number, Number]:
    """(position, maximum) of f in (a, b) from an interior point m.

    At a corner, where f is linear in the position, the position is located to twice as many digits.
    """
    width = b - a
    x, fx = brent(f, a, m, b, width * mp.mpf(10) ** -17)
    near = width * mp.mpf(10) ** -15
    decrease = max(fx - f(max(x - near, a)), fx - f(min(x + near, b)))
    if abs(decrease) > mp.mpf(10) ** -25 * abs(fx):
        x, fx = brent(f, max(x - 4 * near, a), x, min(x + 4 * near, b), width * mp.mpf(10) ** -34)
    return x, fx


def golden_section(f: Function, low: Number, high: Number, rounds: int) -> tuple[Number, Number]:
    """(position, maximum) of a unimodal f in an interval."""
    golden = (mp.sqrt(5) - 1) / 2
    a, b = high - golden * (high - low), low + golden * (high - low)
    fa, fb = f(a), f(b)
    for _ in range(rounds):
        if fa >= fb:
            high, b, fb = b, a, fa
            a = high - golden * (high - low)
            fa = f(a)
        else:
            low, a, fa = a, b, fb
            b = low + golden * (high - low)
            fb = f(b)
    return (a, fa) if fa >= fb else (b, fb)


def maximum(f: Function, grid: Sequence[Number], rounds: int) -> tuple[Number, Number]:
    """(position, maximum) of f over an ascending grid, refined by golden section between the neighbouring points."""
    values = [f(x) for x in grid]
    top = values.index(max(values))
    found = golden_section(f, grid[max(top - 1, 0)], grid[min(top + 1, len(grid) - 1)], rounds)
    return max((grid[top], values[top]), found, key=lambda pair: pair[1])


def find_root(f: Function, low: Number, high: Number) -> Number:
    """The root of f between two points of opposite sign, in the current precision, by the Illinois method.

    Source: M. Dowell, P. Jarratt, A modified regula falsi method (1971).
    """
    left, right = f(low), f(high)
    for _ in range(4 * mp.mp.dps):
        if left == right or not left or not right:
            break
        x = high - right * (high - low) / (right - left)
        value = f(x)
        if value * right < 0:
            low, left = high, right
        else:
            left /= 2
        change, high, right = abs(x - high), x, value
        if change <= abs(x) * mp.mpf(10) ** (2 - mp.mp.dps):
            break
    return high if abs(right) <= abs(left) else low


def local_maxima(values: Sequence[float], within: float) -> list[int]:
    """Indices of local maxima, ends included, at most a fraction ``within`` of the range below the maximum."""
    top, low = max(values), min(values)
    last = len(values) - 1
    return [
        i
        for i, value in enumerate(values)
        if value >= top - within * (top - low) and value >= values[max(i - 1, 0)] and value >= values[min(i + 1, last)]
    ]


@lru_cache(maxsize=32)
def _nodes(order: int, precision: int) -> tuple[tuple[Number, Number], ...]:
    with mp.workprec(precision + 10):
        return tuple(_legendre(order))


def _legendre(order: int) -> Iterator[tuple[Number, Number]]:
    """Nodes and weights of Gauss quadrature, by Newton's method on the Legendre polynomial."""
    for i in range(order):
        x = mp.cos(mp.pi * (i + mp.mpf(3) / 4) / (order + mp.mpf(1) / 2))
        for _ in range(10):
            p0, p1 = mp.mpf(1), x
            for n in range(2, order + 1):
                p0, p1 = p1, ((2 * n - 1) * x * p1 - (n - 1) * p0) / n
            slope = order * (x * p1 - p0) / (x * x - 1)
            x -= p1 / slope
        yield x, 2 / ((1 - x * x) * slope**2)


def gauss(low: Number, high: Number, order: int) -> list[tuple[Number, Number]]:
    """Points and weights of Gauss quadrature on an interval, in the current precision."""
    middle, half = (low + high) / 2, (high - low) / 2
    return [(middle + half * x, half * weight) for x, weight in _nodes(order, mp.mp.prec)]
