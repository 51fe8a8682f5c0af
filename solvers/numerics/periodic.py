"""Sampling, sign changes and means of periodic functions to a wanted accuracy, without a dense grid.

Samples are added until those that are there predict the values between them, so that no maximum between two samples
goes unnoticed. Means are taken piece by piece between the corners by Clenshaw-Curtis' rule, whose difference to the
rule on every second point estimates its error.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel

Array = NDArray[np.float64]

TURN = 2.0 * np.pi
FIRST_SAMPLES = 64
MOST_SAMPLES = 1 << 15
_ROUNDING = float(4.0 * np.finfo(float).eps)
_WHOLE_TURN = np.array([0.0, TURN])
_PIECE = 16
_SPLIT = 0.4
_MOST_PIECE_SAMPLES = 1 << 18
MOST_ROUNDS = 24
CROSSING = 1e-10
_MERGED = 1e-9
"""Two corners closer than this [rad] are one: what lies between them adds the square of it."""

Periodic = Callable[[NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True)
class Estimate:
    """A value with the estimate of its absolute error, and what it cost in samples."""

    value: float
    error: float
    samples: int


def grid(samples: int, offset: float = 0.0) -> NDArray[np.float64]:
    """Equally spaced angles of one turn, shape (samples,), shifted by ``offset`` of a step."""
    return (np.arange(samples) + offset) * (TURN / samples)


@lru_cache(maxsize=1)
def _clenshaw_curtis() -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Points on [0, 1], their weights, and the sums that must vanish where the function is resolved, shape (4, points).

    They are the difference to the rule on every second point and thrice the last three Chebyshev coefficients: where a
    kink happens to leave one of them small, it does not leave all.
    """

    def weights(intervals: int) -> NDArray[np.float64]:
        order = np.arange(0, intervals + 1, 2)
        moments = np.zeros(intervals + 1)
        moments[::2] = 1.0 / (1.0 - order.astype(float) ** 2)
        angle = np.pi * np.arange(intervals + 1) / intervals
        return np.linalg.solve(np.cos(np.outer(np.arange(intervals + 1), angle)), moments)

    half = np.zeros(_PIECE + 1)
    half[::2] = weights(_PIECE // 2)
    turned = np.pi * np.arange(_PIECE + 1) / _PIECE
    last = 6.0 / _PIECE * np.cos(np.outer(np.arange(_PIECE - 2, _PIECE + 1), turned))
    last[:, [0, -1]] *= 0.5
    last[-1] *= 0.5
    return 0.5 * (1.0 - np.cos(turned)), weights(_PIECE), np.vstack([weights(_PIECE) - half, last])


def mean_by_pieces(function: Periodic, tolerance: float, ends: NDArray[np.float64]) -> Estimate:
    """Mean over one turn of a function with corners or sharp peaks, to ``tolerance`` times the mean magnitude.

    ``ends`` [rad] are places where it may have a corner; more are found by halving. On every piece Clenshaw-Curtis'
    rule is compared with the one on every second point, and the last Chebyshev coefficients are looked at; pieces that
    are not resolved are halved. The error is the sum of the greatest of these, no less than that of the coarser rule.
    """
    points, whole, checks = _clenshaw_curtis()
    edges = _graded(np.mod(ends, TURN))
    left, width = edges[:-1], np.diff(edges)
    total = magnitude = error = 0.0
    samples = 0
    while True:
        values = function((left[:, None] + width[:, None] * points).ravel()).reshape(left.size, points.size)
        samples += values.size
        good = np.empty(left.size, dtype=np.bool_)
        done = samples >= _MOST_PIECE_SAMPLES
        more = _judge(values, width, whole, checks, -1.0 if done else tolerance, magnitude, good)
        total, error, magnitude = total + more[0], error + more[1], magnitude + more[2]
        if good.all():
            break
        left, width = left[~good], 0.5 * width[~good]
        left, width = np.concatenate([left, left + width]), np.concatenate([width, width])
    return Estimate(total / TURN, (error + _ROUNDING * magnitude) / TURN, samples)


@kernel
def _judge(
    values: Array,
    width: Array,
    whole: Array,
    checks: Array,
    tolerance: float,
    magnitude: float,
    good: NDArray[np.bool_],
) -> tuple[float, float, float]:
    """Mark pieces whose checks vanish (all, at a negative tolerance); their sums of integral, doubt and magnitude."""
    pieces, points = values.shape
    value, doubt, size = np.zeros(pieces), np.zeros(pieces), np.zeros(pieces)
    whole_size = magnitude
    for i in range(pieces):
        for k in range(points):
            value[i] += values[i, k] * whole[k]
            size[i] += abs(values[i, k]) * whole[k]
        for n in range(checks.shape[0]):
            left = 0.0
            for k in range(points):
                left += values[i, k] * checks[n, k]
            doubt[i] = max(doubt[i], abs(left))
        value[i], doubt[i], size[i] = width[i] * value[i], width[i] * doubt[i], width[i] * size[i]
        whole_size += size[i]
    total, error, sizes = 0.0, 0.0, 0.0
    for i in range(pieces):
        enough = max(tolerance * width[i] / TURN, _ROUNDING * 1e-3) * whole_size
        good[i] = tolerance < 0.0 or doubt[i] <= enough
        if good[i]:
            total, error, sizes = total + value[i], error + doubt[i], sizes + size[i]
    return total, error, sizes


def _graded(ends: Array) -> Array:
    """The ends of pieces of one turn, none more than eight times as wide as the next one.

    Two corners close together make a function change within their distance beside them too, where a wide piece's rule,
    and the rule it is compared with, would both step over it.
    """
    edges = np.concatenate([ends[(ends > _MERGED) & (ends < TURN - _MERGED)], _WHOLE_TURN])
    edges.sort()
    return _grade(edges)


@kernel
def _grade(edges: Array) -> Array:
    """Sorted edges without those that follow another closely, and with new ones until neighbours are alike."""
    kept = [edges[0]]
    for edge in edges[1:]:
        if edge - kept[-1] > _MERGED:
            kept.append(edge)
    while True:
        count, pieces = len(kept), len(kept) - 1
        finer = [kept[0]]
        for i in range(pieces):
            left, right = kept[i], kept[i + 1]
            before = kept[i] - kept[i - 1] if i > 0 else kept[pieces] - kept[pieces - 1]
            after = kept[i + 2] - kept[i + 1] if i + 2 < count else kept[1] - kept[0]
            # Where both neighbours are narrow, the edge beside either one; they do not meet in a piece so wide.
            first = left + 4.0 * before if right - left > 8.0 * before else right
            second = right - 4.0 * after if right - left > 8.0 * after else left
            for edge in (min(first, second), max(first, second)):
                if left < edge < right and edge - finer[-1] > 0.0:
                    finer.append(edge)
            finer.append(right)
        if len(finer) == count:
            return np.array(kept)
        kept = finer


def crossings(function: Periodic, angles: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles at which the rows of a function of shape (rows, angles) change sign between two neighbouring samples.

    By the Illinois rule on all of them at once, to ``CROSSING`` rad. Two changes within one interval go unnoticed.
    """
    following = np.roll(values, -1, axis=1)
    row, at = np.nonzero(np.sign(values) * np.sign(following) < 0)
    left, right = angles[at], np.append(angles[1:], angles[0] + TURN)[at]
    low, high = values[row, at], following[row, at]
    place, entry = left, np.arange(row.size)
    for _ in range(MOST_ROUNDS):
        trial = right - high * (right - left) / (high - low)
        moved, place = np.abs(trial - place), trial
        if not place.size or np.all(moved <= CROSSING):
            break
        value = function(place)[row, entry]
        crossed = np.sign(value) * np.sign(high) < 0
        left, low = np.where(crossed, right, left), np.where(crossed, high, 0.5 * low)
        right, high = place, np.where(value == 0.0, np.copysign(np.finfo(float).tiny, -low), value)
    return np.mod(place, TURN)


def resolve_from(function: Periodic, wanted: float, angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sorted angles in [0, 2 pi) that resolve a function of shape (quantities, angles), denser where it is sharp.

    From ``angles`` and an even grid on, intervals are split until the chord foretells the value at every split to
    ``wanted`` times the quantity's largest magnitude. Splits stand off the middle, where an odd jump lies on its chord.
    """
    angles = np.unique(np.concatenate([np.mod(angles, TURN), grid(FIRST_SAMPLES)]))
    angles = angles[np.diff(angles, append=angles[0] + TURN) > 8.0 * np.finfo(float).eps]
    values = function(angles)
    scale = np.max(np.abs(values), axis=-1, keepdims=True)
    after, following = np.append(angles[1:], angles[0] + TURN), np.roll(values, -1, axis=-1)
    found = [angles]
    left, right, low, high = angles, after, values, following
    count = angles.size
    while left.size and count < MOST_SAMPLES:
        middle = left + _SPLIT * (right - left)
        between = function(middle)
        count += middle.size
        found.append(middle)
        rough = np.any(np.abs(between - (low + _SPLIT * (high - low))) > wanted * scale, axis=0)
        rough &= right - left > 1e-12
        left, right, low, high, middle, between = (x[..., rough] for x in (left, right, low, high, middle, between))
        left, right = np.concatenate([left, middle]), np.concatenate([middle, right])
        low, high = np.concatenate([low, between], axis=-1), np.concatenate([between, high], axis=-1)
    return np.unique(np.mod(np.concatenate(found), TURN))


def resolve(function: Periodic, wanted: float) -> NDArray[np.float64]:
    """Equally spaced angles that resolve a function of shape (quantities, angles).

    The samples are doubled until every midpoint is foretold by the cubic through its four neighbours to ``wanted``
    times the quantity's largest magnitude, so that no hump between two samples goes unnoticed.
    """
    samples = FIRST_SAMPLES
    values = function(grid(samples))
    while samples < MOST_SAMPLES:
        between = function(grid(samples, 0.5))
        samples *= 2
        if _foretold(values, between, wanted):
            break
        values = np.stack([values, between], axis=-1).reshape(*values.shape[:-1], samples)
    return grid(samples)


@kernel
def _foretold(values: Array, between: Array, wanted: float) -> bool:
    """Whether the cubics through a closed row's samples give the values between them."""
    rows, n = values.shape
    for row in range(rows):
        scale = 0.0
        for i in range(n):
            scale = max(scale, abs(values[row, i]))
        for i in range(n):
            left, right = values[row, i], values[row, (i + 1) % n]
            beyond = values[row, i - 1 if i > 0 else n - 1] + values[row, (i + 2) % n]
            if not abs(between[row, i] - (9.0 * (left + right) - beyond) / 16.0) <= wanted * scale:
                return False
    return True


# Written out: a fresh machine compiles loops several times faster than numpy's reductions.
@kernel
def sampled_range(samples: Array) -> tuple[float, float]:
    """The least and the greatest sample."""
    least, most = samples[0], samples[0]
    for n in range(1, samples.size):
        least, most = min(least, samples[n]), max(most, samples[n])
    return least, most


@kernel
def foretold_range(angles: Array, values: Array) -> tuple[float, float]:
    """The least and the greatest value that parabolas through three neighbouring samples of one turn foretell."""
    count = angles.size
    least, most = np.inf, -np.inf
    for i in range(count):
        before, after = i - 1 if i > 0 else count - 1, i + 1 if i < count - 1 else 0
        back = angles[i] - angles[before] + (TURN if i == 0 else 0.0)
        on = angles[after] - angles[i] + (TURN if after == 0 else 0.0)
        falls, rises = (values[i] - values[before]) / back, (values[after] - values[i]) / on
        turns = 0.0
        if falls * rises <= 0.0 and falls != rises:
            # The vertex lies between the neighbours where the chords' slopes change their sign.
            slope = (falls * on + rises * back) / (back + on)
            turns = -0.25 * slope * slope * (back + on) / (rises - falls)
        least, most = min(least, values[i] + min(turns, 0.0)), max(most, values[i] + max(turns, 0.0))
    return least, most
