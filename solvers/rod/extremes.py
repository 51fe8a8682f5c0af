"""Extremes over the whole turn and over all sections, found together.

Every quantity that is wanted is a row; all rows are sampled at the same angles and climbed in the same batches
(``solvers.numerics.brackets``), so that one evaluation of the cycle serves them all. Fields over the strip are climbed
along the strip as well: every station whose samples leave room for the greatest value starts a bracket, on both fibres,
because the clamp and the bulge inside the span compete, and at the best strips they are equal.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.numerics import brackets, periodic
from solvers.rod.cycle import Array, Cycle, Instants

STATIONS = 25
RESOLVED = 1e-2
"""What the samples of every row foretell of their midpoints, relative to the row's greatest magnitude."""

_EPS = np.finfo(float).eps
_SMALL = 1e-9
_STEPS = np.arange(-3, 4)
_WIDEST, _NARROWEST = 2e-3, 1e-6

Rows = NDArray[np.intp]
Reading = Callable[[Instants], Array]
"""A quantity of the machine at some instants, shape (instants,)."""

Field = Callable[[Instants, Array], Array]
"""Layers of a field over the strip at some instants and stations, shape (layers, stations, instants)."""

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
class Worst:
    """Where a severity is greatest: its value and error, layer and station, the extremes there and their error."""

    value: float
    error: float
    layer: int
    station: float
    high: float
    low: float
    extremes_error: float

    @property
    def relative_error(self) -> float:
        return self.error / abs(self.value) if self.value else 0.0


@dataclass(frozen=True)
class Turn:
    """One cycle, sampled finely enough for every row, and the relative tolerance its extremes are wanted to."""

    cycle: Cycle
    tolerance: float

    @cached_property
    def instants(self) -> Instants:
        def rows(angle: Array) -> Array:
            now = self.cycle.at(angle)
            return np.stack([now.force, now.shape.clamp_moment(), now.shape.side_force()])

        sharp = self.cycle.scene.load.sharp_angles()
        if sharp.size:
            return self.cycle.at(periodic.resolve_from(rows, RESOLVED, sharp))
        return self.cycle.at(periodic.resolve(rows, RESOLVED))

    def greatest(self, readings: Sequence[Reading]) -> list[Extreme]:
        """The greatest value of every reading over the continuous turn."""
        samples = np.stack([reading(self.instants) for reading in readings])

        def evaluate(angle: Array, rows: Rows) -> Array:
            now = self.cycle.at(angle.ravel())
            every = np.stack([reading(now) for reading in readings]).reshape(len(readings), *angle.shape)
            return every[rows, np.arange(angle.shape[0])]

        # Where a reading stays below zero its greatest value may be small beside its least, and is wanted all the same.
        wanted = self.tolerance * np.maximum(np.abs(samples.max(axis=1)), _SMALL * np.abs(samples).max(axis=1))
        values, errors = self._maxima(samples, evaluate, wanted)
        return [Extreme(float(v), float(e)) for v, e in zip(values, errors, strict=True)]

    def _maxima(self, samples: Array, evaluate: brackets.Evaluate, wanted: Array) -> tuple[Array, Array]:
        """Greatest value of every row of samples, shape (rows, angles), to the absolute error wanted; and its error."""
        rows, at = brackets.humps(samples, RESOLVED, closed=True)
        angle, count = self.instants.angle, self.instants.angle.size
        before = angle[at - 1] - np.where(at == 0, periodic.TURN, 0.0)
        after = angle[(at + 1) % count] + np.where(at == count - 1, periodic.TURN, 0.0)
        places = np.stack([before, angle[at], after], axis=1)
        values = np.stack([samples[rows, (at + shift) % count] for shift in (-1, 0, 1)], axis=1)
        found = brackets.climb(lambda x, todo: evaluate(x, rows[todo]), places, values, wanted[rows])
        best, error = np.full(samples.shape[0], -np.inf), np.zeros(samples.shape[0])
        np.maximum.at(best, rows, found.value)
        # A lower hump matters as far as its own error lets it reach above the highest.
        np.maximum.at(error, rows, found.value + found.error - best[rows])
        return best, np.maximum(error, 0.0)

    def worst(self, field: Field, severities: Sequence[tuple[Severity, tuple[int, ...]]]) -> list[Worst]:
        """For every severity and the layers it looks at: where it is greatest over all sections and those layers."""
        search = _SectionSearch(self, field)
        return search.worst(severities)


@dataclass(frozen=True)
class _SectionSearch:
    turn: Turn
    field: Field

    def worst(self, severities: Sequence[tuple[Severity, tuple[int, ...]]]) -> list[Worst]:
        length = self.turn.cycle.dimensions.l
        stations = np.linspace(0.0, length, STATIONS)
        samples = self.field(self.turn.instants, stations)
        high, low = samples.max(axis=2), samples.min(axis=2)
        owner, layer, places, values = [], [], [], []
        for k, (severity, layers) in enumerate(severities):
            table = severity(high[list(layers)], low[list(layers)])
            # The layers of one severity compete, so each must only reach the best of all.
            top = table.max()
            rows, at = brackets.humps(table, RESOLVED, closed=False)
            keep = _reach(table, rows, at) >= top - 2.0 * RESOLVED * abs(top)
            for row, j in zip(rows[keep], at[keep], strict=True):
                around = [max(j - 1, 0), j, min(j + 1, STATIONS - 1)]
                owner.append(k)
                layer.append(layers[row])
                places.append(stations[around])
                values.append(table[row, around])
        owner, layer = np.array(owner), np.array(layer)
        kinds = [severity for severity, _ in severities]

        def evaluate(station: Array, rows: Rows) -> Array:
            layers = np.repeat(layer[rows], station.shape[1])
            high, low, _, _ = self._sections(layers, station.ravel())
            high, low = high.reshape(station.shape), low.reshape(station.shape)
            return np.stack([kinds[owner[row]](high[i], low[i]) for i, row in enumerate(rows)])

        # The samples' extremes are those of the sampled angles; brackets hold refined values only.
        places = np.array(places)
        values = evaluate(places, np.arange(owner.size))
        tops = np.zeros(len(kinds))
        np.maximum.at(tops, owner, values.max(axis=1))
        found = brackets.climb(evaluate, places, values, self.turn.tolerance * tops[owner])
        return [self._finish(kind, k, owner, layer, found) for k, kind in enumerate(kinds)]

    def _finish(self, severity: Severity, k: int, owner: Rows, layer: Rows, found: brackets.Summits) -> Worst:
        mine = np.flatnonzero(owner == k)
        best = mine[int(np.argmax(found.value[mine]))]
        missing = float(np.max(found.value[mine] + found.error[mine]) - found.value[best])
        length, place = self.turn.cycle.dimensions.l, float(found.place[best])
        inside = 0.0 < place < length
        place, doubt = self._pinpoint(severity, int(layer[best]), place) if inside else (place, 0.0)
        near = np.array([place, max(place - doubt, 0.0), min(place + doubt, length)])
        high, low, high_error, low_error = self._sections(np.full(3, layer[best]), near)
        value = max(float(severity(high[:1], low[:1])[0]), float(found.value[best]))
        above = float(severity(high[:1] + high_error[:1], low[:1] - low_error[:1])[0]) - value
        half, middle = 0.5 * (high - low), 0.5 * (high + low)
        moved = max(float(np.ptp(half)), float(np.ptp(middle))) + float(np.max(high_error + low_error))
        return Worst(
            value, max(missing, 0.0) + max(above, 0.0), int(layer[best]), place, float(high[0]), float(low[0]), moved
        )

    def _pinpoint(self, severity: Severity, layer: int, place: float) -> tuple[float, float]:
        """The section of a smooth peak and how far off it may be.

        A climb knows the peak's value to the square of what it knows of its place, but the stress amplitude and mean
        at the peak change with the place itself. The derivative of a polynomial through seven sections has no such
        loss. Where the polynomial misses its own points the peak is a kink, and closer sections are tried.
        """
        length = self.turn.cycle.dimensions.l
        width = min(_WIDEST * length, place / 3.0, (length - place) / 3.0)
        while width > _NARROWEST * length:
            high, low, _, _ = self._sections(np.full(7, layer), place + width * _STEPS)
            values = severity(high, low)
            scale = float(np.max(np.abs(values)))
            series, (residual, *_) = np.polynomial.polynomial.polyfit(_STEPS, values / scale, 4, full=True)
            slopes = np.polynomial.polynomial.polyder(series)
            roots = np.roots(slopes[::-1])
            roots = roots[(np.abs(roots.imag) < 1e-9) & (np.abs(roots.real) <= 3.0)].real
            misfit = float(np.sqrt(residual[0])) if len(residual) else 0.0
            bend = abs(float(series[2]))
            if roots.size and bend > 0 and misfit <= 1e-4 * bend:
                root = float(roots[np.argmin(np.abs(roots))])
                return place + width * root, width * (misfit + 4.0 * _EPS) / bend
            width /= 4.0
        return place, max(width, 0.0)

    def _sections(self, layers: Rows, stations: Array) -> tuple[Array, Array, Array, Array]:
        """Greatest and least value over the turn at pairs of layer and station, and their errors, shape (pairs,)."""
        turn = self.turn
        distinct, index = np.unique(stations, return_inverse=True)
        samples = self.field(turn.instants, distinct)[layers, index]
        pairs = stations.size

        def evaluate(angle: Array, rows: Rows) -> Array:
            now = turn.cycle.at(angle.ravel())
            pair, sign = rows % pairs, np.where(rows < pairs, 1.0, -1.0)
            used, where = np.unique(index[pair], return_inverse=True)
            every = self.field(now, distinct[used])
            every = every.reshape(every.shape[0], used.size, *angle.shape)
            return sign[:, None] * every[layers[pair], where, np.arange(angle.shape[0])]

        # Extremes of sections that are compared must be smoother than what is wanted of the comparison.
        samples = np.concatenate([samples, -samples])
        wanted = 1e-2 * turn.tolerance * np.abs(samples).max(axis=1)
        found, error = turn._maxima(samples, evaluate, wanted)
        return found[:pairs], -found[pairs:], error[:pairs], error[pairs:]


def _reach(table: Array, rows: Rows, at: Rows) -> Array:
    """What a parabola through a sample and its neighbours, four times as bent, lets the sample's peak reach."""
    last = table.shape[1] - 1
    left, right = table[rows, np.abs(at - 1)], table[rows, last - np.abs(last - at - 1)]
    here = table[rows, at]
    return here + 0.5 * np.abs(left - 2.0 * here + right)
