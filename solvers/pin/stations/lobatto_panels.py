"""Stations along the pin: panels between load boundaries, each with Lobatto nodes.

The Gauss-Lobatto rule includes the panel's ends, so that kinks of a profile are stations. Panels are refined where
quadrature rules on subsets of the nodes disagree.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel

NODES = 9
_OMITTED_NODES = ((1, 6), (2, 7), (2, 6))
"""Nodes omitted by the rules of the error estimate. A single symmetric rule misses kinks at some positions; with
these three, twice the largest difference covers the error of a kink anywhere in a panel."""
_KINK_RATIO = 16.0
"""Ratio of error estimate to tolerance that indicates a kink or a jump: for a smooth function halving reduces the
error a hundredfold."""
LEAST_PANEL = 1e-13
"""Minimum panel width relative to the length."""


def _lobatto(count: int) -> tuple[Array, Array]:
    """Return nodes and weights on [-1, 1]: the ends and the extrema of the Legendre polynomial of degree count - 1."""
    legendre = np.polynomial.legendre.Legendre.basis(count - 1)
    inner = legendre.deriv().roots().real
    for _ in range(2):
        inner = inner - legendre.deriv()(inner) / legendre.deriv(2)(inner)
    inner = 0.5 * (inner - inner[::-1])
    nodes = np.concatenate([[-1.0], inner, [1.0]])
    return nodes, 2.0 / (count * (count - 1) * legendre(nodes) ** 2)


def _interpolatory(nodes: Array) -> Array:
    """Return the weights on [-1, 1] of the interpolatory quadrature rule."""
    powers = np.polynomial.legendre.legvander(nodes, nodes.size - 1)
    exact = np.zeros(nodes.size)
    exact[0] = 2.0
    return np.linalg.solve(powers.T, exact)


NODE_PLACES, _W = _lobatto(NODES)
"""Nodes on [-1, 1]."""
NODE_WEIGHTS = 1.0 / (NODE_PLACES[:, None] - NODE_PLACES + np.eye(NODES)).prod(axis=1)
"""Barycentric weights of the interpolating polynomial."""


def _weights_without(dropped: tuple[int, ...]) -> Array:
    """Return the weights of the rule on the remaining nodes."""
    kept = [i for i in range(NODES) if i not in dropped]
    weights = np.zeros(NODES)
    weights[kept] = _interpolatory(NODE_PLACES[kept])
    return weights


_ERROR_WEIGHTS = 2.0 * np.stack([_W - _weights_without(dropped) for dropped in _OMITTED_NODES], axis=1)


@dataclass(eq=False)
class Stations:
    """Contiguous panels between ``edges`` [m], ascending, and their nodes.

    ``left``, ``right`` and ``width`` [m] describe the panels, (m,), ``span`` [m] all of them. Of every node, (n,):
    position ``x`` [m] with its rounding ``residual``; ``panel_start``, the left end of its panel: loads that begin
    there act on the station; ``weight``, the quadrature weight relative to the whole length (the weights sum to 1 also
    if one half of the bar represents both). ``residuals`` are the rounding residuals of the edges: they keep the
    relative precision of short panels far from the bar's end.
    """

    edges: Array
    residuals: Array | None = None

    def __post_init__(self) -> None:
        if self.residuals is None:
            self.residuals = np.zeros_like(self.edges)
        self.left, self.right, self.span = self.edges[:-1], self.edges[1:], float(self.edges[-1] - self.edges[0])
        self.width, table = np.empty(self.left.size), np.empty((4, NODES * self.left.size))
        _lay_out(self.edges, self.residuals, table, self.width)
        self.x, self.residual, self.panel_start, self.weight = table

    def cut(self, places: Array | tuple[float, ...]) -> Stations:
        """Return the panels split at these positions."""
        return Stations(*_cut(self.edges, self.residuals, np.sort(places)))

    def error_estimate(self, values: Array) -> Array:
        """Return the quadrature error estimate per panel, relative to the whole length: the largest difference between
        rules on fewer nodes and the Gauss-Lobatto rule, doubled."""
        return _error_estimate(self.width, self.span, values)

    def halved(self, which: NDArray[np.bool_]) -> Stations:
        """Return the stations with the selected panels halved."""
        return self.cut((self.left + 0.5 * self.width)[which])

    def refined(self, excess: Array, values: Array) -> Stations:
        """Return the stations with every panel halved whose error estimate exceeds its tolerance (``excess`` > 1).

        Far above the tolerance, a kink or a jump is assumed and the panel is also cut on either side of it, between the
        two nodes adjacent to the largest change of slope.
        """
        return self.cut(_cuts(self.x, self.width, excess, values))

    def first(self, panels: int) -> Stations:
        """Return the first panels."""
        return Stations(self.edges[: panels + 1], self.residuals[: panels + 1])


@kernel
def _lay_out(edges: Array, residuals: Array, table: Array, width: Array) -> None:
    """Write nodes, their rounding residuals (Knuth's sum), panel starts and weights into ``table``."""
    span = edges[edges.size - 1] - edges[0]
    for panel in range(width.size):
        begin, residual, first = edges[panel], residuals[panel], panel * NODES
        width[panel] = (edges[panel + 1] - begin) + (residuals[panel + 1] - residual)
        for j in range(NODES):
            along, i = 0.5 * width[panel] * (1.0 + NODE_PLACES[j]) + residual, first + j
            total = begin + along
            seen = total - begin
            table[0, i], table[1, i] = total, (begin - (total - seen)) + (along - seen)
            table[2, i], table[3, i] = begin, 0.5 * width[panel] * _W[j] / span
        last = first + NODES - 1
        table[0, first], table[1, first], table[0, last], table[1, last] = (
            begin,
            residual,
            edges[panel + 1],
            residuals[panel + 1],
        )


@kernel
def _cut(edges: Array, residuals: Array, places: Array) -> tuple[Array, Array]:
    """Return the edges and increasing positions between them, each once, and their residuals."""
    out, out_residuals, count, k = np.empty(edges.size + places.size), np.zeros(edges.size + places.size), 0, 0
    for i in range(edges.size):
        while k < places.size and places[k] <= edges[i]:
            if i > 0 and places[k] < edges[i] and places[k] > out[count - 1]:
                out[count] = places[k]
                count += 1
            k += 1
        out[count], out_residuals[count] = edges[i], residuals[i]
        count += 1
    return out[:count], out_residuals[:count]


@kernel
def _error_estimate(width: Array, span: float, values: Array) -> Array:
    """Return ``Stations.error_estimate``."""
    error_estimate = np.empty(width.size)
    for panel in range(width.size):
        most = 0.0
        for rule in range(_ERROR_WEIGHTS.shape[1]):
            difference = 0.0
            for j in range(NODES):
                difference += values[panel * NODES + j] * _ERROR_WEIGHTS[j, rule]
            # Unlike ``max``, this keeps NaN.
            most = abs(difference) if not abs(difference) <= most else most
        error_estimate[panel] = 0.5 * width[panel] / span * most
    return error_estimate


@kernel
def _cuts(x: Array, width: Array, excess: Array, f: Array) -> Array:
    """Return the positions at which ``Stations.refined`` cuts."""
    places, count = np.empty(3 * excess.size), 0
    for panel in range(excess.size):
        first = panel * NODES
        if excess[panel] > 1.0:
            places[count] = x[first] + 0.5 * width[panel]
            count += 1
        if excess[panel] > _KINK_RATIO:
            at, most, previous_change = first, -1.0, 0.0
            for i in range(first, first + NODES - 1):
                slope, slope_change = (f[i + 1] - f[i]) / (x[i + 1] - x[i]), 0.0
                if i + 2 < first + NODES:
                    slope_change = abs((f[i + 2] - f[i + 1]) / (x[i + 2] - x[i + 1]) - slope)
                if previous_change + slope_change > most:
                    at, most = i, previous_change + slope_change
                previous_change = slope_change
            places[count], places[count + 1] = _around_kink(x, f, at, first, excess[panel])
            count += 2
    return places[:count]


@kernel
def _around_kink(x: Array, f: Array, at: int, first: int, excess: float) -> tuple[float, float]:
    """Return positions on either side of a kink between the nodes ``at`` and ``at`` + 1: close to the intersection of
    the lines through the neighbours on either side, so close that its error, quadratic in the width, is tolerable."""
    left, right = x[at], x[at + 1]
    if at > first and at + 2 < first + NODES:
        before, after = (f[at] - f[at - 1]) / (left - x[at - 1]), (f[at + 2] - f[at + 1]) / (x[at + 2] - right)
        if before != after:
            along = (f[at + 1] - f[at] - after * (right - left)) / (before - after)
            reach = (right - left) * max(min(4.0 / math.sqrt(excess), 0.5), 0.1)
            if 0.0 < along < right - left:
                return max(left, left + along - reach), min(right, left + along + reach)
    return left, right


def panel_edges(places: Iterable[float], length: float, symmetric: bool) -> list[float]:
    """Return the panel boundaries, ascending: the given positions, mirrored for a bar of unlike halves.

    Positions that differ only by rounding are merged into the last of them, so that every load that begins there
    acts on the next panel; those that coincide with the bar's ends are dropped. Both halves get the same number of
    boundaries.
    """
    middle, tolerance = 0.5 * length, LEAST_PANEL * length
    inside = [(p, p, True) if p < middle else (length - p, p, False) for p in places]
    inside = [edge for edge in inside if tolerance < edge[0] < middle - tolerance]
    if symmetric:
        return [*merged(sorted(place for _, place, first in inside if first), tolerance), middle]
    groups: list[tuple[float, list[float], list[float]]] = []
    for distance, place, first in sorted(inside):
        if not groups or distance - groups[-1][0] > tolerance:
            groups.append((distance, [], []))
        groups[-1][1 if first else 2].append(place)
    left = [max(own) if own else length - max(other) for _, own, other in groups]
    right = [max(other) if other else length - max(own) for _, own, other in groups]
    return [*left, middle, *reversed(right)]


def merged(places: list[float], tolerance: float) -> list[float]:
    """Merge increasing positions closer than the tolerance, keeping the last."""
    kept: list[float] = []
    for place in places:
        if kept and place - kept[-1] <= tolerance:
            kept[-1] = place
        else:
            kept.append(place)
    return kept
