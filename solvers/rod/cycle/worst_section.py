"""Extremes over the whole turn and over all sections, found together.

All fields that are asked about share their rounds. Along the strip every station whose samples, or the parabolas
through them, leave room for the greatest value starts a bracket, on both fibres, because the clamp and the bulge inside
the span compete, and at the best strips they are equal. A round looks at five sections of every bracket; at each of
them the turn is climbed (``solvers.rod.cycle.extremes_in_time``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue.kernels import Diagram, severities, utilisation_of
from solvers.numerics import brackets
from solvers.numerics.brackets import mark_humps
from solvers.numerics.jit import kernel
from solvers.rod.cycle.composition import Array
from solvers.rod.cycle.extremes_in_time import RESOLVED, Turn
from solvers.rod.cycle.quantities import Gauges

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

    severity: Diagram
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
        keep = _reach(values) >= tops[owner]
        owner, layer, places, values = owner[keep], layer[keep], places[keep], values[keep]
        found = brackets.climb(evaluate, places, values, self.turn.tolerance * tops[owner])
        return self._finish(owner, layer, found)

    def _brackets(self) -> tuple[Rows, Rows, Array]:
        """Owner, layer and three stations of every bracket that may hold its contest's worst section."""
        stations, count = np.linspace(0.0, self.length, STATIONS), self.layers.shape[0]
        found = self.turn.sampled(Gauges(np.tile(self.layers, (STATIONS, 1)), np.repeat(stations, count)))
        high, low, *foretold = (part.reshape(STATIONS, count).T for part in found)
        marks = np.zeros((len(self.contests), count, STATIONS), dtype=np.bool_)
        for mine, contest in zip(marks, self.contests, strict=True):
            for profile in ((high, low), foretold):
                _mark_contenders(*profile, np.array(contest.layers), *contest.severity, mine)
        owner, layer, middle = np.nonzero(marks)
        return owner, layer, stations[np.clip(middle[:, None] + np.array([-1, 0, 1]), 0, STATIONS - 1)]

    def _severities(self, owner: Rows, high: Array, low: Array) -> Array:
        """Each row's severity is that of its contest; ``high`` and ``low`` have one row an owner, owners in order."""
        out = np.empty(high.shape)
        starts = np.searchsorted(owner, np.arange(len(self.contests) + 1))
        for contest, first, end in zip(self.contests, starts[:-1], starts[1:], strict=True):
            severities(high[first:end], low[first:end], *contest.severity, out[first:end])
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
        sections = self._sections(np.repeat(layers, 3), np.array(near))
        out = []
        for k, contest in enumerate(self.contests):
            mine = tuple(part[3 * k : 3 * k + 3] for part in sections)
            value, above, moved = _judged(*mine, *contest.severity)
            value, missing = max(value, bests[k][0]), bests[k][1]
            error = missing + max(above - value, 0.0)
            out.append(Worst(value, error, int(layers[k]), near[3 * k], float(mine[0][0]), float(mine[1][0]), moved))
        return out

    def _pinpoint(self, severity: Diagram, layer: int, place: float) -> tuple[float, float]:
        """The section of a smooth peak and how far off it may be.

        A climb knows the peak's value to the square of what it knows of its place, but the stress amplitude and mean
        at the peak change with the place itself. The derivative of a polynomial through seven sections has no such
        loss. Where the polynomial misses its own points the peak is a kink, and closer sections are tried.
        """
        length = self.length
        width = min(_WIDEST * length, place / 3.0, (length - place) / 3.0)
        while width > _NARROWEST * length:
            high, low, _, _ = self._sections(np.full(7, layer), place + width * _STEPS)
            values = np.empty(7)
            severities(high[None], low[None], *severity, values[None])
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
        return self.turn.extremes(Gauges(self.layers[layers], stations), _FINER * self.turn.tolerance)


@kernel
def _mark_contenders(
    high: Array, low: Array, layers: Rows, lines: Array, parabola: Array, marks: NDArray[np.bool_]
) -> None:
    """Mark, by layer and station, every sample that leaves room for the greatest severity of all these layers."""
    rows, count = layers.size, high.shape[1]
    table, peaks, top = np.empty((rows, count)), np.zeros((rows, count), dtype=np.bool_), -np.inf
    for row in range(rows):
        for j in range(count):
            table[row, j] = utilisation_of(high[layers[row], j], low[layers[row], j], lines, parabola)
            top = max(top, table[row, j])
        mark_humps(table[row], RESOLVED, False, peaks[row])
    need = top - 2.0 * RESOLVED * abs(top)
    for row in range(rows):
        for j in range(count):
            here, before, after = table[row, j], table[row, abs(j - 1)], table[row, j + 1 if j < count - 1 else j - 1]
            # What a parabola through the three, four times as bent, lets the peak reach: layers compete.
            if peaks[row, j] and here + 0.5 * abs(before - 2.0 * here + after) >= need:
                marks[layers[row], j] = True


@kernel
def _judged(
    high: Array, low: Array, high_error: Array, low_error: Array, lines: Array, parabola: Array
) -> tuple[float, float, float]:
    """Severity at the first of three sections, the same with both errors against it, and what moves between them."""
    value = utilisation_of(high[0], low[0], lines, parabola)
    above = utilisation_of(high[0] + high_error[0], low[0] - low_error[0], lines, parabola)
    half, middle, error = 0.0, 0.0, 0.0
    for i in range(high.size):
        error = max(error, high_error[i] + low_error[i])
        for j in range(i):
            half = max(half, 0.5 * abs((high[i] - low[i]) - (high[j] - low[j])))
            middle = max(middle, 0.5 * abs((high[i] + low[i]) - (high[j] + low[j])))
    return value, above, max(half, middle) + error


def _reach(values: Array) -> Array:
    """What parabolas through three values each, four times as bent, let their peaks reach."""
    return values.max(axis=1) + 0.5 * np.abs(values[:, 0] - 2.0 * values[:, 1] + values[:, 2])


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
