"""Bounds of the curvature of a strip over a box of designs: the basis of the proof of global optimality.

With X = ln tau and Y = ln l, in the notation of ``core.bending``: g0, g1, g2 decrease with t up to the first buckling
root of the clamped-pinned column (x = 4.493), so their ranges over an interval of t are given by its ends. The ranges
of V'' and its derivatives follow by interval arithmetic. With the value at the centre and the mean value theorem they
give a plane whose error is quadratic in the size of the box:

    |V'' - (value + g_x dX + g_y dY)| <= w_x r_x + w_y r_y,

where g is the midpoint and w the half-width of a derivative's range, and r the half-size of the box. At the clamp, the
corners of a large box give a sharper range: C = V''(0) decreases with l; with tau it increases in tension and decreases
in compression, since C increases with q. Every range is widened by about 1e-12 of its magnitude against rounding.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.rod.optimum.core.bending import STRONG_TENSION, bessel, clamp, curvature
from solvers.rod.strip.buckling import FIRST_ROOT_LIMITS

Array = NDArray[np.float64]
Interval = tuple[float, float]

FIRST_ROOT_SQUARED = FIRST_ROOT_LIMITS[1] ** 2

_ROUNDING = 1e-12

VALUE, BY_X, BY_Y, ERROR, LOW, HIGH = range(6)
"""Rows of the bounds of V'' at each station: value, slopes and error of the plane, and the range."""

UNBOUNDED = 1e200
"""Stands for infinity where a product with zero must be zero."""


@kernel
def plus(a: Interval, b: Interval) -> Interval:
    """a + b."""
    return a[0] + b[0], a[1] + b[1]


@kernel
def times(a: Interval, b: Interval) -> Interval:
    """a b."""
    p, q, r, s = a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]
    return min(min(p, q), min(r, s)), max(max(p, q), max(r, s))


@kernel
def scaled(factor: float, a: Interval) -> Interval:
    """factor * a."""
    return times((factor, factor), a)


@kernel
def bending_over(force: float, modulus: float, rod_length: float, tau: Array, l: Array, eta: Array, out: Array) -> None:
    """Plane and range of V'' per unit stroke over a box for one axial force [N], shape (6, stations).

    ``tau`` and ``l`` contain lower end, centre and upper end of the box.
    """
    scale = 12.0 * force / modulus
    curvature(scale * tau[1], l[1], rod_length, eta, out[VALUE])
    # Corners at the clamp: C decreases with l; with tau it increases in tension and decreases in compression.
    first, last = (0, 2) if force > 0.0 else (2, 0)
    low, det = clamp(scale * tau[first], l[2], rod_length)
    high, _ = clamp(scale * tau[last], l[0], rod_length)
    # Beyond x = 4.493 the determinant may be positive again, between higher roots.
    if not (det > 0.0 and -scale * tau[2] * l[2] * l[2] < FIRST_ROOT_SQUARED):
        low, high = -UNBOUNDED, UNBOUNDED
    for j in range(eta.size):
        out[BY_X, j], out[BY_Y, j], out[ERROR, j] = 0.0, 0.0, UNBOUNDED
        # In tension V'' has one sign and decays from the clamp; otherwise no a-priori range is known.
        out[LOW, j], out[HIGH, j] = (0.0, high) if force > 0.0 else (-UNBOUNDED, UNBOUNDED)
    ends = -scale * tau[0] * l[0] * l[0], -scale * tau[2] * l[2] * l[2]
    t = min(ends[0], ends[1]), max(ends[0], ends[1])
    if low > -UNBOUNDED and t[0] >= STRONG_TENSION:
        interval_bounds(t, rod_length, tau, l, eta, out)
    out[LOW, 0], out[HIGH, 0] = max(out[LOW, 0], low), min(out[HIGH, 0], high)
    for j in range(eta.size):
        deviation = max(out[HIGH, j] - out[VALUE, j], out[VALUE, j] - out[LOW, j])
        if deviation < out[ERROR, j]:
            out[BY_X, j], out[BY_Y, j], out[ERROR, j] = 0.0, 0.0, deviation
        margin = _ROUNDING * max(abs(out[LOW, j]), abs(out[HIGH, j]))
        out[LOW, j], out[HIGH, j] = out[LOW, j] - margin, out[HIGH, j] + margin
        out[ERROR, j] += margin


@kernel
def interval_bounds(t: Interval, rod_length: float, tau: Array, l: Array, eta: Array, out: Array) -> None:
    """Planes and ranges of V'' at every station by interval arithmetic, unless the determinant may be zero."""
    rx, ry = 0.5 * math.log(tau[2] / tau[0]), 0.5 * math.log(l[2] / l[0])
    length, e = (l[0], l[2]), (rod_length - l[2], rod_length - l[0])
    cube, reach = (l[0] ** 3, l[2] ** 3), scaled(rod_length, times(e, length))
    least, most = bessel(t[1]), bessel(t[0])
    g0, g1, g2 = (least[0], most[0]), (least[1], most[1]), (least[2], most[2])
    det = plus(times(cube, g1), times(reach, g0))
    if det[0] <= 0.0:
        return
    inverse = 1.0 / det[1], 1.0 / det[0]
    det_x = scaled(-0.5, times(t, plus(times(cube, g2), times(reach, g1))))
    reach_y = scaled(rod_length, times(length, (e[0] - l[2], e[1] - l[0])))
    det_y = plus(scaled(2.0, det_x), plus(scaled(3.0, times(cube, g1)), times(reach_y, g0)))
    for j in range(eta.size):
        s = eta[j]
        T = scaled(s * s, t)
        if j > 0:
            least, most = bessel(T[1]), bessel(T[0])
        g0, g1 = (least[0], most[0]), (least[1], most[1])
        c0 = plus(g0, scaled(-1.0, times(T, g1)))
        y, rest = scaled(s, length), scaled(s - 1.0, length)
        V = times(plus(times(e, c0), times(y, g0)), inverse)
        N_x = scaled(-0.5, times(T, plus(times(e, g0), times(y, g1))))
        N_y = plus(times(rest, c0), scaled(-1.0, times(T, times(e, g0))))
        by_x = times(plus(N_x, scaled(-1.0, times(V, det_x))), inverse)
        by_y = times(plus(N_y, scaled(-1.0, times(V, det_y))), inverse)
        out[BY_X, j], out[BY_Y, j] = 0.5 * (by_x[0] + by_x[1]), 0.5 * (by_y[0] + by_y[1])
        out[ERROR, j] = 0.5 * (by_x[1] - by_x[0]) * rx + 0.5 * (by_y[1] - by_y[0]) * ry
        out[LOW, j], out[HIGH, j] = V
