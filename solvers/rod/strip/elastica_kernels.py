"""Bending of the strip by a distributed load and the elastica's third-order correction at one crank angle, compiled.

In units of the strip's length, zeta = z/l in [0, 1], with head = e/l, q = P l^2/EI and Q = -T l^2/EI of linear theory,

    theta_3'' - q theta_3 - Q_3 = f,   f = -q theta_1^3/6 - Q theta_1^2/2,   theta_3(0) = 0
    int_0^1 (theta_3 - theta_1^3/6) + head (theta_3 - theta_1^3/6)(1) = 0,   theta_3'(1) + head theta_3''(1) = 0

The unknowns are the Legendre coefficients a_k of theta_3'' in x = 2 zeta - 1: integrating a series preserves the
precision that differentiation loses. As the integral of P_k is (P_{k+1} - P_{k-1})/(2k+1), theta_3 depends only on
a_{k-2}, a_k and a_{k+2}, and the equation is tridiagonal in the even and in the odd coefficients, diagonally dominant
from the strongest tension to buckling. Two unknowns remain: E = q m + Q_3, m the mean of theta_3, which acts on the
even coefficients, and B, the mean of theta_3' and so theta_3(1), which acts on the odd ones. The two conditions at the
head, in which nearly all coefficients cancel, are a 2 x 2 system for them. No division by q occurs, and values at the
head follow from the equation and from theta_1 there: summing a series would amplify its rounding errors.

The products are sampled at Gauss points. Source: J. Shen, SIAM J. Sci. Comput. 15 (1994) 1489, for Legendre
polynomials in second-order problems; the reduction to E and B is our own.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel

_MIN_NODES, _NODE_STEP, _MAX_NODES = 16, 8, 128


class Collocation(NamedTuple):
    """Tables for n nodes, n even.

    ``nodes`` are the Gauss points on [0, 1] and 1, shape (n + 1,). ``even`` and ``odd`` map sums and differences of
    values at mirrored nodes to Legendre coefficients of even and odd degree, shape (n/2, n/2). The coefficient of
    degree k of an integral over zeta is low[k] times that of degree k - 1 minus high[k] times that of degree k + 1 of
    its integrand; of a double integral, below[k], -here[k] and above[k] times those of k - 2, k, k + 2; shape (n + 3,).
    """

    nodes: Array
    even: Array
    odd: Array
    low: Array
    high: Array
    below: Array
    here: Array
    above: Array


@lru_cache(maxsize=32)
def collocation(nodes: int) -> Collocation:
    """The tables for an even number of nodes."""
    x, weight = legendre.leggauss(nodes)
    degree = np.arange(nodes)
    half = nodes // 2
    transform = legendre.legvander(x[:half], nodes - 1) * (weight[:half, None] * (degree + 0.5))
    k = np.arange(nodes + 4)
    low, high = 0.5 / (2.0 * k - 1.0), 0.5 / (2.0 * k + 3.0)
    low[0] = 0.0
    below, here = np.zeros(nodes + 3), np.zeros(nodes + 3)
    below[2:] = low[2:-1] * low[1:-2]
    here[1:] = high[1:-1] * low[2:]
    # The mean of theta_3' is a separate unknown, so a_1 does not contribute to it.
    here[2:] += low[2:-1] * high[1:-2]
    return Collocation(
        nodes=np.append(0.5 + 0.5 * x, 1.0),
        even=np.ascontiguousarray(transform[:, 0::2]),
        odd=np.ascontiguousarray(transform[:, 1::2]),
        low=low[:-1],
        high=high[:-1],
        below=below,
        here=here,
        above=high[:-1] * high[1:],
    )


def nodes_for(least: float, greatest: float) -> int:
    """Number of nodes that resolve theta_1^3, waves or boundary layers, for q = P l^2/EI in this range."""
    waves = math.sqrt(max(-least, 0.0))
    layers = math.sqrt(max(greatest, 0.0))
    required = _MIN_NODES + max(2.0 * waves, 1.5 * layers)
    return min(_MAX_NODES, _NODE_STEP * math.ceil(required / _NODE_STEP))


@kernel
def scratch(nodes: int) -> Array:
    """Workspace of ``solve_bending`` and ``third_order`` for this number of nodes."""
    return np.empty((6, nodes + 3))


@kernel
def solve_bending(
    q: float, head: float, offset: float, end_load: float, load: Array, slope_difference: Array, tables: Collocation,
    workspace: Array, curvature: Array, deflection: Array,
) -> tuple[float, float]:  # fmt: skip
    """Solve theta'' - q theta - Q = f with the pin at an offset, in units of the strip's length; return Q and
    theta'(0).

    theta(0) = 0, int (theta - d) + head theta(1) = offset, theta'(1) + head theta''(1) = 0. ``load`` holds the Legendre
    coefficients of f, ``end_load`` is f(1), and ``slope_difference`` holds those of d, the difference of theta and the
    deflection's slope, (n,) each. ``curvature`` receives those of theta', ``deflection`` of int (theta - d), (n + 2,)
    each. ``workspace``: from ``scratch``.
    """
    n = load.size
    pivot, a, u, w = workspace[0], workspace[1], workspace[2], workspace[3]
    for k in range(n, n + 3):
        pivot[k], a[k], u[k], w[k] = 0.0, 0.0, 0.0, 0.0
    # Elimination from the highest degree down; ``pivot`` holds reciprocals of the pivots.
    below, here, above = tables.below, tables.here, tables.above
    for k in range(n - 1, 0, -1):
        factor = q * above[k] * pivot[k + 2]
        pivot[k] = 1.0 / (1.0 + q * here[k] - factor * (q * below[k + 2]))
        a[k] = load[k] + factor * a[k + 2]
    # Back substitution: a for E = B = 0, u the even response to E = 1, w the odd response to B = 1.
    a[0], u[0], w[0] = load[0], 1.0, 0.0
    a[1], u[1], w[1] = a[1] * pivot[1], 0.0, 0.5 * q * pivot[1]
    for k in range(2, n):
        ratio = q * below[k] * pivot[k]
        a[k] = a[k] * pivot[k] + ratio * a[k - 2]
        u[k], w[k] = ratio * u[k - 2], ratio * w[k - 2]
    # Offset and moment at the pin: two equations for E and B. theta''(1) is q B + Q + f(1), Q = E - q m.
    mean_a, mean_e, mean_b = -(a[0] - 0.2 * a[2]) / 12.0, -(1.0 - 0.2 * u[2]) / 12.0, 0.5
    offset_e, offset_b, offset_a = mean_e, mean_b + head, offset + slope_difference[0] - mean_a
    moment_e, moment_b = 0.5 + head * (1.0 - q * mean_e), 1.0 + w[1] / 6.0 + head * q * (1.0 - mean_b)
    moment_a = -(0.5 * a[0] + a[1] / 6.0 + head * (end_load - q * mean_a))
    det = offset_b * moment_e - offset_e * moment_b
    even_factor = (offset_b * moment_a - moment_b * offset_a) / det
    odd_factor = (offset_a * moment_e - moment_a * offset_e) / det
    for k in range(n):
        a[k] += even_factor * u[k] + odd_factor * w[k]
    low, high = tables.low, tables.high
    curvature[0] = odd_factor
    for k in range(1, n + 2):
        curvature[k] = low[k] * a[k - 1] - high[k] * a[k + 1]
    mean = 0.5 * odd_factor - curvature[1] / 6.0
    # theta - d in ``u``, and its integral.
    u[0] = mean - slope_difference[0]
    for k in range(1, n):
        u[k] = low[k] * curvature[k - 1] - high[k] * curvature[k + 1] - slope_difference[k]
    u[n] = low[n] * curvature[n - 1] - high[n] * curvature[n + 1]
    u[n + 1], u[n + 2] = low[n + 1] * curvature[n], 0.0
    deflection[0] = 0.5 * u[0] - u[1] / 6.0
    for k in range(1, n + 2):
        deflection[k] = low[k] * u[k - 1] - high[k] * u[k + 1]
    return even_factor - q * mean, odd_factor - 0.5 * a[0] + a[1] / 6.0


@kernel
def third_order(
    q: float, shear: float, head: float, slope: Array, tables: Collocation, workspace: Array, curvature: Array,
    deflection: Array,
) -> tuple[float, float]:  # fmt: skip
    """Solve for the third-order correction; return Q_3 and theta_3'(0), in units of the strip's length, from the linear
    slope at the nodes, (n + 1,).

    ``curvature`` receives the Legendre coefficients of theta_3' (V'' is this over l), ``deflection`` those of the
    deflection's correction over l; (n + 2,) each. ``workspace``: from ``scratch``.
    """
    n = slope.size - 1
    half = n // 2
    load, cubic, u, w = workspace[4], workspace[5], workspace[2], workspace[3]
    for k in range(n):
        u[k], w[k] = 0.0, 0.0
    # Sums and differences of mirrored nodes give the even and odd coefficients.
    for i in range(half):
        left, right = slope[i], slope[n - 1 - i]
        square_left, square_right = left * left, right * right
        cubic_left, cubic_right = left * square_left / 6.0, right * square_right / 6.0
        load_left = -q * cubic_left - 0.5 * shear * square_left
        load_right = -q * cubic_right - 0.5 * shear * square_right
        cubic_sum, cubic_difference = cubic_left + cubic_right, cubic_left - cubic_right
        load_sum, load_difference = load_left + load_right, load_left - load_right
        for k in range(half):
            u[k] += tables.even[i, k] * cubic_sum
            u[half + k] += tables.odd[i, k] * cubic_difference
            w[k] += tables.even[i, k] * load_sum
            w[half + k] += tables.odd[i, k] * load_difference
    for k in range(half):
        cubic[2 * k], cubic[2 * k + 1] = u[k], u[half + k]
        load[2 * k], load[2 * k + 1] = w[k], w[half + k]
    end = slope[n]
    end_cubic = end * end * end / 6.0
    end_load = -q * end_cubic - 0.5 * shear * end * end
    return solve_bending(
        q, head, head * end_cubic, end_load, load[:n], cubic[:n], tables, workspace, curvature, deflection
    )
