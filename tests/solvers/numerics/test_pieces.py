"""Means and maxima of functions that jump between pieces."""

from __future__ import annotations

import math

import numpy as np
import pytest

from solvers.numerics import pieces


def saw(angle):
    """Jumps from 1 to -1 at 2 and rises to either side; a smooth quantity beside it."""
    return np.stack([np.where(angle < 2.0, angle - 1.0, angle - 3.0), np.cos(angle - 0.3)])


BREAKS = np.array([0.0, 2.0, 2 * math.pi])


def test_means_of_jumping_functions_are_exact():
    found = pieces.means(saw, BREAKS, 1e-12)
    period = 2 * math.pi
    exact = (0.0 + (period**2 / 2 - 3 * period - (2 - 6))) / period
    assert found.value == pytest.approx([exact, 0.0], abs=1e-14)
    assert np.all(found.error < 1e-13)


def test_maxima_see_both_sides_of_a_jump_and_the_smooth_hump():
    found = pieces.maxima(saw, np.array([0.0, 2.0, 3.5]), 1e-12)
    assert found.value == pytest.approx([1.0, 1.0], abs=1e-14)
    assert found.place == pytest.approx([2.0, 0.3], abs=1e-6)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-6, 1e-12])
def test_the_maximums_error_keeps_to_the_tolerance(tolerance):
    for shift in np.linspace(0, 1, 23):
        found = pieces.maxima(lambda a, s=shift: np.exp(np.cos(3 * (a - s)))[None], BREAKS, tolerance)
        assert abs(found.value[0] - math.e) <= tolerance * math.e
        assert abs(found.value[0] - math.e) <= found.error[0] + 1e-15


@pytest.mark.parametrize("places", np.random.default_rng(5).uniform(0, 2 * math.pi, (20, 40)))
def test_breaks_near_a_maximum_do_not_hide_it(places):
    """A hump between a break and the next sample, though the break's own value is as high as its neighbours'."""
    for shift in (0.3, float(places[0]) + 1e-3, float(places[1]) - 1e-3):
        breaks = np.concatenate([[0.0], np.sort(places), [2 * math.pi]])
        found = pieces.maxima(lambda a, s=shift: np.cos(a - s)[None], breaks, 1e-12)
        assert found.value[0] == pytest.approx(1.0, abs=1e-12)


def test_subdivision_keeps_every_break():
    bounds = pieces.subdivide(np.array([0.0, 0.01, 1.0]), 0.1)
    assert {0.0, 0.01, 1.0} <= set(bounds)
    assert np.max(np.diff(bounds)) <= 0.1 + 1e-12


CLOSE = np.concatenate([[0.0], 1.0 + 1e-3 * np.arange(-40, 41), [2.5, 2 * math.pi]])


@pytest.mark.parametrize("narrow", np.linspace(4.0, 4.2, 23))
def test_slopes_of_many_humps_do_not_crowd_out_a_narrow_peak(narrow):
    """Each of the close breaks has a hump, all of them above the samples to either side of the narrow peak."""

    def two(angle):
        high = (1.0 + 1e-5) * np.exp(-(((angle - narrow) / 0.3) ** 2))
        return np.where(angle < 2.5, 1.0 - 1e-3 * (angle - 1.0) ** 2, high)[None]

    found = pieces.maxima(two, CLOSE, 1e-10)
    assert found.value == pytest.approx([1.0 + 1e-5], rel=1e-10)
    assert found.place == pytest.approx([narrow], abs=1e-5)


def test_what_more_humps_than_are_climbed_may_reach_is_told():
    """Two hundred sharp peaks between samples, each of which might hide more than the one that is highest."""
    breaks = np.linspace(0.0, 201.0, 202)

    def many(angle):
        sharp, blunt = np.cos(math.pi * (angle % 1.0 - 0.58)), 1.001 - 0.5 * (angle % 1.0 - 0.58) ** 2
        return np.where(angle < 200.0, sharp, blunt)[None]

    found = pieces.maxima(many, breaks, 1e-6)
    assert found.value[0] <= 1.001 <= found.value[0] + found.error[0]
