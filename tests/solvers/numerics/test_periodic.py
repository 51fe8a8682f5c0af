"""Sampling and means of periodic functions against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from solvers.numerics import periodic


@pytest.mark.parametrize("delta", [0.25, 0.9, 0.99])
@pytest.mark.parametrize("wanted", [1e-1, 1e-2, 1e-4])
def test_equal_samples_resolve_schmidts_cycle(delta, wanted):
    """The cubics through four neighbours give the function everywhere, its narrow peak too, as well as was wanted."""
    function = lambda a: 1 / (1 - delta * np.cos(a - 1.16))  # noqa: E731
    angles = periodic.resolve(lambda a: function(a)[None], wanted)
    nodes = np.concatenate([angles - periodic.TURN, angles, angles + periodic.TURN])
    looked_at = periodic.grid(7 * angles.size)
    interpolated = CubicSpline(nodes, function(nodes))(looked_at)
    assert np.abs(interpolated - function(looked_at)).max() <= wanted / (1 - delta)
    assert angles.size <= 64 * wanted**-0.25 / math.sqrt(1 - delta)


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
