"""Piecewise polynomial approximation of functions over one revolution: sampled once, then evaluated as polynomials.

A panel [a, b] holds the values at its n Chebyshev-Lobatto points; its interpolant converges geometrically where the
function is analytic, so panels end at the function's corners and are halved until the last coefficients indicate
sufficient accuracy. With a_k the Chebyshev coefficients and r the ratio by which pairs of them decrease,

  |f - p| <= 2 sum_{k >= n} |a_k|  ~  4 A r/(1 - r),   A = max(|a_{n-1}|, |a_{n-2}|)

Extremes, zeros and means are those of the interpolants, by the barycentric formula, without further function
evaluations. Validity: the function is smooth inside every panel and continuous at their ends.

Source: L. N. Trefethen, Approximation Theory and Approximation Practice (2013), chapters 5, 8 and 18; J.-P. Berrut, L.
N. Trefethen, SIAM Review 46 (2004), for the barycentric formula.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel, reducing_kernel

_MAX_DECREASE_RATIO = 0.75
_MIN_DECREASE_RATIO = 0.15
"""Limits of the assumed decrease ratio of coefficients: slowest, as at a corner, and fastest trusted, since a pair may
be small by accident."""
_TAIL = 6
_MAX_STEPS = 40
_MAX_HALVINGS = 40
_MIN_WIDTH = 1e-9
_EPS = float(np.finfo(float).eps)
INSIDE = 1e-14


class Rule(NamedTuple):
    """The n points on [-1, 1], their barycentric weights, their weights in the mean (Clenshaw-Curtis), and the matrices
    from values to derivatives (n, n) and to the last six Chebyshev coefficients (n, 6), one row per value."""

    points: Array
    weights: Array
    mean_weights: Array
    derivative: Array
    tail: Array


class Panels(NamedTuple):
    """``edges`` (panels + 1,) over one revolution, and the rule of every panel."""

    edges: Array
    rule: Rule

    @property
    def angles(self) -> Array:
        """All points, panel by panel, shape (panels n,)."""
        return points_on(self.edges[:-1], self.edges[1:], self.rule)

    @property
    def angles_inside(self) -> Array:
        """All points, with panel ends moved slightly inward, for functions that jump between panels."""
        return inside(self.angles, self.rule)


@lru_cache(maxsize=16)
def rule_of(n: int) -> Rule:
    """The rule with n points, n >= 6."""
    x = -np.cos(np.pi * np.arange(n) / (n - 1))
    x[np.abs(x) < 1e-15] = 0.0
    weights = np.where(np.arange(n) % 2 == 0, 1.0, -1.0)
    weights[[0, -1]] *= 0.5
    series, even = np.linalg.inv(chebyshev.chebvander(x, n - 1)), np.arange(0, n, 2)
    mean_weights = (1.0 / (1.0 - even**2)) @ series[even]
    derivative = np.ascontiguousarray(differentiation_matrix(x, weights).T)
    return Rule(x, weights, mean_weights, derivative, np.ascontiguousarray(series[-_TAIL:].T))


def differentiation_matrix(points: Array, weights: Array) -> Array:
    """The matrix (n, n) from values at n points with these barycentric weights to their interpolant's derivatives."""
    matrix = weights / weights[:, None] / (points[:, None] - points + np.eye(points.size))
    np.fill_diagonal(matrix, 0.0)
    np.fill_diagonal(matrix, -matrix.sum(axis=1))
    return matrix


@kernel
def points_on(left: Array, right: Array, rule: Rule) -> Array:
    """All points of panels between their ends (panels,), panel by panel."""
    out = np.empty(left.size * rule.points.size)
    for p in range(left.size):
        for j in range(rule.points.size):
            place = 0.5 * (left[p] + right[p]) + 0.5 * (right[p] - left[p]) * rule.points[j]
            out[p * rule.points.size + j] = place
    return out


def inside(angle: Array, rule: Rule) -> Array:
    """Move the end points of panels (panels n,) slightly inward."""
    angle = angle.reshape(-1, rule.points.size).copy()
    angle[:, 0] += INSIDE
    angle[:, -1] -= INSIDE
    return angle.ravel()


def split(edges: Array, widest: Array | float) -> Array:
    """Insert edges evenly so that no element is wider than ``widest``, which may differ between elements."""
    parts = np.maximum(np.ceil(np.diff(edges) / widest * (1.0 - 1e-9)), 1.0).astype(int)
    first = np.repeat(np.cumsum(parts) - parts, parts)
    inner = (np.arange(first.size) - first) / np.repeat(parts, parts)
    return np.append(np.repeat(edges[:-1], parts) + inner * np.repeat(np.diff(edges), parts), edges[-1])


def resolve(
    sample: Callable[[Array], Array], edges: Array, rule: Rule, checked: int, tolerance: float, most_panels: int
) -> tuple[Panels, Array, float]:
    """Panels that resolve ``sample``, its values at their points, and the largest remaining error.

    ``sample`` maps angles (m,) to (quantities, m); a panel is halved until the errors of the first ``checked``
    quantities are below ``tolerance`` times each one's largest magnitude over the revolution, up to ``most_panels``
    panels.
    """
    left, right, max_error, batches, count = edges[:-1], edges[1:], 0.0, [], 0
    scale = np.full(checked, 1e-300)
    for _ in range(_MAX_HALVINGS):
        values = sample(points_on(left, right, rule))
        halved, error, *halves = panels_to_halve(values, left, right, rule, scale, tolerance, most_panels - count)
        batches.append((left, halved, values))
        count, max_error = count + int((~halved).sum()), max(max_error, error)
        if not halves[0].size:
            break
        left, right = halves
    all_values, all_edges = np.empty((values.shape[0], count * rule.points.size)), np.empty(count + 1)
    starts = np.sort(np.concatenate([starts_of_batch[~halved] for starts_of_batch, halved, _ in batches]))
    for starts_of_batch, halved, values in batches:
        copy_panels(values, starts_of_batch, halved, starts, all_values)
    all_edges[:-1], all_edges[-1] = starts, edges[-1]
    return Panels(all_edges, rule), all_values, max_error


@kernel
def panels_to_halve(
    values: Array, left: Array, right: Array, rule: Rule, scale: Array, tolerance: float, most_panels: int
) -> tuple[NDArray[np.bool_], float, Array, Array]:
    """Mask of the panels to be halved, the largest error of the others, and the halves' left and right ends. ``scale``
    (checked,) is updated with the magnitudes of the checked quantities."""
    n, count = rule.points.size, left.size
    halved, error, max_error, number = np.zeros(count, np.bool_), np.zeros(count), 0.0, 0
    for row in range(scale.size):
        scale[row] = max(scale[row], largest(values[row]))
    for p in range(count):
        for row in range(scale.size):
            error[p] = max(error[p], panel_error(values[row, p * n : (p + 1) * n], rule) / scale[row])
        # in narrower ones rounding dominates
        halved[p] = error[p] > tolerance and right[p] - left[p] > _MIN_WIDTH
        number += halved[p]
    if count + number > most_panels:
        halved, number = np.zeros(count, np.bool_), 0
    lefts, rights, k = np.empty(2 * number), np.empty(2 * number), 0
    for p in range(count):
        if halved[p]:
            middle = 0.5 * (left[p] + right[p])
            lefts[k], rights[k], lefts[k + 1], rights[k + 1] = left[p], middle, middle, right[p]
            k += 2
        else:
            max_error = max(max_error, error[p])
    return halved, max_error, lefts, rights


@kernel
def copy_panels(values: Array, left: Array, halved: NDArray[np.bool_], starts: Array, out: Array) -> None:
    """Copy the values of the panels that were not halved into ``out``, in the order of all panels' ``starts``."""
    n = out.shape[1] // starts.size
    for p in range(left.size):
        if not halved[p]:
            at = np.searchsorted(starts, left[p])
            for row in range(out.shape[0]):
                for j in range(n):
                    out[row, at * n + j] = values[row, p * n + j]


@kernel
def panel_errors(values: Array, rule: Rule) -> Array:
    """Estimated errors of the interpolants (quantities, panels), from values (quantities, panels n)."""
    n = rule.points.size
    out = np.empty((values.shape[0], values.shape[1] // n))
    for row in range(out.shape[0]):
        for p in range(out.shape[1]):
            out[row, p] = panel_error(values[row, p * n : (p + 1) * n], rule)
    return out


@kernel
def panel_error(f: Array, rule: Rule) -> float:
    """Estimated error of one panel's interpolant."""
    a, b, c, d, e, g = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(f.size):
        value = f[j]
        a, b, c = a + rule.tail[j, 0] * value, b + rule.tail[j, 1] * value, c + rule.tail[j, 2] * value
        d, e, g = d + rule.tail[j, 3] * value, e + rule.tail[j, 4] * value, g + rule.tail[j, 5] * value
    first, middle, last = max(abs(a), abs(b)), max(abs(c), abs(d)), max(abs(e), abs(g))
    # A pair may be small by accident; its neighbours determine magnitude and decrease.
    ratio = max(last / middle if middle > 0.0 else 1.0, middle / first if first > 0.0 else 1.0)
    ratio = min(max(ratio, _MIN_DECREASE_RATIO), _MAX_DECREASE_RATIO)
    likely = 0.5 * middle * min(middle / first, 1.0) if first > 0.0 else 0.0
    return 4.0 * max(last, likely) * ratio / (1.0 - ratio)


@kernel
def mean_of(edges: Array, rule: Rule, f: Array) -> tuple[float, float]:
    """Mean of sampled values (panels n,) over the edges' range, and its estimated error."""
    n, mean, error = rule.points.size, 0.0, 0.0
    for p in range(edges.size - 1):
        values, weight = f[p * n : (p + 1) * n], (edges[p + 1] - edges[p]) / (edges[-1] - edges[0])
        mean += weight * (rule.mean_weights @ values)
        error += weight * panel_error(values, rule)
    return mean, error


@kernel
def interpolate(f: Array, rule: Rule, x: float) -> float:
    """The interpolant of one panel at x in [-1, 1]."""
    numerator, denominator = 0.0, 0.0
    for j in range(f.size):
        distance = x - rule.points[j]
        if distance == 0.0:
            return f[j]
        weight = rule.weights[j] / distance
        numerator += weight * f[j]
        denominator += weight
    return numerator / denominator


@kernel
def _zero(f: Array, rule: Rule, left: int, small: float) -> tuple[float, float]:
    """Zero between point ``left`` and the next by the Illinois method, to a value below ``small``; and that value."""
    a, b, fa, fb = rule.points[left], rule.points[left + 1], f[left], f[left + 1]
    x, value = a, fa
    for _ in range(_MAX_STEPS):
        before, x = x, b - fb * (b - a) / (fb - fa)
        value = interpolate(f, rule, x)
        if abs(value) <= small or abs(x - before) <= 4.0 * _EPS:
            break
        if value * fb < 0.0:
            a, fa = b, fb
        else:
            fa *= 0.5
        b, fb = x, value
    return x, value


@kernel
def slopes_of(f: Array, rule: Rule, out: Array) -> None:
    """Derivatives of one panel's interpolant at its points with respect to x in [-1, 1], into ``out`` (n,)."""
    out[:] = 0.0
    for k in range(f.size):
        for j in range(out.size):
            out[j] += rule.derivative[k, j] * f[k]


@reducing_kernel
def largest(f: Array) -> float:
    """Maximum of |f|."""
    magnitude = 0.0
    for i in range(f.size):
        magnitude = max(magnitude, abs(f[i]))
    return magnitude


@reducing_kernel
def extremes(f: Array) -> tuple[float, float]:
    """Maximum and minimum of f."""
    high, low = -np.inf, np.inf
    for i in range(f.size):
        high, low = max(high, f[i]), min(low, f[i])
    return high, low


@reducing_kernel
def maximum_and_jump(f: Array, sign: float) -> tuple[float, float]:
    """Maximum of sign f, and the largest difference between neighbouring points."""
    maximum, jump = sign * f[0], 0.0
    for j in range(1, f.size):
        maximum, jump = max(maximum, sign * f[j]), max(jump, abs(f[j] - f[j - 1]))
    return maximum, jump


@kernel
def greatest(edges: Array, rule: Rule, f: Array, sign: float, tolerance: float) -> tuple[float, float, float]:
    """Maximum of sign f over the revolution, its error bound, and its angle.

    ``tolerance`` is absolute. Where the slope changes from rising to falling between two points, the maximum lies below
    the intersection of the tangents; if that exceeds the best value so far, the zero of the slope is located.
    """
    n = rule.points.size
    best, best_panel, x, error = -np.inf, 0, 0.0, 0.0
    for p in range(edges.size - 1):
        maximum, jump = maximum_and_jump(f[p * n : (p + 1) * n], sign)
        if maximum > best:
            best, best_panel = maximum, p
    for j in range(n):
        if sign * f[best_panel * n + j] == best:
            x = rule.points[j]
    slope = np.empty(n)
    for p in range(edges.size - 1):
        g = f[p * n : (p + 1) * n]
        maximum, jump = maximum_and_jump(g, sign)
        if maximum + 0.5 * jump <= best:
            continue
        slopes_of(g, rule, slope)
        for j in range(n - 1):
            rise, fall = sign * slope[j], -sign * slope[j + 1]
            if rise <= 0.0 or fall <= 0.0:
                continue
            width = rule.points[j + 1] - rule.points[j]
            left, right = sign * g[j], sign * g[j + 1]
            crossing = left + rise * max((right - left + fall * width) / (rise + fall), 0.0)
            if crossing <= best and max(left, right) < best:
                continue
            # the value misses the maximum by slope^2 / (2 |second derivative|)
            curvature = (rise + fall) / width
            place, residual = _zero(slope, rule, j, math.sqrt(0.1 * tolerance * curvature))
            value = sign * interpolate(g, rule, place)
            if value > best or (p == best_panel and value >= best):
                best, best_panel, x, error = value, p, place, residual * residual / curvature
    where = 0.5 * (edges[best_panel] + edges[best_panel + 1]) + 0.5 * (edges[best_panel + 1] - edges[best_panel]) * x
    return best, error + panel_error(f[best_panel * n : (best_panel + 1) * n], rule) + 4.0 * _EPS * abs(best), where


@kernel
def zeros(edges: Array, rule: Rule, f: Array) -> Array:
    """Sign changes of f inside panels, in increasing order."""
    n, found = rule.points.size, [0.0 for _ in range(0)]
    for p in range(edges.size - 1):
        g = f[p * n : (p + 1) * n]
        for j in range(n - 1):
            if g[j] * g[j + 1] < 0.0:
                x = _zero(g, rule, j, 0.0)[0]
                found.append(0.5 * (edges[p] + edges[p + 1]) + 0.5 * (edges[p + 1] - edges[p]) * x)
    return np.array(found)


@kernel
def values_at(edges: Array, rule: Rule, f: Array, angle: Array) -> Array:
    """Interpolants of f (quantities, panels n) at angles within the revolution: (quantities, angles)."""
    n = rule.points.size
    out = np.empty((f.shape[0], angle.size))
    for i in range(angle.size):
        p = min(max(np.searchsorted(edges, angle[i], side="right") - 1, 0), edges.size - 2)
        x = (2.0 * angle[i] - edges[p] - edges[p + 1]) / (edges[p + 1] - edges[p])
        for row in range(f.shape[0]):
            out[row, i] = interpolate(f[row, p * n : (p + 1) * n], rule, x)
    return out
