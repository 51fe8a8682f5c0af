"""Bounds of the curvature of a strip over a box of designs: the basis of the proof of global optimality.

With q = 12 P tau/E, tau = 1/(b h^3), t = -q l^2 and

    g0 = c1 = j0(x),  g1 = c2 - c3 = j1(x)/x,  g2 = j2(x)/x^2,   x = sqrt(t),   dg_n/dt = -g_{n+1}/2,

j_n the spherical Bessel functions and e = L - l, the curvature of ``strip.beam_column`` is, at y = eta l from the head,

    V'' = N/det,  N = e c0 + y g0,  c0 = g0 - T g1 = cos x (all at T = eta^2 t),  det = l^3 g1 + e L l g0.

g0, g1, g2 decrease with t up to the first buckling root of the clamped-pinned column (x = 4.493), so their ranges over
an interval of t are given by its ends. With X = ln tau and Y = ln l, the ranges
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

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.rod.strip.beam_column import constants
from solvers.rod.strip.buckling import FIRST_ROOT_LIMITS
from solvers.rod.strip.shape import bend_at

Interval = tuple[float, float]

FIRST_ROOT_SQUARED = FIRST_ROOT_LIMITS[1] ** 2

_ROUNDING = 1e-12

VALUE, BY_X, BY_Y, ERROR, LOW, HIGH = range(6)
"""Rows of the bounds of V'' at each station: value, slopes and error of the plane, and the range."""

UNBOUNDED = 1e200
"""Stands for infinity where a product with zero must be zero."""


_SERIES_LIMIT = 1.0
_TERMS = 12
_COEFFICIENTS = np.zeros((3, _TERMS))
for _n in range(3):
    for _j in range(_TERMS):
        # j_n(x)/x^n = sum (-x^2/2)^j / (j! (2n+2j+1)!!)
        _odd = math.prod(range(1, 2 * _n + 2 * _j + 2, 2))
        _COEFFICIENTS[_n, _j] = (-0.5) ** _j / (math.factorial(_j) * _odd)

STRONG_TENSION = -400.0
"""t below which (strong tension) decaying exponentials replace the closed forms."""


@kernel
def bessel(t: float) -> tuple[float, float, float]:
    """g0, g1, g2 at t, for t from STRONG_TENSION to 20.2."""
    if abs(t) <= _SERIES_LIMIT:
        g0, g1, g2 = _COEFFICIENTS[0, _TERMS - 1], _COEFFICIENTS[1, _TERMS - 1], _COEFFICIENTS[2, _TERMS - 1]
        for j in range(_TERMS - 2, -1, -1):
            g0, g1, g2 = _COEFFICIENTS[0, j] + t * g0, _COEFFICIENTS[1, j] + t * g1, _COEFFICIENTS[2, j] + t * g2
        return g0, g1, g2
    if t > 0:
        x = math.sqrt(t)
        g0, c0 = math.sin(x) / x, math.cos(x)
    else:
        x = math.sqrt(-t)
        exponential = math.exp(x)
        g0, c0 = 0.5 * (exponential - 1.0 / exponential) / x, 0.5 * (exponential + 1.0 / exponential)
    g1 = (g0 - c0) / t
    return g0, g1, (3.0 * g1 - g0) / t


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
    """Plane and range of V'' per unit lateral displacement over a box for one axial force [N], shape (6, stations).

    ``tau`` and ``l`` contain lower end, centre and upper end of the box.
    """
    scale = 12.0 * force / modulus
    q, _, bent, shear, head = constants(scale * tau[1], l[1], rod_length, 0.0)
    for j in range(eta.size):
        out[VALUE, j] = bend_at(q, bent, shear, head, l[1], (1.0 - eta[j]) * l[1])[0]
    # Corners at the clamp: C decreases with l; with tau it increases in tension and decreases in compression.
    first, last = (0, 2) if force > 0.0 else (2, 0)
    _, _, low, _, head = constants(scale * tau[first], l[2], rod_length, 0.0)
    _, _, high, _, _ = constants(scale * tau[last], l[0], rod_length, 0.0)
    # The curvature at the head has the sign of the determinant, which beyond x = 4.493 may be positive again, between
    # higher roots.
    if not (head >= 0.0 and -scale * tau[2] * l[2] * l[2] < FIRST_ROOT_SQUARED):
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
