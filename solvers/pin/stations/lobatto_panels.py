"""Stations along the pin: panels between load boundaries, each with Lobatto nodes.

The Gauss-Lobatto rule includes the panel's ends, so that kinks of a profile are stations. Panels are refined where
quadrature rules on subsets of the nodes disagree.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.kinks import cuts
from solvers.pin.scene import Scene

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


NODE_PLACES, _W = _lobatto(NODES)
"""Nodes on [-1, 1]."""
NODE_WEIGHTS = 1.0 / (NODE_PLACES[:, None] - NODE_PLACES + np.eye(NODES)).prod(axis=1)
"""Barycentric weights of the interpolating polynomial."""


def _weights_without(dropped: tuple[int, ...]) -> Array:
    """Return the weights of the interpolatory rule on the remaining nodes."""
    kept = [i for i in range(NODES) if i not in dropped]
    weights, exact = np.zeros(NODES), np.zeros(len(kept))
    exact[0] = 2.0
    weights[kept] = np.linalg.solve(np.polynomial.legendre.legvander(NODE_PLACES[kept], len(kept) - 1).T, exact)
    return weights


_ERROR_WEIGHTS = 2.0 * np.stack([_W - _weights_without(dropped) for dropped in _OMITTED_NODES], axis=1)


@dataclass(eq=False)
class Stations:
    """Contiguous panels between ``edges`` [m], ascending, and their nodes.

    ``left``, ``right`` and ``width`` [m] describe the panels, (m,), ``span`` [m] all of them. Of every node, (n,):
    position ``x`` [m]; ``side``, its panel's midpoint [m]: on a load boundary it tells the station's side; ``weight``,
    the quadrature weight relative to the whole length (the weights sum to 1 also if one half represents both).
    """

    edges: Array

    def __post_init__(self) -> None:
        self.left, self.right, self.span = self.edges[:-1], self.edges[1:], float(self.edges[-1] - self.edges[0])
        self.width = self.right - self.left
        self.x, self.side, self.weight = _lay_out(self.edges)

    def cut(self, places: Array | tuple[float, ...]) -> Stations:
        """Return the panels split at these positions."""
        return Stations(_cut(self.edges, np.sort(places)))

    def error_estimate(self, values: Array) -> Array:
        """Return the quadrature error estimate per panel, relative to the whole length: the largest difference between
        rules on fewer nodes and the Gauss-Lobatto rule, doubled."""
        return _error_estimate(self.width, self.span, values)

    def halved(self, which: NDArray[np.bool_]) -> Stations:
        """Return the stations with the selected panels halved."""
        return self.cut((self.left + 0.5 * self.width)[which])

    def refined(self, excess: Array, values: Array) -> Stations:
        """Return the stations with every panel halved whose error estimate exceeds its tolerance (``excess`` > 1).

        Far above the tolerance, a kink or a jump is assumed and the panel is also cut on either side of it.
        """
        return self.cut(cuts(self.x, values, excess, _KINK_RATIO, NODES))


@kernel
def _lay_out(edges: Array) -> Array:
    """Return nodes, their panels' midpoints, and weights, (3, n)."""
    out, span = np.empty((3, NODES * (edges.size - 1))), edges[edges.size - 1] - edges[0]
    for panel in range(edges.size - 1):
        begin, end, first = edges[panel], edges[panel + 1], panel * NODES
        half, middle = 0.5 * (end - begin), 0.5 * (begin + end)
        for j in range(NODES):
            out[0, first + j], out[1, first + j] = begin + half * (1.0 + NODE_PLACES[j]), middle
            out[2, first + j] = half * _W[j] / span
        out[0, first + NODES - 1] = end
    return out


@kernel
def _cut(edges: Array, places: Array) -> Array:
    """Return the edges and increasing positions between them, each once."""
    out, count, k = np.empty(edges.size + places.size), 0, 0
    for i in range(edges.size):
        while k < places.size and places[k] <= edges[i]:
            if i > 0 and places[k] < edges[i] and places[k] > out[count - 1]:
                out[count] = places[k]
                count += 1
            k += 1
        out[count] = edges[i]
        count += 1
    return out[:count]


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


def initial_stations(scene: Scene, further: tuple[float, ...] = ()) -> Stations:
    """Return stations on panels that are halves of the intervals between load boundaries, the positions ``further`` and
    the middle: up to the middle of a symmetric part, otherwise over the whole length."""
    length, places = scene.geometry.length, scene.breakpoints.union(further)
    if scene.symmetric:
        places, length = {min(place, length - place) for place in places}, 0.5 * length
    else:
        places.add(0.5 * length)
    edges = separated([0.0, *places, length], LEAST_PANEL * length)
    middles = [0.5 * (begin + end) for begin, end in pairwise(edges)]
    return Stations(np.array(sorted(edges + middles)))


def separated(places: list[float], tolerance: float) -> list[float]:
    """Return positions in ascending order, of those closer than the tolerance the last one, but the first of all."""
    first, *others = sorted(places)
    kept = [first]
    for place in others:
        if place - kept[-1] > tolerance:
            kept.append(place)
        elif len(kept) > 1:
            kept[-1] = place
    return kept


def kinks(scene: Scene) -> Array:
    """Return the positions of load boundaries of either half as fractions of the half, including 0 and 1."""
    places, half = np.array([*scene.breakpoints]), 0.5 * scene.geometry.length
    return np.unique(np.clip(np.append(np.minimum(places, 2.0 * half - places) / half, [0.0, 1.0]), 0.0, 1.0))
