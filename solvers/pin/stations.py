"""Stations along the pin: panels between the places where loads begin, each with Lobatto's nodes.

Lobatto's rule has its outer nodes on the panel's ends, so the places where a profile has its kinks are stations. Panels
are halved where a rule on fewer of the same nodes disagrees.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NODES = 9
_DROPPED = (2, 6)
FIRST_PANELS = 2
LEAST_PANEL = 1e-13
"""Panels shorter than this share of the length are not halved any more."""


def _lobatto(count: int) -> tuple[Array, Array]:
    """Nodes and weights on [-1, 1]: the ends and the extrema of Legendre's polynomial of degree count - 1."""
    legendre = np.polynomial.legendre.Legendre.basis(count - 1)
    inner = legendre.deriv().roots().real
    for _ in range(2):
        inner = inner - legendre.deriv()(inner) / legendre.deriv(2)(inner)
    inner = 0.5 * (inner - inner[::-1])
    nodes = np.concatenate([[-1.0], inner, [1.0]])
    return nodes, 2.0 / (count * (count - 1) * legendre(nodes) ** 2)


def _interpolatory(nodes: Array) -> Array:
    """Weights on [-1, 1] that integrate every polynomial through the nodes."""
    powers = np.polynomial.legendre.legvander(nodes, nodes.size - 1)
    exact = np.zeros(nodes.size)
    exact[0] = 2.0
    return np.linalg.solve(powers.T, exact)


_X, _W = _lobatto(NODES)
_KEPT = [i for i in range(NODES) if i not in _DROPPED]
_FEWER = np.zeros(NODES)
_FEWER[_KEPT] = _interpolatory(_X[_KEPT])


@dataclass(frozen=True)
class Stations:
    """Panels [left, right] in order, and their nodes one after another.

    ``share`` are quadrature weights relative to the whole length: they add up to 1 also where one half of the bar
    stands for both.
    """

    left: Array
    right: Array

    @property
    def span(self) -> float:
        return float(self.right[-1] - self.left[0])

    @cached_property
    def x(self) -> Array:
        middle, half = 0.5 * (self.left + self.right), 0.5 * (self.right - self.left)
        x = middle[:, None] + half[:, None] * _X
        x[:, 0], x[:, -1] = self.left, self.right
        return x.ravel()

    @cached_property
    def side(self) -> Array:
        """For every station the left end of its panel: loads that begin there act on it."""
        return np.repeat(self.left, NODES)

    @cached_property
    def share(self) -> Array:
        return (0.5 * (self.right - self.left)[:, None] * _W).ravel() / self.span

    def doubt(self, values: Array) -> Array:
        """For every panel, how far a rule on fewer nodes is from Lobatto's, relative to the whole length."""
        table = values.reshape(-1, NODES)
        return 0.5 * (self.right - self.left) / self.span * np.abs(table @ (_W - _FEWER))

    def halved(self, which: NDArray[np.bool_]) -> Stations:
        """The same with some panels cut in two."""
        middle = 0.5 * (self.left + self.right)
        left = np.sort(np.concatenate([self.left, middle[which]]))
        right = np.sort(np.concatenate([self.right, middle[which]]))
        return Stations(left, right)


def first_stations(places: list[float], end: float) -> Stations:
    """Panels on [0, end] that begin and end at the given places."""
    edges = [0.0, *(p for p in places if LEAST_PANEL * end < p < end * (1.0 - LEAST_PANEL)), end]
    cuts = [np.linspace(lo, hi, FIRST_PANELS + 1)[:-1] for lo, hi in pairwise(edges)]
    left = np.concatenate(cuts)
    return Stations(left, np.append(left[1:], end))
