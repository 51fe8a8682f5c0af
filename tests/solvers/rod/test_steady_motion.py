"""Periodic motions in closed form: a struck oscillator, a modulated pair of modes, a resonance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from solvers.numerics.periodic_radau import STAGES, nodes, steady_motion

TURN = 2 * np.pi


def points(edges):
    return edges[:-1, None] + np.diff(edges)[:, None] * np.concatenate([[0.0], nodes()])


@pytest.mark.parametrize("frequency", [0.3, 3.4, 12.7])
def test_a_load_that_jumps_makes_a_mode_ring(frequency):
    """a'' + w^2 a = w^2 sign: half a turn one way, half a turn the other; a = 1 - cos(w (x - pi/2))/cos(w pi/2)."""
    edges = np.linspace(0.0, TURN, 2 * 24 + 1)
    at = points(edges)
    side = np.where(edges[:-1] < 3.1, 1.0, -1.0)[:, None, None] * np.ones((1, STAGES, 1))
    found, _ = steady_motion(np.diff(edges), np.array([frequency**-2]), np.ones((48, STAGES, 1, 1)), side)
    half = np.where(at[:, -1:] > np.pi + 1e-9, at - np.pi, at)
    exact = side[:, :1, 0] * (1 - np.cos(frequency * (half - np.pi / 2)) / np.cos(frequency * np.pi / 2))
    assert found[..., 0] == pytest.approx(exact, abs=1e-6 * np.abs(exact).max())


def test_coupled_modes_against_an_initial_value_problem():
    slowness, coupling = np.array([0.05, 0.004]), np.array([[0.3, 0.1], [0.1, 0.2]])

    def stiffness(x):
        return np.eye(2) + np.cos(x)[..., None, None] * coupling

    def right(x):
        return np.stack([np.sin(x), np.sin(2 * x) + 0.5], axis=-1)

    edges = np.linspace(0.0, TURN, 33)
    at = points(edges)
    found, amplification = steady_motion(np.diff(edges), slowness, stiffness(at[:, 1:]), right(at[:, 1:]))

    def motion(x, state):
        return np.concatenate([state[2:], (right(x) - stiffness(x) @ state[:2]) / slowness])

    turn = [solve_ivp(motion, (0, TURN), s, rtol=1e-12, atol=1e-13).y[:, -1] for s in (np.zeros(4), *np.eye(4))]
    start = np.linalg.solve(np.eye(4) - np.array(turn[1:]).T + turn[0][:, None], turn[0])
    path = solve_ivp(motion, (0, TURN), start, rtol=1e-12, atol=1e-13, t_eval=edges[:-1]).y[:2].T
    assert found[:, 0] == pytest.approx(path, abs=1e-8 * np.abs(path).max())
    assert 0.5 <= amplification < 100


def test_amplification_tells_a_resonance():
    edges = np.linspace(0.0, TURN, 65)
    ones, load = np.ones((64, STAGES, 1, 1)), np.ones((64, STAGES, 1))
    near, far = (steady_motion(np.diff(edges), np.array([w**-2]), ones, load)[1] for w in (5.0 + 1e-6, 5.5))
    assert far < 1.0
    # The least singular value of a turn by 2 pi (1 + 1e-6/5) of the unit state is 2 sin(pi 1e-6).
    assert near == pytest.approx(1 / (TURN * 1e-6), rel=1e-2)
