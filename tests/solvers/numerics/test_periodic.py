"""Means and extrema of periodic functions against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from solvers.numerics import periodic


@pytest.mark.parametrize("delta", [0.0, 0.25, 0.9, 0.999])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-8, 1e-12])
def test_mean_of_schmidts_cycle(delta, tolerance):
    found = periodic.mean(lambda a: 1 / (1 - delta * np.cos(a - 1.16)), tolerance)
    error = abs(found.value - 1 / math.sqrt(1 - delta * delta))
    assert error <= max(found.error, 1e-14 * found.value)
    assert found.error <= 2 * tolerance * found.value


@pytest.mark.parametrize("delta", [0.25, 0.9, 0.99])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-8, 1e-12])
def test_maximum_of_schmidts_cycle(delta, tolerance):
    function = lambda a: 1 / (1 - delta * np.cos(a - 1.16))  # noqa: E731
    angles = periodic.resolve(lambda a: function(a)[None], 1e-2)
    found = periodic.maximum(function, tolerance, angles, function(angles))
    assert abs(found.value - 1 / (1 - delta)) <= tolerance * found.value + 1e-14 * found.value


def test_the_higher_of_two_nearly_equal_humps_is_found():
    rng = np.random.default_rng(3)
    for _ in range(200):
        shift = rng.uniform(0, 6.28)
        function = lambda a, s=shift: np.cos(2 * (a - s)) + 1e-4 * np.cos(a - s)  # noqa: E731
        angles = periodic.resolve(lambda a, f=function: f(a)[None], 1e-2)
        found = periodic.maximum(function, 1e-10, angles, function(angles))
        assert found.value == pytest.approx(1 + 1e-4, rel=1e-9)


def test_a_kink_does_not_deceive_the_maximum():
    function = lambda a: -np.abs(np.sin(0.5 * (a - 2.0)))  # noqa: E731
    angles = periodic.resolve(lambda a: function(a)[None], 1e-2)
    assert periodic.maximum(function, 1e-6, angles, function(angles)).value == pytest.approx(0.0, abs=2e-6)


@pytest.mark.parametrize("delta", [0.25, 0.999, 1 - 1e-9])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-8, 1e-12])
def test_mean_by_pieces_of_a_narrow_peak(delta, tolerance):
    """The peak is as narrow as sqrt(1 - delta); its surroundings are named as ends."""
    ends = 1.16 + np.concatenate([[0.0], *(np.array([-1.0, 1.0]) * 10.0**-k for k in range(6))])
    function = lambda a: 1 / ((1 - delta) + 2 * delta * np.sin(0.5 * (a - 1.16)) ** 2)  # noqa: E731
    found = periodic.mean_by_pieces(function, tolerance, ends)
    exact = 1 / math.sqrt((1 - delta) * (1 + delta))
    # The angles themselves are rounded, which a narrow peak feels.
    rounding = 1e-15 / math.sqrt(1 - delta)
    assert abs(found.value - exact) <= (found.error + rounding * exact)
    assert found.error <= 2 * tolerance * exact


@pytest.mark.parametrize("tolerance", [1e-4, 1e-8, 1e-12])
def test_mean_by_pieces_finds_a_corner_by_halving(tolerance):
    found = periodic.mean_by_pieces(lambda a: np.maximum(np.sin(a - 0.3), 0.0), tolerance, np.empty(0))
    assert abs(found.value - 1 / math.pi) <= max(found.error, 4e-16)
    assert found.error <= 2 * tolerance / math.pi


@pytest.mark.parametrize("width", [1e-2, 1e-5, 1e-8])
def test_samples_grow_dense_where_a_named_jump_is(width):
    """A jump between two named angles: every interval's chord then foretells the function."""
    function = lambda a: (np.sin(a) + np.tanh((a - 2.0) / width))[None]  # noqa: E731
    angles = periodic.resolve_from(function, 1e-2, np.array([2.0 - width, 2.0 + width]))
    assert angles.size < 2000
    near = np.linspace(2.0 - 3 * width, 2.0 + 3 * width, 101)
    interpolated = np.interp(near, angles, function(angles)[0])
    assert np.abs(interpolated - function(near)[0]).max() <= 0.05


def test_no_kink_deceives_the_mean():
    rng = np.random.default_rng(0)
    for _ in range(400):
        kink, cosine, sine = rng.uniform(0.0, 6.28), rng.uniform(-1.0, 1.0), rng.uniform(-0.3, 0.3)

        def kinked(x, k=kink, a=cosine, b=sine):
            return np.abs(np.sin(0.5 * (x - k))) + 1.0 + a * np.cos(x) + b * np.sin(3.0 * x)

        found = periodic.mean_by_pieces(kinked, 10 ** rng.uniform(-7.0, -2.0), np.array([0.0]))
        assert abs(found.value - (1.0 + 2.0 / np.pi)) <= found.error + 1e-14
