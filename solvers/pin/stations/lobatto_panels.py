"""Stations along the pin: panels between the places where loads begin, each with Lobatto's nodes.

Lobatto's rule has its outer nodes on the panel's ends, so the places where a profile has its kinks are stations. Panels
are halved where rules on fewer of the same nodes disagree.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel

Array = NDArray[np.float64]

NODES = 9
_DROPPED = ((1, 6), (2, 7), (2, 6))
"""What is left out of the nodes by the rules that judge. A symmetric rule alone is blind to kinks at some places; with
these three, twice the greatest difference covers the error of a kink anywhere in a panel."""
_KINKED = 16.0
"""Doubts that are this many times too great come from a kink or a jump: halving makes that of a smooth curve a hundred
times smaller."""
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


NODE_PLACES, _W = _lobatto(NODES)
"""Where the nodes lie on [-1, 1]."""
NODE_WEIGHTS = 1.0 / (NODE_PLACES[:, None] - NODE_PLACES + np.eye(NODES)).prod(axis=1)
"""The barycentric weights of the polynomial through values at the nodes."""


def _without(dropped: tuple[int, ...]) -> Array:
    """Weights of the rule on the other nodes."""
    kept = [i for i in range(NODES) if i not in dropped]
    weights = np.zeros(NODES)
    weights[kept] = _interpolatory(NODE_PLACES[kept])
    return weights


_JUDGES = 2.0 * np.stack([_W - _without(dropped) for dropped in _DROPPED], axis=1)


@dataclass(frozen=True)
class Stations:
    """Panels [left, right] in order, and their nodes one after another.

    ``share`` are quadrature weights relative to the whole length: they add up to 1 also where one half of the bar
    stands for both. What rounding left out of the panels' ends is in ``left_rest`` and ``right_rest``: a short panel
    far from the bar's end keeps the digits of its length.
    """

    left: Array
    right: Array
    left_rest: Array | float = field(default=0.0, kw_only=True)
    right_rest: Array | float = field(default=0.0, kw_only=True)

    @property
    def span(self) -> float:
        return float(self.right[-1] - self.left[0])

    @cached_property
    def width(self) -> Array:
        return (self.right - self.left) + (self.right_rest - self.left_rest)

    @cached_property
    def _rests(self) -> tuple[Array, Array]:
        """``left_rest`` and ``right_rest`` as arrays."""
        none = np.zeros_like(self.left)
        return self.left_rest + none, self.right_rest + none

    @cached_property
    def _places(self) -> tuple[Array, Array]:
        """The nodes, and what rounding left out of them."""
        x, rest = np.empty((2, NODES * self.left.size))
        _place(self.left, self.right, *self._rests, x, rest)
        return x, rest

    @property
    def x(self) -> Array:
        return self._places[0]

    @property
    def rest(self) -> Array:
        """What rounding left out of ``x``."""
        return self._places[1]

    @cached_property
    def side(self) -> Array:
        """For every station the left end of its panel: loads that begin there act on it."""
        return np.repeat(self.left, NODES)

    @cached_property
    def share(self) -> Array:
        return (0.5 * self.width[:, None] * _W).ravel() / self.span

    def cut(self, places: Array | tuple[float, ...]) -> Stations:
        """The panels of contiguous stations, with ends at these places as well."""
        edges, rest = np.empty((2, self.left.size + 1 + len(places)))
        count = _cut(self.left, self.right, *self._rests, np.sort(places), edges, rest)
        edges, rest = edges[:count], rest[:count]
        return Stations(edges[:-1], edges[1:], left_rest=rest[:-1], right_rest=rest[1:])

    def doubt(self, values: Array) -> Array:
        """For every panel, how far rules on fewer nodes are from Lobatto's, relative to the whole length."""
        table = values.reshape(-1, NODES)
        return 0.5 * self.width / self.span * np.abs(table @ _JUDGES).max(axis=1)

    def overlooked(self, values: Array, forward: bool = True) -> Array:
        """For every panel, what a running maximum over the stations misses between them, relative to the whole length.

        Of a station whose value is the running maximum behind it, parabolas through it and its neighbours tell how far
        the true maximum lies above, which counts for as much of the length as the value holds, and how deep the values
        dip before the next station, which counts up to there: twice, as both are estimates. Without ``forward`` the
        maximum runs from the right to the left.
        """
        missed = np.zeros(self.left.size)
        _overlook(self.x, self.share, values, self.span, forward, missed)
        return missed

    def halved(self, which: NDArray[np.bool_]) -> Stations:
        """The same with some panels cut in two."""
        return self.cut((self.left + 0.5 * self.width)[which])

    def refined(self, excess: Array, values: Array) -> Stations:
        """The same with every panel halved whose doubt of the values at its nodes is more than once too great; where it
        is far too great, cut at the two nodes beside which their slope changes most as well: there is a kink or a jump,
        of which no curve through the nodes knows, and its panel becomes some eight times shorter."""
        kinked = excess > _KINKED
        x, f = (v.reshape(-1, NODES)[kinked] for v in (self.x, values))
        slope = np.diff(f, axis=1) / np.diff(x, axis=1)
        bend = np.abs(np.diff(slope, axis=1, prepend=slope[:, :1], append=slope[:, -1:]))
        row, at = np.arange(len(x)), np.argmax(bend[:, :-1] + bend[:, 1:], axis=1)
        middles = (self.left + 0.5 * self.width)[excess > 1.0]
        return self.cut(np.concatenate([x[row, at], x[row, at + 1], middles]))

    def first(self, panels: int) -> Stations:
        """The first so many panels."""
        left_rest, right_rest = self._rests
        return Stations(
            self.left[:panels], self.right[:panels], left_rest=left_rest[:panels], right_rest=right_rest[:panels]
        )


@kernel
def _place(left: Array, right: Array, left_rest: Array, right_rest: Array, x: Array, rest: Array) -> None:
    """The nodes of panels into x, and what rounding leaves out of them (D. E. Knuth's sum) into ``rest``."""
    for panel in range(left.size):
        begin, own = left[panel], left_rest[panel]
        width = (right[panel] - begin) + (right_rest[panel] - own)
        for j in range(NODES):
            along, i = 0.5 * width * (1.0 + NODE_PLACES[j]) + own, panel * NODES + j
            total = begin + along
            seen = total - begin
            x[i], rest[i] = total, (begin - (total - seen)) + (along - seen)
        first, last = panel * NODES, panel * NODES + NODES - 1
        x[first], rest[first], x[last], rest[last] = begin, own, right[panel], right_rest[panel]


@kernel
def _cut(
    left: Array, right: Array, left_rest: Array, right_rest: Array, places: Array, edges: Array, rest: Array
) -> int:  # fmt: skip
    """The ends of contiguous panels and rising places between them into ``edges``, each once; how many there are."""
    count, k, n = 0, 0, left.size
    for panel in range(n + 1):
        end = left[panel] if panel < n else right[n - 1]
        while k < places.size and places[k] <= end:
            if panel > 0 and places[k] < end and places[k] > edges[count - 1]:
                edges[count], rest[count] = places[k], 0.0
                count += 1
            k += 1
        edges[count], rest[count] = end, left_rest[panel] if panel < n else right_rest[n - 1]
        count += 1
    return count


@kernel
def _above(x: Array, f: Array, sign: float, first: int, j: int) -> float:
    """How far beside a panel's j-th node, up to the next ones, parabolas through three nodes rise above its value.

    Three parabolas, so that one of them does not look across a kink.
    """
    low, high, own, most = x[first + max(j - 1, 0)], x[first + min(j + 1, NODES - 1)], sign * f[first + j], 0.0
    for shift in range(-1, 2):
        i = first + min(max(j + shift, 1), NODES - 2)
        rise, fall = sign * (f[i] - f[i - 1]) / (x[i] - x[i - 1]), sign * (f[i + 1] - f[i]) / (x[i + 1] - x[i])
        bend = (fall - rise) / (x[i + 1] - x[i - 1])
        top = 0.5 * (x[i - 1] + x[i] - rise / bend)
        if bend < 0.0 and low < top < high:
            most = max(most, sign * f[i - 1] + (top - x[i - 1]) * (rise + bend * (top - x[i])) - own)
    return most


@kernel
def _overlook(x: Array, share: Array, values: Array, span: float, forward: bool, missed: Array) -> None:
    """Into ``missed`` what ``Stations.overlooked`` tells."""
    n = x.size
    held, least = np.zeros(n), np.zeros(n)
    running, source = -np.inf, 0
    for k in range(n):
        i = k if forward else n - 1 - k
        if values[i] >= running:
            running, source, least[i] = values[i], i, 1.0
        held[source] += share[i]
    for first in range(NODES, n, NODES):
        # Where panels meet, two stations share a place, and the summit may lie on either side.
        held[first] = held[first - 1] = held[first] + held[first - 1]
    for panel in range(missed.size):
        first = panel * NODES
        for j in range(NODES):
            i, before, behind = first + j, first + max(j - 1, 0), first + min(j + 1, NODES - 1)
            if held[i] > 0.0:
                missed[panel] += 2.0 * held[i] * _above(x, values, 1.0, first, j)
            if least[i] > 0.0:
                reach = (x[behind] - x[before]) / (behind - before) / span
                missed[panel] += 2.0 * reach * _above(x, values, -1.0, first, j)


def panel_edges(places: Iterable[float], length: float, symmetric: bool) -> list[float]:
    """Where panels must begin, rising: the given places, and for a bar of two unlike halves their mirror images.

    Places that only rounding tells apart are one edge, the last of them, so that every load that begins there acts on
    the panel behind it; those that it tells from the bar's ends only are none. Both halves get equally many edges.
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
    """Rising places; of those closer than the tolerance the last."""
    kept: list[float] = []
    for place in places:
        if kept and place - kept[-1] <= tolerance:
            kept[-1] = place
        else:
            kept.append(place)
    return kept


def first_stations(places: list[float], end: float, rests: Mapping[float, float] = MappingProxyType({})) -> Stations:
    """Panels on [0, end] that begin and end at the given places; ``rests`` is what rounding left out of some."""
    edges = np.array([0.0, *(p for p in places if p < end), end])
    rest = np.array([rests.get(edge, 0.0) for edge in edges.tolist()])
    whole = Stations(edges[:-1], edges[1:], left_rest=rest[:-1], right_rest=rest[1:])
    return whole.halved(np.ones(edges.size - 1, dtype=bool))
