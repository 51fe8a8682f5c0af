"""Radau's collocation on one element [0, 1]: its points and the matrices that act on values there.

Points are the element's first end and Radau's, the last of which is its other end; the method is of order 2 s - 1 in
the number s of the latter, and damps what its steps cannot follow.

Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.5; for the barycentric weights, J.-P.
Berrut, L. N. Trefethen, SIAM Review 46 (2004).
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from solvers.numerics.jit import fusing_kernel

Array = NDArray[np.float64]

_TAIL = 4


class Radau(NamedTuple):
    """``points`` (s + 1,) and ``weights`` of barycentric interpolation there; ``first``, ``second`` derivatives at the
    points and ``integral`` up to them, of a polynomial given by its values, (s + 1, s + 1); ``once`` and ``twice``
    (s, s): single and double integrals up to Radau's points of one given at these alone; ``slope`` (s,): from what has
    grown since the first end to the slope at the last; ``tail`` (4, s + 1) gives the last Legendre coefficients."""

    points: Array
    weights: Array
    first: Array
    second: Array
    integral: Array
    once: Array
    twice: Array
    slope: Array
    tail: Array


@cache
def radau(stages: int) -> Radau:
    """The element with so many stages, at least 3."""
    series = np.zeros(stages + 1)
    series[stages - 1 :] = -1.0, 1.0
    x = np.sort(legendre.legroots(series).real)
    x -= legendre.legval(x, series) / legendre.legval(x, legendre.legder(series))
    x[-1] = 1.0
    # From values at Radau's points alone, and from those at all points.
    inner, places = np.linalg.inv(legendre.legvander(x, stages - 1)), np.append(-1.0, x)
    whole, points = np.linalg.inv(legendre.legvander(places, stages)), 0.5 * (places + 1.0)

    def acting(change: object, at: Array, coefficients: Array) -> Array:
        return np.ascontiguousarray(legendre.legval(at, change(coefficients)).T)

    once = acting(lambda c: legendre.legint(c, lbnd=-1.0, scl=0.5), x, inner)
    return Radau(
        points=points,
        weights=1.0 / np.prod(points[:, None] - points + np.eye(stages + 1), axis=1),
        first=acting(lambda c: legendre.legder(c, scl=2.0), places, whole),
        second=acting(lambda c: legendre.legder(c, 2, scl=2.0), places, whole),
        integral=acting(lambda c: legendre.legint(c, lbnd=-1.0, scl=0.5), places, whole),
        once=once,
        twice=once @ once,
        slope=np.ascontiguousarray(np.linalg.inv(once)[-1]),
        tail=np.ascontiguousarray(whole[-_TAIL:]),
    )


@fusing_kernel
def shares_of(points: Array, weights: Array, x: float, share: Array) -> None:
    """The shares (s + 1,) that an element's points have in polynomials at x in [0, 1]."""
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
