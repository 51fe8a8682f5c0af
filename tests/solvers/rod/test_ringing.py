"""What corners leave ringing, against one oscillator that is struck twice a turn, integrated."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from solvers.numerics.periodic_radau import STAGES, phase_error, steady_motion
from solvers.rod.vibration.ringing import PLACES, ringing

TURN, CORNER = 2 * np.pi, 2.0


def still(x, middle):
    """sin(x) and an arch from the corner to the turn's end: the slope rises by 1 at either end of the arch."""
    arch = (x - CORNER) * (TURN - x) / (TURN - CORNER)
    return np.sin(x) + np.where(middle > CORNER, arch, 0.0)


def struck(pace):
    """Greatest d beside the slow motion: d'' + pace^2 d = 0, d' falls by 1 at the corner and at the turn's end."""

    def free(x, y):
        return [y[1], -(pace(x) ** 2) * y[0]]

    def run(start, left, right):
        return solve_ivp(free, (left, right), start, method="DOP853", rtol=1e-9, atol=1e-14, max_step=0.02)

    def turn(start):
        middle = run(start, 0.0, CORNER)
        after = run(middle.y[:, -1] - [0.0, 1.0], CORNER, TURN)
        return after.y[:, -1] - [0.0, 1.0], max(np.abs(middle.y[0]).max(), np.abs(after.y[0]).max())

    origin = turn(np.zeros(2))[0]
    monodromy = np.stack([turn(start)[0] - origin for start in np.eye(2)], axis=1)
    return turn(np.linalg.solve(np.eye(2) - monodromy, origin))[1]


@pytest.mark.parametrize("pieces", [1, 40])
@pytest.mark.parametrize(("frequency", "swing"), [(90.3, 0.0), (60.3, 0.3), (80.4, 0.5)])
def test_two_corners_ring_no_more_than_estimated(frequency, swing, pieces):
    """In elements of many radians each, and with a run of narrow ones before the corner."""

    def pace(x):
        return frequency * (1.0 + swing * np.cos(x))

    edges = np.unique(np.concatenate([np.linspace(0.0, TURN, 9), np.linspace(CORNER - 0.2, CORNER, pieces + 1)]))
    widths = np.diff(edges)
    places = edges[:-1, None] + widths[:, None] * PLACES
    middles = 0.5 * (edges[:-1] + edges[1:])[:, None]
    added, closing = ringing(widths, still(places, middles)[..., None], pace(places)[..., None])
    assert added[0] == pytest.approx(1.0 / pace(CORNER) + 1.0 / pace(0.0), rel=0.05)
    assert 0.2 * added[0] * closing[0] < struck(pace) < 1.5 * added[0] * closing[0]


def test_without_corners_nothing_rings():
    edges = np.linspace(0.0, TURN, 17)
    places = edges[:-1, None] + np.diff(edges)[:, None] * PLACES
    load = np.exp(np.cos(places - 1.0))
    added, _ = ringing(np.diff(edges), load[..., None], np.full((*places.shape, 1), 200.0))
    assert added[0] < 1e-12


@pytest.mark.parametrize("step", [1.2, 2.5, 6.0])
def test_phase_error_is_what_one_element_makes(step):
    """A free oscillation started at 1 over as many elements as fit its period k times, closed by a force that pulls."""
    count, frequency = 40, 40 * step / TURN
    widths = np.full(count, TURN / count)
    right = np.cos(0.5 * (np.arange(count)[:, None] * widths[0] + np.zeros(STAGES)))[..., None]
    _, amplification = steady_motion(
        widths, np.array([frequency**-2]), np.ones((count, STAGES, 1, 1)), np.ones((count, STAGES, 1)) * right
    )
    exact = 0.5 / abs(np.sin(np.pi * frequency))
    assert amplification == pytest.approx(exact, rel=4.0 * count * float(phase_error(np.array(step))) * exact + 1e-9)
