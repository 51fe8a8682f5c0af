"""Extremes over the whole turn and over all sections, found together.

All fields that are asked about share their rounds. Along the strip every station whose samples leave room for the
greatest value starts a bracket, on both fibres, because the clamp and the bulge inside the span compete, and at the
best strips they are equal. A round looks at five sections of every bracket; at each of them the turn is climbed
(``solvers.rod.turn``).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.numerics import brackets
from solvers.rod.cycle import Array
from solvers.rod.gauges import Gauges
from solvers.rod.turn import RESOLVED, Turn

STATIONS = 25

_EPS = np.finfo(float).eps
_SMALL = 1e-9
_FINER = 1e-2
"""Extremes of sections that are compared must be smoother than what is wanted of the comparison."""

_STEPS = np.arange(-3, 4)
_POWERS = np.vander(_STEPS, 5, increasing=True).astype(float)
_QUARTIC = np.linalg.pinv(_POWERS)
"""Seven values at equal steps to the polynomial of degree four closest to them."""

_WIDEST, _NARROWEST = 2e-3, 1e-6
_NEWTON_STEPS = 20

Rows = NDArray[np.intp]

Severity = Callable[[Array, Array], Array]
"""Of the greatest and the least value over the turn: rises with the one, falls with the other."""


@dataclass(frozen=True)
class Extreme:
    """A value and an estimate of its absolute error."""

    value: float
    error: float

    @property
    def relative_error(self) -> float:
        return self.error / abs(self.value) if self.value else 0.0


@dataclass(frozen=True)
class Worst(Extreme):
    """Where a severity is greatest: beside its value, layer and station, the extremes there and their error."""

    layer: int
    station: float
    high: float
    low: float
    extremes_error: float


@dataclass(frozen=True)
class Contest:
    """A severity and the layers of the field whose cycles it compares; ``located`` asks for the very section."""

    severity: Severity
    layers: tuple[int, ...]
    located: bool = False


def greatest(turn: Turn, weights: Array) -> list[Extreme]:
    """The greatest value over the continuous turn of gauges that no section matters to."""
    # Where a gauge stays below zero its greatest value may be small beside its least, and is wanted all the same.
    values, errors = turn.greatest(Gauges.at_piston(weights), turn.tolerance, _SMALL)
    return [Extreme(float(v), float(e)) for v, e in zip(values, errors, strict=True)]


def worst(turn: Turn, layers: Array, contests: Sequence[Contest]) -> list[Worst]:
    """For every contest: where its severity is greatest, over all sections and its layers.

    ``layers`` holds the weights of the gauges that are read along the strip, shape (layers, 6).
    """
    return _SectionSearch(turn, layers, tuple(contests)).worst()


@dataclass(frozen=True)
class _SectionSearch:
    turn: Turn
    layers: Array
    contests: tuple[Contest, ...]

    @property
    def length(self) -> float:
        return self.turn.cycle.dimensions.l

    def worst(self) -> list[Worst]:
        owner, layer, places = self._brackets()

        def evaluate(station: Array, rows: Rows) -> Array:
            high, low, _, _ = self._sections(np.repeat(layer[rows], station.shape[1]), station.ravel())
            return self._severities(owner[rows], high.reshape(station.shape), low.reshape(station.shape))

        # The samples' extremes are those of the sampled angles; brackets hold refined values only.
        values = evaluate(places, np.arange(owner.size))
        tops = np.zeros(len(self.contests))
        np.maximum.at(tops, owner, values.max(axis=1))
        found = brackets.climb(evaluate, places, values, self.turn.tolerance * tops[owner])
        return self._finish(owner, layer, found)

    def _brackets(self) -> tuple[Rows, Rows, Array]:
        """Owner, layer and three stations of every bracket that may hold its contest's worst section."""
        stations, count = np.linspace(0.0, self.length, STATIONS), self.layers.shape[0]
        high, low = self.turn.sampled(Gauges(np.tile(self.layers, (STATIONS, 1)), np.repeat(stations, count)))
        high, low = high.reshape(STATIONS, count).T, low.reshape(STATIONS, count).T
        owner, layer, at = [], [], []
        for k, contest in enumerate(self.contests):
            chosen = np.array(contest.layers)
            table = contest.severity(high[chosen], low[chosen])
            # The layers of one contest compete, so each must only reach the best of all.
            top = table.max()
            rows, columns = brackets.humps(table, RESOLVED, closed=False)
            keep = _reach(table, rows, columns) >= top - 2.0 * RESOLVED * abs(top)
            owner.append(np.full(np.count_nonzero(keep), k))
            layer.append(chosen[rows[keep]])
            at.append(columns[keep])
        middle = np.concatenate(at)[:, None]
        places = stations[np.clip(middle + np.array([-1, 0, 1]), 0, STATIONS - 1)]
        return np.concatenate(owner), np.concatenate(layer), places

    def _severities(self, owner: Rows, high: Array, low: Array) -> Array:
        """Each row's severity is that of its contest; ``high`` and ``low`` have one row an owner."""
        out = np.empty(high.shape)
        for k, contest in enumerate(self.contests):
            mine = owner == k
            out[mine] = contest.severity(high[mine], low[mine])
        return out

    def _finish(self, owner: Rows, layer: Rows, found: brackets.Summits) -> list[Worst]:
        bests, layers, near = [], [], []
        for k, contest in enumerate(self.contests):
            mine = np.flatnonzero(owner == k)
            best = mine[int(np.argmax(found.value[mine]))]
            place, doubt = float(found.place[best]), 0.0
            if contest.located and 0.0 < place < self.length:
                place, doubt = self._pinpoint(contest.severity, int(layer[best]), place)
            missing = float(np.max(found.value[mine] + found.error[mine]) - found.value[best])
            bests.append((float(found.value[best]), max(missing, 0.0)))
            layers.append(layer[best])
            near += [place, max(place - doubt, 0.0), min(place + doubt, self.length)]
        high, low, high_error, low_error = self._sections(np.repeat(layers, 3), np.array(near))
        out = []
        for k, contest in enumerate(self.contests):
            part, first, (value, missing) = slice(3 * k, 3 * k + 3), slice(3 * k, 3 * k + 1), bests[k]
            value = max(float(contest.severity(high[first], low[first])[0]), value)
            above = contest.severity(high[first] + high_error[first], low[first] - low_error[first])
            half, middle = 0.5 * (high[part] - low[part]), 0.5 * (high[part] + low[part])
            moved = max(np.ptp(half), np.ptp(middle)) + np.max(high_error[part] + low_error[part])
            error = missing + max(float(above[0]) - value, 0.0)
            out.append(
                Worst(value, error, int(layers[k]), near[3 * k], float(high[3 * k]), float(low[3 * k]), float(moved))
            )
        return out

    def _pinpoint(self, severity: Severity, layer: int, place: float) -> tuple[float, float]:
        """The section of a smooth peak and how far off it may be.

        A climb knows the peak's value to the square of what it knows of its place, but the stress amplitude and mean
        at the peak change with the place itself. The derivative of a polynomial through seven sections has no such
        loss. Where the polynomial misses its own points the peak is a kink, and closer sections are tried.
        """
        length = self.length
        width = min(_WIDEST * length, place / 3.0, (length - place) / 3.0)
        while width > _NARROWEST * length:
            high, low, _, _ = self._sections(np.full(7, layer), place + width * _STEPS)
            values = severity(high, low)
            # Less the middle one, of which the fit would otherwise leave its own rounding.
            values = (values - values[3]) / np.max(np.abs(values))
            series = _QUARTIC @ values
            misfit = float(np.linalg.norm(_POWERS @ series - values))
            root, bend = _level(series), abs(float(series[2]))
            if root is not None and bend > 0 and misfit <= 1e-4 * bend:
                return place + width * root, width * (misfit + 4.0 * _EPS) / bend
            width /= 4.0
        return place, max(width, 0.0)

    def _sections(self, layers: Rows, stations: Array) -> tuple[Array, Array, Array, Array]:
        """Greatest and least value over the turn at pairs of layer and station, and their errors, shape (pairs,)."""
        order = np.lexsort((layers, stations))
        weights = self.layers[layers[order]]
        both = Gauges(
            np.stack([weights, -weights], axis=1).reshape(-1, weights.shape[1]), np.repeat(stations[order], 2)
        )
        found, error = self.turn.greatest(both, _FINER * self.turn.tolerance, 1.0)
        values, errors = np.empty((stations.size, 2)), np.empty((stations.size, 2))
        values[order], errors[order] = found.reshape(-1, 2), error.reshape(-1, 2)
        return values[:, 0], -values[:, 1], errors[:, 0], errors[:, 1]


def _reach(table: Array, rows: Rows, at: Rows) -> Array:
    """What a parabola through a sample and its neighbours, four times as bent, lets the sample's peak reach."""
    last = table.shape[1] - 1
    left, right = table[rows, np.abs(at - 1)], table[rows, last - np.abs(last - at - 1)]
    here = table[rows, at]
    return here + 0.5 * np.abs(left - 2.0 * here + right)


def _level(series: Array) -> float | None:
    """Where, within the seven points and by Newton's steps from the middle, a polynomial of degree four is level."""
    _, a, b, c, d = series.tolist()
    x = 0.0
    for _ in range(_NEWTON_STEPS):
        bend = 2.0 * b + x * (6.0 * c + x * 12.0 * d)
        if bend == 0.0:
            return None
        step = (a + x * (2.0 * b + x * (3.0 * c + x * 4.0 * d))) / bend
        x -= step
        if not abs(x) <= 3.0:
            return None
        if abs(step) <= 4.0 * _EPS:
            break
    return x
