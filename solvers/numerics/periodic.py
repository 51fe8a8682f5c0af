"""Mean and extrema of a periodic function to a wanted accuracy, without a dense grid.

Means: the trapezoidal rule converges geometrically for a smooth periodic function, so doubling the samples and
looking at the difference gives both the value and an estimate that errs on the safe side (L. N. Trefethen,
J. A. C. Weideman, The exponentially convergent trapezoidal rule, 2014).
Extrema: a coarse sampling that foretells its own midpoints misses no hump; every hump that could still hold the
maximum is climbed by parabolas.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

TURN = 2.0 * np.pi
FIRST_SAMPLES = 64
MOST_SAMPLES = 1 << 15
_ROUNDING = 4.0 * np.finfo(float).eps
_SHRINK = 0.125
_MOST_ROUNDS = 24

Periodic = Callable[[NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True)
class Estimate:
    """A value with the estimate of its absolute error, where it was found, and what it cost in samples."""

    value: float
    error: float
    angle: float
    samples: int


def grid(samples: int, offset: float = 0.0) -> NDArray[np.float64]:
    """Equally spaced angles of one turn, shape (samples,), shifted by ``offset`` of a step."""
    return (np.arange(samples) + offset) * (TURN / samples)


def mean(function: Periodic, tolerance: float) -> Estimate:
    """Mean over one turn to ``tolerance`` times the mean magnitude; the error is the last doubling's change."""
    samples = FIRST_SAMPLES
    values = function(grid(samples))
    total, magnitude = float(np.mean(values)), float(np.mean(np.abs(values)))
    while True:
        between = function(grid(samples, 0.5))
        refined = 0.5 * (total + float(np.mean(between)))
        magnitude = 0.5 * (magnitude + float(np.mean(np.abs(between))))
        change = abs(refined - total)
        samples *= 2
        total = refined
        if change <= tolerance * magnitude or samples >= MOST_SAMPLES:
            return Estimate(total, change + _ROUNDING * magnitude, float("nan"), samples)


def resolve(function: Periodic, wanted: float) -> NDArray[np.float64]:
    """Equally spaced angles that resolve a function of shape (quantities, angles).

    The samples are doubled until every midpoint is foretold by the cubic through its four neighbours to ``wanted``
    times the quantity's largest magnitude, so that no hump between two samples goes unnoticed.
    """
    samples = FIRST_SAMPLES
    values = function(grid(samples))
    while samples < MOST_SAMPLES:
        between = function(grid(samples, 0.5))
        near, far = values + np.roll(values, -1, axis=-1), np.roll(values, 1, axis=-1) + np.roll(values, -2, axis=-1)
        surprise = np.max(np.abs(between - (9.0 * near - far) / 16.0), axis=-1)
        scale = np.max(np.abs(values), axis=-1)
        samples *= 2
        if np.all(surprise <= wanted * scale):
            break
        values = np.stack([values, between], axis=-1).reshape(*values.shape[:-1], samples)
    return grid(samples)


def maximum(function: Periodic, tolerance: float, angles: NDArray[np.float64], values: NDArray[np.float64]) -> Estimate:
    """Greatest value over one turn, to ``tolerance`` times the function's largest magnitude.

    ``angles`` resolve the function (see ``resolve``), ``values`` are its samples there, so that quantities that
    come from the same computation share it. Every hump of the samples that its own curvature lets reach the highest
    sample is climbed by parabolas.
    """
    return _climb(function, angles, values, tolerance)


def _climb(function: Periodic, angles: NDArray[np.float64], values: NDArray[np.float64], tolerance: float) -> Estimate:
    """Climb every hump of the samples that its own curvature lets reach the highest sample."""
    step = TURN / angles.size
    left, right = np.roll(values, 1), np.roll(values, -1)
    humps = (values >= left) & (values >= right)
    # A parabola through a sample and its neighbours rises by at most an eighth of its second difference above the
    # sample; four times that much covers a hump whose curvature the samples see only roughly.
    reach = values + 0.5 * np.abs(left - 2.0 * values + right)
    at = np.flatnonzero(humps & (reach >= values.max()))
    centre, height, width = angles[at], values[at], step
    scale = max(float(np.max(np.abs(values))), np.finfo(float).tiny)
    change = np.inf
    for _ in range(_MOST_ROUNDS):
        before, after = _pair(function, centre, width)
        climbing = np.maximum(before, after) > height
        if climbing.any():
            # Not bracketed: walk uphill before the bracket may shrink.
            centre = np.where(climbing, np.where(after > before, centre + width, centre - width), centre)
            height = np.maximum(height, np.maximum(before, after))
            continue
        bend = before - 2.0 * height + after
        shift = np.where(bend < 0, 0.5 * width * (before - after) / np.where(bend < 0, bend, 1.0), 0.0)
        vertex = centre + np.clip(shift, -width, width)
        raised = function(vertex)
        change = float(np.max(np.maximum(raised - height, 0.0)))
        centre = np.where(raised >= height, vertex, centre)
        height = np.maximum(height, raised)
        # What is left to gain within the next bracket is bounded by the parabola's fall across it.
        left_over = float(np.max(np.abs(bend))) * _SHRINK**2
        width *= _SHRINK
        if max(left_over, change * _SHRINK) <= 0.25 * tolerance * scale or width < 1e-7:
            break
    best = int(np.argmax(height))
    error = min(change, 0.25 * tolerance * scale) + _ROUNDING * scale
    return Estimate(float(height[best]), error, float(np.mod(centre[best], TURN)), angles.size)


def _pair(
    function: Periodic, centre: NDArray[np.float64], width: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    both = function(np.concatenate([centre - width, centre + width]))
    return both[: centre.size], both[centre.size :]
