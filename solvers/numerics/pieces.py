"""Mean and maxima of functions that are smooth between given breaks and may jump at them.

Between breaks Gauss's rule converges geometrically; the change from n to 2n nodes is the error's estimate. A maximum is
looked for among samples of every piece, both one-sided limits included, and then by looking closer and closer at the
humps that may reach highest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Rows = Callable[[Array], Array]
"""From angles (n,) to quantities (k, n)."""

LONGEST_PIECE = math.pi / 16.0
_FEWEST_NODES, _MOST_NODES = 3, 48
_WITHIN = 6
CANCELLED = 1e-4
_MOST_HUMPS = 64
_FINER = 1e-2
"""Humps are not climbed that may rise above the highest sample by less of it than this share of the tolerance: a
greatest value far below the greatest magnitude is wanted to its own digits."""
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

    Of the humps of the samples, each within its own piece, those are climbed that may reach above the highest sample.
    How high the samples themselves are does not choose them: among many short pieces any slope has a hump a piece, all
    of them higher than the samples beside a narrow peak. ``_MOST_HUMPS`` bound the time; what is left out tells its
    reach as error.
    """
    grid = samples(breaks)
    values = function(grid.ravel())
    reach = _reach(values.reshape(len(values), -1, grid.shape[1])).reshape(values.shape)
    scale, top = np.max(np.abs(values), axis=1), np.argmax(values, axis=1)
    best = np.max(values, axis=1)
    need = best + _FINER * tolerance * np.abs(best) + _ROUNDING * scale
    most = min(_MOST_HUMPS, values.shape[1])
    highest = np.argpartition(-reach, most - 1, axis=1)[:, :most]
    row, column = np.nonzero(np.take_along_axis(reach, highest, axis=1) > need[:, None])
    at = highest[row, column]
    reach[row, at] = -np.inf
    found = Maxima(best, grid.ravel()[top], np.zeros(len(values)))
    found = _climb(function, grid, found, row, at, tolerance) if row.size else found
    left = np.maximum(np.max(reach, axis=1) - found.value, 0.0)
    return Maxima(found.value, found.place, np.maximum(found.error, left) + _ROUNDING * scale)


def _reach(pieces: Array) -> Array:
    """What a function four times as bent as its samples may reach between each hump and its neighbours.

    With K the bound of its bend over a step and d what the hump's higher neighbour lies below it, K/2 (1/2 - d/K)^2
    above the hump. From samples (k, pieces, places) to the same shape; -inf where there is no hump.
    """
    edge = np.full((*pieces.shape[:2], 1), np.inf)
    steps = np.diff(pieces, axis=-1)
    fall = np.minimum(np.dstack([edge, steps]), np.dstack([-steps, edge]))
    hump, reach = fall >= 0.0, np.full(pieces.shape, -np.inf)
    bend = np.abs(np.diff(steps, axis=-1))
    bend = np.dstack([bend[..., :1], bend, bend[..., -1:]])[hump]
    above = np.maximum(2.0 * bend - fall[hump], 0.0) ** 2 / np.maximum(8.0 * bend, np.finfo(float).tiny)
    reach[hump] = pieces[hump] + above
    return reach


def _climb(function: Rows, grid: Array, seen_best: Maxima, row: Index, at: Index, tolerance: float) -> Maxima:
    """The greatest values of each row, of the samples and of what lies near the samples ``at`` of ``row`` (humps,).

    Each hump is looked at again and again at ``_LOOKS`` places, eight times closer each time, as long as it may reach
    its row's best; near a smooth maximum the error falls with the square of the distance.
    """
    value, place = seen_best.value.copy(), seen_best.place.copy()
    places, width = grid.ravel(), grid.shape[1]
    first, last = at - at % width, at - at % width + width - 1
    left, right = places[np.maximum(at - 1, first)], places[np.minimum(at + 1, last)]
    rounds = max(1, math.ceil(math.log(LONGEST_PIECE / math.sqrt(tolerance), 8.0)))
    share, hump = np.linspace(0.0, 1.0, _LOOKS), np.arange(at.size)
    for _ in range(rounds):
        looks = left[:, None] + (right - left)[:, None] * share
        seen = function(looks.ravel())[row[:, None], np.arange(looks.size).reshape(looks.shape)]
        top = np.argmax(seen, axis=1)
        found, where = seen[hump, top], looks[hump, top]
        before = value.copy()
        np.maximum.at(value, row, found)
        wins = (found > before[row]) & (found == value[row])
        place[row[wins]] = where[wins]
        # A parabola through the best place and its neighbours rises above the best by an eighth of this at most.
        middle = np.clip(top, 1, _LOOKS - 2)
        bend = np.abs(seen[hump, middle - 1] - 2.0 * seen[hump, middle] + seen[hump, middle + 1])
        keep = found + 0.5 * bend >= value[row]
        top, row, looks, missed = top[keep], row[keep], looks[keep], (found + 0.25 * bend)[keep]
        if not row.size:
            break
        hump = np.arange(row.size)
        left, right = looks[hump, np.maximum(top - 1, 0)], looks[hump, np.minimum(top + 1, _LOOKS - 1)]
    reached = value.copy()
    np.maximum.at(reached, row, missed)
    return Maxima(value, place, reached - value)
