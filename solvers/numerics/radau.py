"""Radau collocation on one element [0, 1]: points and matrices acting on values there.

The points are the element's start and the Radau points, the last of which is its end; the method has order 2 s - 1 for
s Radau points and damps components too fast for its elements to resolve.

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
    """Points and matrices of an element with s Radau points.

    points, weights  all points (s + 1,) and their barycentric weights
    first, second    first and second derivative at the points, from the values (s + 1, s + 1)
    integral         integral from the start up to the points, from the values (s + 1, s + 1)
    single_integral, double_integral  integrals up to the Radau points, from the values at these only (s, s)
    end_slope        slope at the end, from the increments since the start (s,)
    tail             last four Legendre coefficients, from the values (4, s + 1)
    """

    points: Array
    weights: Array
    first: Array
    second: Array
    integral: Array
    single_integral: Array
    double_integral: Array
    end_slope: Array
    tail: Array


@cache
def radau(stages: int) -> Radau:
    """The element with ``stages`` Radau points, at least 3."""
    series = np.zeros(stages + 1)
    series[stages - 1 :] = -1.0, 1.0
    x = np.sort(legendre.legroots(series).real)
    x -= legendre.legval(x, series) / legendre.legval(x, legendre.legder(series))
    x[-1] = 1.0
    # for values at the Radau points only, and for values at all points
    radau_series, nodes = np.linalg.inv(legendre.legvander(x, stages - 1)), np.append(-1.0, x)
    full_series, points = np.linalg.inv(legendre.legvander(nodes, stages)), 0.5 * (nodes + 1.0)

    def matrix_of(operation: object, targets: Array, coefficients: Array) -> Array:
        return np.ascontiguousarray(legendre.legval(targets, operation(coefficients)).T)

    single_integral = matrix_of(lambda c: legendre.legint(c, lbnd=-1.0, scl=0.5), x, radau_series)
    return Radau(
        points=points,
        weights=1.0 / np.prod(points[:, None] - points + np.eye(stages + 1), axis=1),
        first=matrix_of(lambda c: legendre.legder(c, 1, scl=2.0), nodes, full_series),
        second=matrix_of(lambda c: legendre.legder(c, 2, scl=2.0), nodes, full_series),
        integral=matrix_of(lambda c: legendre.legint(c, lbnd=-1.0, scl=0.5), nodes, full_series),
        single_integral=single_integral,
        double_integral=single_integral @ single_integral,
        end_slope=np.ascontiguousarray(np.linalg.inv(single_integral)[-1]),
        tail=np.ascontiguousarray(full_series[-_TAIL:]),
    )


@fusing_kernel
def interpolation_weights(points: Array, weights: Array, x: float, out: Array) -> None:
    """Interpolation weights (s + 1,) of an element's points for polynomials at x in [0, 1]."""
    total = 0.0
    for k in range(out.size):
        distance = x - points[k]
        if distance == 0.0:
            out[:] = 0.0
            out[k] = 1.0
            return
        out[k] = weights[k] / distance
        total += out[k]
    for k in range(out.size):
        out[k] /= total
