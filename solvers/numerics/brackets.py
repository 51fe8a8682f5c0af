"""Climbing many maxima at once: brackets that shrink around parabolas, one batch of evaluations a round.

Every row holds a bracket a <= c <= b with f(c) the greatest value known. A round evaluates five points of every
unfinished row in one call: the parabola's vertex with a near neighbour on either side, and the middles of both
halves. The best point of all and its neighbours make the next bracket, which is at most half as wide and, where the
function is smooth, twenty-five times narrower.

What a row may still gain is bounded by concavity: no chord between known points, extended, lies below the function.
At an end of the range (a = c or c = b) the chord through the two nearest points inside does the same. Where the
parabolas through the five nearest points agree in how much they bend, the function is smooth there, and the gain that
the middle one foretells is a far closer estimate; where they disagree, as at a kink, the chords stand.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

NEAR = 0.02
_ALIKE = 2.0
"""How much the bends of neighbouring parabolas may differ, as a ratio, where a function counts as smooth."""
_SAFETY = 8.0
"""Over the gain that a parabola foretells: what its neighbours' bends may add to it, and some."""
MOST_ROUNDS = 60
_EPS = np.finfo(float).eps

Evaluate = Callable[[Array, Rows], Array]
"""(points of shape (n, m), the rows they belong to, shape (n,)) -> values of shape (n, m)."""


@dataclass(frozen=True)
class Summits:
    """One entry a row: the place, the value there, a bound on what is missing, and the width of the last bracket."""

    place: Array
    value: Array
    error: Array
    width: Array


def climb(evaluate: Evaluate, places: Array, values: Array, tolerance: Array) -> Summits:
    """Climb every row from its bracket, ``places`` and ``values`` of shape (n, 3), to its absolute ``tolerance`` (n,).

    The function is taken to have one maximum in each bracket; without that the result is still one of its values.
    """
    places, values = np.array(places, dtype=float), np.array(values, dtype=float)
    count = places.shape[0]
    error = np.full(count, np.inf)
    rounding = 4.0 * _EPS * np.max(np.abs(values), axis=1, initial=0.0)
    todo = np.arange(count)
    for _ in range(MOST_ROUNDS):
        if not todo.size:
            break
        points = _trial(places, values, todo)
        _narrow(places, values, error, todo, points, np.ascontiguousarray(evaluate(points, todo)))
        width = places[todo, 2] - places[todo, 0]
        spent = width <= 8.0 * _EPS * np.maximum(np.abs(places[todo, 1]), _EPS)
        todo = todo[~((error[todo] <= np.maximum(tolerance[todo], rounding[todo])) | spent)]
    return Summits(places[:, 1], values[:, 1], np.maximum(error, rounding), places[:, 2] - places[:, 0])


@kernel
def _trial(places: Array, values: Array, todo: Rows) -> Array:
    """The five points of a round for every unfinished row, shape (rows, 5)."""
    out = np.empty((todo.size, 5))
    for n in range(todo.size):
        a, c, b = places[todo[n]]
        fa, fc, fb = values[todo[n]]
        left, right = (c - a) * (fc - fb), (b - c) * (fc - fa)
        vertex = c
        if left + right > 0.0:
            vertex = c + 0.5 * ((b - c) * right - (c - a) * left) / (left + right)
        vertex = min(max(vertex, a), b)
        near = NEAR * (b - a)
        out[n, 0], out[n, 1], out[n, 2] = max(vertex - near, a), vertex, min(vertex + near, b)
        out[n, 3], out[n, 4] = 0.5 * (a + c), 0.5 * (c + b)
    return out


@kernel
def _narrow(places: Array, values: Array, error: Array, todo: Rows, points: Array, heights: Array) -> None:
    """Replace every unfinished row's bracket by the best point and its nearest distinct neighbours, with its error."""
    x, f = np.empty(8), np.empty(8)
    for n in range(todo.size):
        row = todo[n]
        x[:3], f[:3], x[3:], f[3:] = places[row], values[row], points[n], heights[n]
        best = 0
        for m in range(1, 8):
            if f[m] > f[best]:
                best = m
        c, fc = x[best], f[best]
        # The two nearest points on either side: the neighbour, and the one its chord needs at an end.
        a, fa, a2, fa2 = -np.inf, 0.0, -np.inf, 0.0
        b, fb, b2, fb2 = np.inf, 0.0, np.inf, 0.0
        for m in range(8):
            if x[m] < c:
                if x[m] > a:
                    a2, fa2, a, fa = a, fa, x[m], f[m]
                elif a > x[m] > a2:
                    a2, fa2 = x[m], f[m]
            elif x[m] > c:
                if x[m] < b:
                    b2, fb2, b, fb = b, fb, x[m], f[m]
                elif b < x[m] < b2:
                    b2, fb2 = x[m], f[m]
        first, last = a == -np.inf, b == np.inf
        missing = 0.0
        if first and last:
            a, fa, b, fb = c, fc, c, fc
        elif first:
            missing = np.inf if b2 == np.inf else fb + (fb - fb2) * (b - c) / (b2 - b) - fc
            a, fa = c, fc
        elif last:
            missing = np.inf if a2 == -np.inf else fa + (fa - fa2) * (c - a) / (a - a2) - fc
            b, fb = c, fc
        else:
            missing = max((fc - fa) * (b - c) / (c - a), (fc - fb) * (c - a) / (b - c))
            if a2 != -np.inf and b2 != np.inf:
                bend = _bend(a, fa, c, fc, b, fb)
                before, after = _bend(a2, fa2, a, fa, c, fc), _bend(c, fc, b, fb, b2, fb2)
                if bend < 0.0 and bend * _ALIKE <= min(before, after) and max(before, after) * _ALIKE <= bend:
                    # The parabola's slope at c, from the mean of the chords' slopes weighted by the far ends.
                    slope = ((fc - fa) / (c - a) * (b - c) + (fb - fc) / (b - c) * (c - a)) / (b - a)
                    missing = min(missing, _SAFETY * slope * slope / (-4.0 * bend))
        error[row] = max(missing, 0.0)
        places[row, 0], places[row, 1], places[row, 2] = a, c, b
        values[row, 0], values[row, 1], values[row, 2] = fa, fc, fb


@kernel
def _bend(a: float, fa: float, c: float, fc: float, b: float, fb: float) -> float:
    """Second divided difference: half the second derivative of the parabola through three points."""
    return ((fb - fc) / (b - c) - (fc - fa) / (c - a)) / (b - a)


def humps(samples: Array, slack: float, closed: bool) -> tuple[Rows, Rows]:
    """(row, column) of every local maximum of the samples, shape (rows, n), that may hold its row's greatest value.

    A hump may rise above its sample by half its second difference (a parabola rises by an eighth), and by ``slack``
    times the row's largest magnitude. ``closed`` says that the samples close on themselves; otherwise the ends count.
    Of a plateau, level to rounding, the first sample stands for all; a row that is level everywhere has its highest.
    """
    peaks = np.zeros(samples.shape, dtype=np.bool_)
    _mark_humps(np.ascontiguousarray(samples), slack, closed, peaks)
    return np.nonzero(peaks)


@kernel
def _mark_humps(samples: Array, slack: float, closed: bool, peaks: NDArray[np.bool_]) -> None:
    rows, count = samples.shape
    for row in range(rows):
        highest, size = 0, 0.0
        for n in range(count):
            if samples[row, n] > samples[row, highest]:
                highest = n
            size = max(size, abs(samples[row, n]))
        need = samples[row, highest] - slack * size
        bare = True
        for n in range(count):
            # Beyond the ends of an open row lies what mirrors its inside.
            before = samples[row, n - 1] if n > 0 else samples[row, count - 1 if closed else 1]
            after = samples[row, n + 1] if n < count - 1 else samples[row, 0 if closed else count - 2]
            here = samples[row, n]
            # A deep trough elsewhere in the row does not make a low hill level.
            level = 8.0 * _EPS * max(abs(before), abs(here), abs(after))
            rises = here >= before - level if n == 0 and not closed else here > before + level
            reach = here + 0.5 * abs(before - 2.0 * here + after)
            if rises and here >= after - level and reach >= need:
                peaks[row, n] = True
                bare = False
        if bare:
            peaks[row, highest] = True
