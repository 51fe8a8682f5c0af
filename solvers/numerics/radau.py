"""Radau collocation on one element [0, 1]: points and matrices acting on values there.

The points are the element's start and the Radau points, the last of which is its end; the method has order 2 s - 1 for
s Radau points and damps what its steps cannot resolve.

Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.5; for the barycentric weights, J.-P.
Berrut, L. N. Trefethen, SIAM Review 46 (2004).
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from solvers.numerics.arrays import Array
from solvers.numerics.jit import fusing_kernel

_TAIL = 4


class Radau(NamedTuple):
    """``points`` (s + 1,) and their barycentric ``weights``; ``first``, ``second``: derivatives at the points, and
    ``integral`` up to them, of a polynomial given by its values, (s + 1, s + 1); ``once`` and ``twice`` (s, s): single
    and double integrals up to the Radau points of one given at these only; ``slope`` (s,): from the increments since
    the start to the slope at the end; ``tail`` (4, s + 1): the last four Legendre coefficients, from the values;
    ``firsts``, ``seconds``: derivatives of the part of degree 0, 1, … s of a polynomial, (s + 1, s + 1, s + 1)."""

    points: Array
    weights: Array
    first: Array
    second: Array
    integral: Array
    once: Array
    twice: Array
    slope: Array
    tail: Array
    firsts: Array
    seconds: Array


@cache
def radau(stages: int) -> Radau:
    """The element with ``stages`` Radau points, at least 3."""
    series = np.zeros(stages + 1)
    series[stages - 1 :] = -1.0, 1.0
    x = np.sort(legendre.legroots(series).real)
    x -= legendre.legval(x, series) / legendre.legval(x, legendre.legder(series))
    x[-1] = 1.0
    # for values at the Radau points only, and for values at all points
    inner, places = np.linalg.inv(legendre.legvander(x, stages - 1)), np.append(-1.0, x)
    whole, points = np.linalg.inv(legendre.legvander(places, stages)), 0.5 * (places + 1.0)

    def acting(change: object, at: Array, coefficients: Array) -> Array:
        return np.ascontiguousarray(legendre.legval(at, change(coefficients)).T)

    def of_parts(order: int) -> Array:
        """Derivatives of the parts of a polynomial, by their degree."""
        parts = [np.where(np.arange(stages + 1)[:, None] <= degree, whole, 0.0) for degree in range(stages + 1)]
        return np.stack([acting(lambda c: legendre.legder(c, order, scl=2.0), places, part) for part in parts])

    firsts, seconds = of_parts(1), of_parts(2)
    once = acting(lambda c: legendre.legint(c, lbnd=-1.0, scl=0.5), x, inner)
    return Radau(
        points=points,
        weights=1.0 / np.prod(points[:, None] - points + np.eye(stages + 1), axis=1),
        first=firsts[-1],
        second=seconds[-1],
        integral=acting(lambda c: legendre.legint(c, lbnd=-1.0, scl=0.5), places, whole),
        once=once,
        twice=once @ once,
        slope=np.ascontiguousarray(np.linalg.inv(once)[-1]),
        tail=np.ascontiguousarray(whole[-_TAIL:]),
        firsts=firsts,
        seconds=seconds,
    )


@fusing_kernel
def shares_of(points: Array, weights: Array, x: float, share: Array) -> None:
    """Interpolation weights (s + 1,) of an element's points for polynomials at x in [0, 1]."""
    total = 0.0
    for k in range(share.size):
        apart = x - points[k]
        if apart == 0.0:
            share[:] = 0.0
            share[k] = 1.0
            return
        share[k] = weights[k] / apart
        total += share[k]
    for k in range(share.size):
        share[k] /= total
