"""Mean and maxima of functions that are smooth between given breaks and may jump at them.

Between breaks Gauss's rule converges geometrically; the change from n to 2n nodes is the error's estimate. A maximum is
looked for among samples of every piece, both one-sided limits included, and then by looking closer and closer at the
highest humps.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = Callable[[Array], Array]
"""From angles (n,) to quantities (k, n)."""

LONGEST_PIECE = math.pi / 16.0
_FEWEST_NODES, _MOST_NODES = 3, 48
_WITHIN = 6
CANCELLED = 1e-4
_HUMPS = 8
_LOOKS = 17
_ROUNDING = 4.0 * np.finfo(float).eps


@dataclass(frozen=True)
class Means:
    """Means of k quantities, their absolute errors, their mean magnitudes, and the nodes per piece."""

    value: Array
    error: Array
    magnitude: Array
    nodes: int


@dataclass(frozen=True)
class Maxima:
    """Greatest values of k quantities, where they are, and the absolute errors; all of shape (k,)."""

    value: Array
    place: Array
    error: Array


def subdivide(breaks: Array, longest: float = LONGEST_PIECE) -> Array:
    """The breaks, and as many points between them as keep every piece no longer than ``longest``."""
    parts = np.maximum(np.ceil(np.diff(breaks) / longest).astype(int), 1)
    index = np.repeat(np.arange(parts.size), parts)
    step = np.arange(index.size) - np.repeat(np.cumsum(parts) - parts, parts)
    low, width = breaks[:-1][index], np.diff(breaks)[index]
    return np.append(low + width * (step / parts[index]), breaks[-1])


def gauss(bounds: Array, nodes: int) -> tuple[Array, Array]:
    """Places and weights of Gauss's rule on every piece, each of shape (pieces, nodes)."""
    return gauss_between(bounds[:-1], bounds[1:], nodes)


def gauss_between(low: Array, high: Array, nodes: int) -> tuple[Array, Array]:
    """Places and weights of Gauss's rule from each lower to each upper bound, each of shape (bounds, nodes)."""
    at, weight = _rule(nodes)
    half = 0.5 * (high - low)[:, None]
    return low[:, None] + half * (1.0 + at), half * weight


@cache
def _rule(nodes: int) -> tuple[Array, Array]:
    return np.polynomial.legendre.leggauss(nodes)


def means(function: Rows, breaks: Array, tolerance: float) -> Means:
    """Means over the breaks' whole range, to ``tolerance`` times the values.

    Where a mean cancels to less than ``CANCELLED`` of its mean magnitude, that share of the magnitude is what counts.
    """
    bounds = subdivide(breaks)
    span = bounds[-1] - bounds[0]

    def integrate(nodes: int) -> tuple[Array, Array]:
        place, weight = gauss(bounds, nodes)
        values = function(place.ravel()) * weight.ravel()
        return values.sum(axis=-1) / span, np.abs(values).sum(axis=-1) / span

    nodes = _FEWEST_NODES
    value, magnitude = integrate(nodes)
    while True:
        nodes *= 2
        finer, magnitude = integrate(nodes)
        change = np.abs(finer - value)
        value = finer
        if np.all(change <= tolerance * np.maximum(np.abs(value), CANCELLED * magnitude)) or nodes >= _MOST_NODES:
            return Means(value, change + _ROUNDING * magnitude, magnitude, nodes)


def samples(breaks: Array) -> Array:
    """Places that see every piece from inside, its two ends next to the breaks included; (pieces, places), rising."""
    bounds = subdivide(breaks)
    low, high = np.nextafter(bounds[:-1], np.inf), np.nextafter(bounds[1:], -np.inf)
    share = np.arange(_WITHIN + 1) / _WITHIN
    return np.minimum(low[:, None] + (high - low)[:, None] * share, high[:, None])


def maxima(function: Rows, breaks: Array, tolerance: float) -> Maxima:
    """Greatest values over the breaks' whole range; ``tolerance`` is relative to the greatest magnitudes.

    The highest humps of the samples, each within its own piece, are looked at again and again at ``_LOOKS`` places,
    eight times closer each time; near a smooth maximum the error falls with the square of the distance.
    """
    grid = samples(breaks)
    places, width = grid.ravel(), grid.shape[1]
    values = function(places)
    count = values.shape[0]
    pieces = values.reshape(count, -1, width)
    edge = np.full((*pieces.shape[:2], 1), -np.inf)
    before, after = np.dstack([edge, pieces[..., :-1]]), np.dstack([pieces[..., 1:], edge])
    height = np.where((pieces >= before) & (pieces >= after), pieces, -np.inf).reshape(count, -1)
    keep = min(_HUMPS, places.size)
    at = np.argpartition(-height, keep - 1, axis=1)[:, :keep]
    best, where = np.take_along_axis(values, at, axis=1), places[at]
    first, last = at - at % width, at - at % width + width - 1
    left, right = places[np.maximum(at - 1, first)], places[np.minimum(at + 1, last)]
    scale = np.max(np.abs(values), axis=1)
    rounds = max(1, math.ceil(math.log(LONGEST_PIECE / math.sqrt(tolerance), 8.0)))
    share = np.linspace(0.0, 1.0, _LOOKS)
    rows = np.arange(count)[:, None, None]
    missed = np.zeros_like(best)
    for _ in range(rounds):
        grid = left[..., None] + (right - left)[..., None] * share
        seen = function(grid.ravel())[rows, np.arange(grid.size).reshape(grid.shape)]
        top = np.argmax(seen, axis=-1)[..., None]
        found = np.take_along_axis(seen, top, axis=-1)[..., 0]
        better = found > best
        where = np.where(better, np.take_along_axis(grid, top, axis=-1)[..., 0], where)
        best = np.maximum(best, found)
        # A parabola through the best place and its neighbours rises above the best by an eighth of this at most.
        middle = np.clip(top, 1, _LOOKS - 2)
        bend = np.take_along_axis(seen, middle + np.array([-1, 0, 1]), axis=-1) @ np.array([1.0, -2.0, 1.0])
        missed = 0.25 * np.abs(bend)
        left = np.take_along_axis(grid, np.maximum(top - 1, 0), axis=-1)[..., 0]
        right = np.take_along_axis(grid, np.minimum(top + 1, _LOOKS - 1), axis=-1)[..., 0]
    winner = np.argmax(best, axis=1)
    row = np.arange(count)
    value = best[row, winner]
    return Maxima(value, where[row, winner], np.max(best + missed, axis=1) - value + _ROUNDING * scale)
