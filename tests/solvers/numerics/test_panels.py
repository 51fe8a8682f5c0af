"""Panels: interpolants, extremes, zeros and their errors, held against dense samples and closed forms."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from solvers.numerics import panels

TURN = 2.0 * np.pi
FUNCTIONS = {
    "waves": lambda x: np.sin(x) * np.exp(np.cos(3.0 * x)),
    "peak": lambda x: 1.0 / (1.02 - np.cos(x - 1.0)),
    "steep": lambda x: np.tanh(8.0 * np.sin(x)),
    "level": lambda x: 2.0 + 0.0 * x,
}


def resolved(function, tolerance, points=16, edges=None):
    edges = np.linspace(0.0, TURN, 5) if edges is None else edges
    return panels.resolve(lambda x: function(x)[None], edges, panels.rule_of(points), 1, tolerance, 20_000)


@pytest.mark.parametrize("points", [6, 8, 16])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-7, 1e-11])
@pytest.mark.parametrize("name", FUNCTIONS)
def test_interpolants_meet_the_tolerance_and_their_estimate(name, tolerance, points):
    function = FUNCTIONS[name]
    found, values, missed = resolved(function, tolerance, points)
    x = np.linspace(0.0, TURN, 20_001)
    error = np.abs(panels.values_at(found.edges, found.rule, values, x)[0] - function(x)).max()
    assert missed <= tolerance
    assert error <= 1.5 * max(missed, 1e-13) * np.abs(function(x)).max()


@cache
def top(name, sign):
    return (sign * FUNCTIONS[name](np.linspace(0.0, TURN, 2_000_001))).max()


@pytest.mark.parametrize("tolerance", [1e-2, 1e-5, 1e-10])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("name", ["waves", "peak", "steep"])
def test_extremes_are_within_their_error_bound(name, sign, tolerance):
    function = FUNCTIONS[name]
    found, values, _ = resolved(function, tolerance)
    scale = np.abs(values).max()
    value, error, angle = panels.greatest(found.edges, found.rule, values[0], sign, tolerance * scale)
    exact = top(name, sign)
    assert abs(value - exact) <= error + 1e-11 * scale
    assert error <= 1.5 * tolerance * scale
    assert sign * function(np.array([angle]))[0] == pytest.approx(exact, abs=2.0 * tolerance * scale)


def test_a_corner_at_a_panel_edge_needs_no_refinement():
    """Twice the points of a smooth function where panels end at the corner, bisection to the very corner where not."""

    def corner(x):
        return np.abs(np.sin(x - 0.7)) + 0.1 * np.cos(x)

    known = np.unique(np.concatenate([np.linspace(0.0, TURN, 5), [0.7, 0.7 + np.pi]]))
    told, *_ = resolved(corner, 1e-10, edges=known)
    found, *_ = resolved(corner, 1e-10)
    assert told.edges.size <= 2 * known.size
    assert found.edges.size > 4 * told.edges.size


def test_zeros_are_all_simple_sign_changes():
    found, values, _ = resolved(lambda x: np.cos(3.0 * x + 0.1), 1e-13)
    expected = (np.pi * (np.arange(6) + 0.5) - 0.1) / 3.0
    assert panels.zeros(found.edges, found.rule, values[0]) == pytest.approx(expected, abs=1e-12)


def test_the_number_of_panels_is_limited():
    found, values, missed = panels.resolve(
        lambda x: np.sign(np.sin(x - 0.3))[None], np.linspace(0.0, TURN, 5), panels.rule_of(16), 1, 1e-8, 12
    )
    assert found.edges.size - 1 <= 12
    assert missed > 1e-3
    assert values.shape == (1, 16 * (found.edges.size - 1))


def test_splitting_keeps_every_edge():
    edges = panels.split(np.array([0.0, 0.01, 1.0]), 0.1)
    assert {0.0, 0.01, 1.0} <= set(edges)
    assert np.max(np.diff(edges)) <= 0.1 * (1 + 1e-8)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_mean_within_its_estimate(name):
    found, values, _ = resolved(FUNCTIONS[name], 1e-9)
    mean, error = panels.mean_of(found.edges, found.rule, values[0])
    exact = FUNCTIONS[name](TURN * np.arange(20_000) / 20_000).mean()
    assert abs(mean - exact) <= max(error, 1e-14 * np.abs(values).max())
    assert error <= 1e-8 * np.abs(values).max()


@pytest.mark.parametrize("points", [8, 16, 20])
def test_the_last_coefficients_tell_of_oscillations_that_have_enough_points(points):
    """Up to 1.5 rad a point they do; beyond 2 rad they may be small by accident."""
    rule, rng, x = panels.rule_of(points), np.random.default_rng(points), np.linspace(-1.0, 1.0, 401)

    def told(least, most):
        worst = 0.0
        for _ in range(600):
            pace, phase = 0.5 * points * rng.uniform(least, most), rng.uniform(0.0, TURN)
            values = np.cos(pace * rule.points + phase)
            there = panels.values_at(np.array([-1.0, 1.0]), rule, values[None], x)[0]
            worst = max(worst, np.abs(there - np.cos(pace * x + phase)).max() / panels.panel_error(values, rule))
        return worst

    assert told(0.75, 1.5) < 1.0
    assert told(2.2, 3.5) > 2.0
