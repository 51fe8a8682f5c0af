"""Cuts next to the kink of a sampled function, whose position is known."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.numerics.kinks import cuts

X = np.concatenate([np.linspace(0.0, 1.0, 9), np.linspace(1.0, 2.0, 9)])


@pytest.mark.parametrize("kink", [1.2, 1.31, 1.5001, 1.8])
@pytest.mark.parametrize("excess", [20.0, 1e4])
def test_a_kink_lies_between_two_cuts_that_are_the_closer_the_greater_the_error(kink, excess):
    middle, left, right = cuts(X, np.abs(X - kink) + 0.3 * X, np.array([0.5, excess]), 16.0, 9)
    assert middle == 1.5
    assert left < kink < right
    assert right - left <= 0.125 * (0.2 if excess > 1e3 else 1.0) * (1.0 + 1e-12)


def test_a_jump_lies_between_the_nodes_beside_it():
    left, right = cuts(X, np.where(X > 0.4, 1.0, 0.0), np.array([20.0, 0.0]), 16.0, 9)[1:]
    assert left <= 0.4 <= right
    assert right - left <= 0.125


def test_a_smooth_panel_is_halved_and_one_within_its_tolerance_is_not_cut():
    assert cuts(X, X * X, np.array([0.9, 2.0]), 16.0, 9).tolist() == [1.5]
