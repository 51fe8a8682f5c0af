"""Climbing many maxima at once: brackets that shrink around parabolas, one batch of evaluations a round.

Every row holds a bracket a <= c <= b with f(c) the greatest value known. A round evaluates five points of every
unfinished row in one call: the parabola's vertex with a near neighbour on either side, and the middles of both
halves. The best point of all and its neighbours make the next bracket, which is at most half as wide and, where the
function is smooth, twenty-five times narrower.

What a row may still gain is bounded by concavity: no chord between known points, extended, lies below the function.
At an end of the range (a = c or c = b) the chord through the two nearest points inside does the same.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

NEAR = 0.02
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
    places, values = places.copy(), values.copy()
    count = places.shape[0]
    error = np.full(count, np.inf)
    rounding = 4.0 * _EPS * np.max(np.abs(values), axis=1, initial=0.0)
    todo = np.arange(count)
    for _ in range(MOST_ROUNDS):
        if not todo.size:
            break
        points = _trial(places[todo], values[todo])
        x = np.concatenate([places[todo], points], axis=1)
        f = np.concatenate([values[todo], evaluate(points, todo)], axis=1)
        order = np.argsort(x, axis=1, kind="stable")
        x, f = np.take_along_axis(x, order, axis=1), np.take_along_axis(f, order, axis=1)
        places[todo], values[todo], error[todo] = _narrow(x, f)
        width = places[todo, 2] - places[todo, 0]
        spent = width <= 8.0 * _EPS * np.maximum(np.abs(places[todo, 1]), _EPS)
        todo = todo[~((error[todo] <= np.maximum(tolerance[todo], rounding[todo])) | spent)]
    return Summits(places[:, 1], values[:, 1], np.maximum(error, rounding), places[:, 2] - places[:, 0])


def _trial(x: Array, f: Array) -> Array:
    a, c, b = x.T
    fa, fc, fb = f.T
    left, right = (c - a) * (fc - fb), (b - c) * (fc - fa)
    bend = left + right
    safe = np.where(bend > 0, bend, 1.0)
    vertex = np.where(bend > 0, c + 0.5 * ((b - c) * right - (c - a) * left) / safe, c)
    near = NEAR * (b - a)
    vertex = np.clip(vertex, a, b)
    spread = np.stack([vertex - near, vertex, vertex + near, 0.5 * (a + c), 0.5 * (c + b)], axis=1)
    return np.clip(spread, a[:, None], b[:, None])


def _narrow(x: Array, f: Array) -> tuple[Array, Array, Array]:
    rows, last = np.arange(x.shape[0]), x.shape[1] - 1
    # Points may coincide; the neighbours are the nearest that do not.
    best = np.argmax(f, axis=1)
    c, fc = x[rows, best], f[rows, best]
    before, after = x < c[:, None], x > c[:, None]
    i = np.where(before.any(axis=1), before.sum(axis=1) - 1, best)
    j = np.where(after.any(axis=1), last + 1 - after.sum(axis=1), best)
    a, fa, b, fb = x[rows, i], f[rows, i], x[rows, j], f[rows, j]
    to_left, to_right = c - a, b - c
    with np.errstate(divide="ignore", invalid="ignore"):
        inside = np.maximum((fc - fa) * to_right / to_left, (fc - fb) * to_left / to_right)
        # At an end: the chord through the two nearest points inside, extended to the end.
        following = np.minimum(last + 1 - (x > b[:, None]).sum(axis=1), last)
        beyond = x[rows, following] - b
        at_start = fb + (fb - f[rows, following]) * to_right / beyond - fc
        preceding = np.maximum((x < a[:, None]).sum(axis=1) - 1, 0)
        ahead = a - x[rows, preceding]
        at_finish = fa + (fa - f[rows, preceding]) * to_left / ahead - fc
        at_start, at_finish = np.where(beyond > 0, at_start, np.inf), np.where(ahead > 0, at_finish, np.inf)
    error = np.where(to_left <= 0, at_start, np.where(to_right <= 0, at_finish, inside))
    error = np.where((to_left <= 0) & (to_right <= 0), 0.0, np.maximum(error, 0.0))
    return np.stack([a, c, b], axis=1), np.stack([fa, fc, fb], axis=1), error


def humps(samples: Array, slack: float, closed: bool) -> tuple[Rows, Rows]:
    """(row, column) of every local maximum of the samples, shape (rows, n), that may hold its row's greatest value.

    A hump may rise above its sample by half its second difference (a parabola rises by an eighth), and by ``slack``
    times the row's largest magnitude. ``closed`` says that the samples close on themselves; otherwise the ends count.
    """
    if closed:
        left, right = np.roll(samples, 1, axis=1), np.roll(samples, -1, axis=1)
    else:
        left = np.concatenate([samples[:, 1:2], samples[:, :-1]], axis=1)
        right = np.concatenate([samples[:, 1:], samples[:, -2:-1]], axis=1)
    reach = samples + 0.5 * np.abs(left - 2.0 * samples + right)
    need = samples.max(axis=1, keepdims=True) - slack * np.abs(samples).max(axis=1, keepdims=True)
    # Of a plateau, level to rounding, the first sample stands for all; a row that is level everywhere has its highest.
    level = 8.0 * _EPS * np.abs(samples).max(axis=1, keepdims=True)
    rising = samples > left + level
    if not closed:
        rising[:, 0] = samples[:, 0] >= samples[:, 1] - level[:, 0]
    peaks = rising & (samples >= right - level) & (reach >= need)
    bare = np.flatnonzero(~peaks.any(axis=1))
    peaks[bare, np.argmax(samples[bare], axis=1)] = True
    rows, columns = np.nonzero(peaks)
    return rows, columns
