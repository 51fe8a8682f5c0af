"""Climbing brackets: smooth peaks, corners, ends, flat rows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from solvers.numerics.brackets import MAX_ITERATIONS, shrink_bracket, trial_points


class Found(NamedTuple):
    """The highest value of every function, and its error bound."""

    value: np.ndarray
    error: np.ndarray


def climb(functions, places, tolerance):
    found = [climbed(function, bracket, tolerance) for function, bracket in zip(functions, places, strict=True)]
    return Found(*np.array(found).T)


def climbed(function, bracket, tolerance):
    place, points = np.array(bracket, dtype=float), np.empty(5)
    value = np.array(function(place), dtype=float)
    rounding = 4.0 * np.finfo(float).eps * np.abs(value).max()
    for _ in range(MAX_ITERATIONS):
        trial_points(place, value, points)
        error = shrink_bracket(place, value, points, np.array(function(points), dtype=float))
        if error <= max(tolerance, rounding) or place[2] - place[0] <= 8.0 * np.finfo(float).eps:
            break
    return value[1], max(error, rounding)


PEAKS = [
    (lambda x: np.cos(x - 0.3), (0.0, 0.2, 1.0), 1.0),
    (lambda x: 1.0 - np.abs(x - 0.7), (0.0, 0.5, 1.0), 1.0),
    (lambda x: np.exp(-((x - 0.4) ** 2) * 1e4), (0.3, 0.41, 0.5), 1.0),
    (lambda x: np.where(x < 0.6, x, 0.6 - 5 * (x - 0.6)), (0.0, 0.5, 1.0), 0.6),
    (lambda x: 2.0 - x, (0.0, 0.0, 1.0), 2.0),
    (lambda x: 1.0 + x, (0.0, 1.0, 1.0), 2.0),
    (lambda x: 1.0 + x * (0.01 - x), (0.0, 0.0, 1.0), 1.000025),
    (lambda x: np.full_like(x, 3.0), (0.0, 0.5, 1.0), 3.0),
]


@pytest.mark.parametrize("tolerance", [1e-2, 1e-6, 1e-12])
def test_every_row_reaches_its_maximum_within_its_error_bound(tolerance):
    found = climb([p[0] for p in PEAKS], [p[1] for p in PEAKS], tolerance)
    exact = np.array([p[2] for p in PEAKS])
    assert np.all(exact - found.value <= np.maximum(found.error, 1e-15))
    assert np.all(found.value <= exact + 4e-16 * exact)
    assert np.all(found.error <= max(tolerance, 1e-14))


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
def test_the_error_bound_of_a_smooth_peak_is_valid_and_sharp(tolerance):
    rng = np.random.default_rng(5)
    places, ratios = [], []
    tilts, bends = rng.uniform(-2.0, 2.0, 60), rng.uniform(-3.0, 3.0, 60)
    # cos(x) + tilt sin(x) has its peak hypot(1, tilt) at atan(tilt); a cubic that vanishes there skews it.
    functions = [
        lambda x, t=t, b=b: np.hypot(1.0, t) * np.cos(x - np.arctan(t)) * np.exp(0.1 * b * (x - np.arctan(t)) ** 3)
        for t, b in zip(tilts, bends, strict=True)
    ]
    peaks = np.hypot(1.0, tilts)
    for peak in np.arctan(tilts):
        places.append((peak - rng.uniform(0.05, 0.4), peak + rng.uniform(-0.04, 0.04), peak + rng.uniform(0.05, 0.4)))
    found = climb(functions, places, tolerance)
    missing = peaks - found.value
    assert np.all(missing <= np.maximum(found.error, 4e-16 * peaks))
    ratios = found.error / np.maximum(missing, 1e-15)
    assert np.median(ratios) < 100.0


def test_a_kink_has_the_chord_bound():
    rng = np.random.default_rng(6)
    for _ in range(200):
        kink, left, right = rng.uniform(0.2, 0.8), 10 ** rng.uniform(-1, 1), 10 ** rng.uniform(-1, 1)
        found = climb(
            [lambda x, k=kink, a=left, b=right: 1.0 + np.where(x < k, a * (x - k), b * (k - x))],
            [(0.0, 0.5, 1.0)],
            1e-5,
        )
        assert 1.0 - found.value[0] <= max(found.error[0], 1e-15)


def test_a_skewed_peak_whose_slope_cancels_hides_nothing():
    """Among many asymmetric brackets, some have the parabola's vertex on a point beside the peak."""
    rng = np.random.default_rng(11)
    skews, widths = rng.uniform(-0.6, 0.6, 4000), rng.uniform(0.05, 0.5, (4000, 2))
    starts = rng.uniform(-0.04, 0.04, 4000)
    places = np.stack([-widths[:, 0], starts, widths[:, 1]], axis=1)

    functions = [lambda x, skew=skew: 1.0 - x**2 + skew * x**3 for skew in skews]
    found = climb(functions, places, 1e-5)
    assert np.all(1.0 - found.value <= found.error + 1e-15)
