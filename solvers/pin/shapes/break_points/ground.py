"""Common basis of the step search: the bar, the price of length, and bracketing of the multiplier."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.pin.optimum.one_station import flexibilities, place, slopes
from solvers.pin.shapes.break_points.bar import Bar, Sums, Walls
from solvers.pin.shapes.break_points.cells import Cells, points
from solvers.pin.shapes.break_points.chain import Chain, chained

Array = NDArray[np.float64]

APART = 1e-12
"""Distance below which two positions of the bar, 0 to 1, are identical."""
_MAX_TRIALS = 60
_MULTIPLIER_TOLERANCE = 1e-4
_SAMPLES_PER_EDGE = 8


@dataclass(frozen=True)
class Around:
    """The cheapest paths just below and just above the critical multiplier, at which their deflection passes the
    limit.

    With the multiplier, the greatest minimum of the Lagrangian, all paths evaluated, and the chains' work.
    """

    multiplier: float
    value: float
    soft: Array
    stiff: Array
    seen: list[Array]
    work: int


@dataclass(frozen=True)
class Ground:
    """A bar with its deflection integrals; ``sums`` is None without a binding deflection limit.

    Order prices are defined at the ``edges``.
    """

    bar: Bar
    sums: Sums | None
    edges: Array

    @cached_property
    def ends(self) -> tuple[Cells, Cells]:
        """The end and the middle of the bar as cells of zero width."""
        return points(self.bar, np.zeros(1), self.sums), points(self.bar, np.ones(1), self.sums)

    def chain(self, layers: list[Cells], price: Array, multiplier: float) -> Chain:
        """Return the chain of these layers between the bar's two ends."""
        return chained(self._priced(layers, price), multiplier, self.bar.law)

    def _priced(self, layers: list[Cells], price: Array) -> list[Cells]:
        """Return the layers between the bar's two ends, at this price of order."""
        if price.any():
            priced = {id(layer): layer.priced(self.edges, price) for layer in layers}
            layers = [priced[id(layer)] for layer in layers]
        return [self.ends[0], *layers, self.ends[1]]

    def walls(self, places: Array) -> Walls | None:
        """Return the lightest walls for these break points; None if none is stiff enough."""
        if self.sums is not None:
            return self.bar.weigh(places)
        levels = self.bar.least(places)
        return Walls(levels, float(levels @ np.diff(places, prepend=0.0)), 0.0)

    def at(self, layers: list[Cells], price: Array, multiplier: float) -> Around:
        """Return the cheapest path for one multiplier."""
        chain = self.chain(layers, price, multiplier)
        path = chain.path
        return Around(multiplier, chain.total - multiplier, path, path, [path], chain.work)

    def around(self, layers: list[Cells], price: Array, start: float, spread: float) -> Around:
        """Bisect on the multiplier, from ``start`` in steps that grow from ``spread``; the layers are points."""
        low, high, multiplier, value, seen, work = 0.0, math.inf, start, -math.inf, [], 0
        soft = stiff = np.zeros(0)
        priced = self._priced(layers, price)
        for _ in range(_MAX_TRIALS):
            chain = chained(priced, multiplier, self.bar.law)
            path = chain.path
            seen.append(path)
            work += chain.work
            value = max(value, chain.total - multiplier)
            if self._deflection(chain, multiplier) > 1.0:
                low, soft = multiplier, path
            else:
                high, stiff = multiplier, path
            if high < math.inf and high - low <= _MULTIPLIER_TOLERANCE * high:
                break
            if low > 0.0 and high < math.inf:
                multiplier = math.sqrt(low * high)
            else:
                multiplier *= spread if high == math.inf else 1.0 / spread
                spread *= spread
        return Around(multiplier, value, soft if soft.size else stiff, stiff if stiff.size else soft, seen, work)

    def _deflection(self, chain: Chain, multiplier: float) -> float:
        """Return the relative deflection of the cheapest path's walls, regardless of their order."""
        law, total = self.bar.law, 0.0
        widths, _, _, bends, shears = np.maximum(np.diff(chain.ends, axis=0), 0.0).T.tolist()
        for width, floor, bend, shear in zip(widths, chain.ends[1:, 1].tolist(), bends, shears, strict=True):
            if bend > 0.0 or shear > 0.0:
                u = place(multiplier, width, bend, shear, floor, 0.5, law.kappa, law.a, law.b)
                beta, phi = flexibilities(max(u, 1e-300), law.kappa, law.a, law.b)
                total += bend * beta + shear * phi
        return total

    def price_of_order(self, places: Array, walls: Walls) -> Array:
        """Return the order price m at the edges, which keeps a step from splitting into decreasing steps.

        -(t - t0) - lambda (beta' (B(t) - B(t0)) + phi' (S(t) - S(t0))), 0 at both ends of a step whose wall is
        governed by the deflection; where that is negative, the step would rather increase, and m is 0.
        """
        price, law = np.zeros_like(self.edges), self.bar.law
        if not 0.0 < walls.multiplier < math.inf:
            return price
        floors = self.bar.least(places)
        starts = np.flatnonzero(np.diff(walls.levels, prepend=-1.0))
        for first, last in zip(starts, [*(starts[1:] - 1), walls.levels.size - 1], strict=True):
            begin, end, u = places[first - 1] if first else 0.0, places[last], walls.levels[last]
            inside = (self.edges > begin) & (self.edges < end)
            if not inside.any() or u <= floors[last] * (1.0 + 1e-9):
                continue
            at = self.edges[inside]
            bend, shear = self.sums.upto(at) - self.sums.upto(np.array([begin]))
            beta, phi = slopes(u, law.kappa, law.a, law.b)
            price[inside] = np.maximum(begin - at - walls.multiplier * (bend * beta + shear * phi), 0.0)
        return price


def ground(bar: Bar, sums: Sums | None, count: int) -> Ground:
    """Return the common basis with edges at the bar's kinks and at most 1/``count`` apart."""
    edges = np.union1d(np.linspace(0.0, 1.0, count + 1), bar.edges)
    edges = np.union1d(edges, _plateau_ends(bar, edges))
    return Ground(bar, sums, edges[np.concatenate([[True], np.diff(edges) > APART])])


def _plateau_ends(bar: Bar, edges: Array) -> list[float]:
    """Return where the lower bound of u stops and resumes increasing: f has kinks there, and breaks favour the
    latter."""
    t = np.unique(edges[:-1, None] + np.diff(edges)[:, None] * np.linspace(0.0, 1.0, _SAMPLES_PER_EDGE + 1))
    level = bar.least(t)
    flat = np.concatenate([[False], np.diff(level) <= 0.0, [False]])
    begins, ends = (np.flatnonzero(where) for where in (~flat[:-1] & flat[1:], flat[:-1] & ~flat[1:]))
    found = []
    for begin, end in zip(begins, ends, strict=True):
        top = level[begin]
        if begin:
            found.append(_crossing(bar, t[begin - 1], t[begin], top, 1.0))
        if end + 1 < t.size:
            found.append(_crossing(bar, t[end], t[end + 1], top, 1.0 + 1e-14))
    return found


def _crossing(bar: Bar, low: float, high: float, top: float, times: float) -> float:
    """Return where f reaches ``times`` ``top``."""
    while high - low > 1e-15:
        grid = np.linspace(low, high, 65)
        first = int(np.argmax(bar.least(grid) >= top * times))
        if first == 0 or (grid[first - 1] <= low and grid[first] >= high):
            break
        low, high = float(grid[first - 1]), float(grid[first])
    return high if times == 1.0 else low
