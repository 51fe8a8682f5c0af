"""Periodic motions in closed form and by time integration: slow modes by collocation, fast ones that follow them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from solvers.numerics.radau import radau
from solvers.rod.vibration.slow_modes import Parts, carried, slow_motion
from solvers.rod.vibration.turn import closed

TURN = 2 * np.pi
RULE = radau(10)


def points(edges):
    return edges[:-1, None] + np.diff(edges)[:, None] * RULE.points


def parts(slowness, coupling, slow, loss=0.0):
    """For a coupling of which the part of the modes that follow is diagonal already."""
    fast, damping = np.arange(slow, slowness.size), loss * np.sqrt(slowness)
    return Parts(
        np.ascontiguousarray(slowness[:slow]),
        np.ascontiguousarray(damping[:slow]),
        np.ascontiguousarray(coupling[:slow, :slow]),
        np.ascontiguousarray(coupling[:slow, slow:]),
        coupling[fast, fast],
        np.diag(slowness[fast]),
        np.diag(damping[fast]),
        np.ones((2, slowness.size)),
    )


def periodic(edges, swing, right, of, terms=9, wanted=1e-7):
    """Amplitudes at the points, by how much closing the turn enlarges, what the series leaves and how it falls."""
    columns, last, _, change, fell = slow_motion(np.diff(edges), swing, right, of, RULE, wanted, terms)
    starts = np.arange(edges.size - 1) == 0
    maps = carried(last, starts)
    size = last.shape[2]
    unknowns, amplification = closed(np.eye(size + 1, size)[None], maps[-1:, 1])
    state = np.append(unknowns[0], 1.0)
    begin = np.array([np.append(state @ one[0], 1.0) for one in maps])
    return np.einsum("ec,epcn->epn", begin, columns), amplification, np.einsum("ec,epcq->epq", begin, change), fell


@pytest.mark.parametrize("frequency", [0.3, 3.4, 12.7])
def test_a_load_that_jumps_makes_a_mode_ring(frequency):
    """a'' + w^2 a = w^2 sign: half a turn one way, half a turn the other; a = 1 - cos(w (x - pi/2))/cos(w pi/2)."""
    edges = np.linspace(0.0, TURN, 2 * 24 + 1)
    at = points(edges)
    side = np.where(edges[:-1] < 3.1, 1.0, -1.0)[:, None, None] * np.ones((1, RULE.points.size, 1))
    found, *_ = periodic(edges, np.zeros_like(at), side, parts(np.array([frequency**-2]), np.zeros((1, 1)), 1))
    half = np.where(at[:, -1:] > np.pi + 1e-9, at - np.pi, at)
    exact = side[:, :1, 0] * (1 - np.cos(frequency * (half - np.pi / 2)) / np.cos(frequency * np.pi / 2))
    assert found[..., 0] == pytest.approx(exact, abs=1e-8 * np.abs(exact).max())


@pytest.mark.parametrize("loss", [1e-3, 0.01, 0.3])
def test_a_load_that_jumps_makes_a_damped_mode_ring(loss):
    """a'' + loss w a' + w^2 a = w^2 sign at an odd harmonic's resonance: a = 1 - Re(A e^(s x)) with a'(0) = -a'(pi)."""
    from mpmath import mp

    w, edges = 3.0, np.linspace(0.0, TURN, 2 * 24 + 1)
    at = points(edges)
    side = np.where(edges[:-1] < 3.1, 1.0, -1.0)[:, None, None] * np.ones((1, RULE.points.size, 1))
    of = parts(np.array([w**-2]), np.zeros((1, 1)), 1, loss)
    found, amplification, *_ = periodic(edges, np.zeros_like(at), side, of)
    with mp.workdps(40):
        s = mp.mpf(w) * mp.mpc(-mp.mpf(loss) / 2, mp.sqrt(1 - mp.mpf(loss) ** 2 / 4))
        # 1 - A - B turns into -1 after half a turn, and so does the slope: A (1 + e^(s pi)) and its conjugate.
        a = mp.conj(s) / (mp.conj(s) - s) * 2 / (1 + mp.exp(s * mp.pi))
        exact = [1 - 2 * mp.re(a * mp.exp(s * mp.mpf(float(x)))) for x in at[:24].ravel()]
    exact = np.array([float(x) for x in exact]).reshape(24, -1)
    assert found[:24, :, 0] == pytest.approx(exact, abs=1e-8 * np.abs(exact).max())
    assert amplification == pytest.approx(1.0 / (1.0 - np.exp(-np.pi * w * loss)), rel=0.5 * loss + 1e-6)


@pytest.mark.parametrize("loss", [1e-3, 0.02])
def test_at_resonance_the_amplitude_is_the_inverse_of_the_loss_factor(loss):
    edges = np.linspace(0.0, TURN, 49)
    load = np.cos(5.0 * points(edges))
    found, *_ = periodic(
        edges, np.zeros_like(load), load[..., None], parts(np.array([5.0**-2]), np.zeros((1, 1)), 1, loss)
    )
    assert found[..., 0] == pytest.approx(np.sin(5.0 * points(edges)) / loss, abs=1e-7 / loss)


@pytest.mark.parametrize("loss", [0.0, 0.05])
@pytest.mark.parametrize("slow", [2, 1])
def test_coupled_modes_against_an_initial_value_problem(slow, loss):
    """Both followed by collocation, or the fast one by the series, whose ringing nothing excites."""
    slowness, coupling = np.array([0.05, 0.0004]), np.array([[0.3, 0.1], [0.1, 0.2]])

    def right(x):
        return np.stack([np.sin(x), np.sin(2 * x) + 0.5], axis=-1)

    edges = np.linspace(0.0, TURN, 49)
    at = points(edges)
    found, amplification, change, fell = periodic(edges, np.cos(at), right(at), parts(slowness, coupling, slow, loss))

    def motion(x, state):
        stiffness = np.eye(2) + np.cos(x) * coupling
        resisted = loss * np.sqrt(slowness) * state[2:]
        return np.concatenate([state[2:], (right(x) - stiffness @ state[:2] - resisted) / slowness])

    def run(start, **options):
        return solve_ivp(motion, (0, TURN), start, method="DOP853", rtol=1e-11, atol=1e-13, **options).y

    turn = [run(s)[:, -1] for s in (np.zeros(4), *np.eye(4))]
    start = np.linalg.solve(np.eye(4) - np.array(turn[1:]).T + turn[0][:, None], turn[0])
    path = run(start, t_eval=edges[:-1:6])[:2].T
    assert found[::6, 0] == pytest.approx(path, abs=1e-7 * np.abs(path).max())
    assert 0.5 <= amplification < 100
    assert slow == 2 or (fell < 0.2 and np.abs(change).max() < 1e-6)


def test_the_series_of_a_mode_that_follows_is_its_motion():
    """mu r'' + r = cos x has the solution cos x/(1 - mu); after k terms (-mu)^k of it is left."""
    mu, edges = 0.01, np.linspace(0.0, TURN, 13)
    load, exact = np.cos(points(edges)), np.cos(points(edges)) / (1.0 - mu)
    for terms in (1, 2, 3):
        found, _, change, fell = periodic(
            edges, np.zeros_like(load), load[..., None], parts(np.array([mu]), np.zeros((1, 1)), 0), terms
        )
        assert np.abs(found[..., 0] - exact).max() == pytest.approx(mu**terms / (1 - mu), rel=1e-2)
        assert np.abs(change).max() == pytest.approx(mu ** (terms - 1), rel=1e-2)
    assert fell == pytest.approx(mu, rel=1e-2)


def test_a_series_that_grows_ends_before():
    """A mode slower than the load is no mode that follows it: the first term alone is left, and says so."""
    edges = np.linspace(0.0, TURN, 17)
    load = np.cos(3.0 * points(edges))
    found, _, change, fell = periodic(
        edges, np.zeros_like(load), load[..., None], parts(np.array([0.5]), np.zeros((1, 1)), 0)
    )
    assert found[..., 0] == pytest.approx(load, abs=1e-12)
    # In elements where the mode hardly turns, the speed at their ends is what suffers most.
    assert fell >= 1.0 and np.abs(change).max() == pytest.approx(3.0 * TURN / 16, rel=1e-2)


@pytest.mark.parametrize("turned", [3.0, 1.0, 0.1, 1e-2, 1e-3])
@pytest.mark.parametrize("mu", [1e-2, 1e-4])
def test_series_tell_what_they_miss_in_narrow_elements(mu, turned):
    """mu r'' + r = cos x from 1 on, as above, with the speed at both ends: what is wrong with it at one, the other
    takes back after so short a time."""
    edges = np.array([1.0, 1.0 + turned * np.sqrt(mu)])
    at, of = points(edges), parts(np.array([mu]), np.zeros((1, 1)), 0)
    found, _, speeds, change, fell = slow_motion(
        np.diff(edges), np.zeros_like(at), np.cos(at)[..., None], of, RULE, 1e-5, 9
    )
    exact, slope = np.cos(at) / (1 - mu), -np.sin(edges) / (1 - mu)
    missed = np.abs(found[0, :, 0, 0] - exact[0]).max()
    missed = max(missed, min(turned, 1.0) * np.sqrt(mu) * np.abs(speeds[0, :, 0, 0] - slope).max())
    assert fell < 0.5 and missed < 2.0 * np.abs(change).max() * fell + 5e-7


def test_what_changes_within_a_narrow_element_is_no_mode_to_follow():
    edges = np.array([0.0, 1e-3])
    at, of = points(edges), parts(np.array([0.01]), np.zeros((1, 1)), 0)
    load = 1.0 + 1e-6 * np.cos(6.0 * at / edges[1])[..., None]
    *_, change, _ = slow_motion(np.diff(edges), np.zeros_like(at), load, of, RULE, 1e-8, 9)
    assert np.abs(change).max() > 1e-3


def test_amplification_tells_a_resonance():
    edges = np.linspace(0.0, TURN, 65)
    zero, one = np.zeros((64, RULE.points.size)), np.ones((64, RULE.points.size, 1))
    near, far = (
        periodic(edges, zero, one, parts(np.array([w**-2]), np.zeros((1, 1)), 1))[1] for w in (5.0 + 1e-6, 5.5)
    )
    assert far < 1.0
    # The least singular value of a turn by 2 pi (1 + 1e-6/5) of the unit state is 2 sin(pi 1e-6).
    assert near == pytest.approx(1 / (TURN * 1e-6), rel=1e-2)


@pytest.mark.filterwarnings("error")
def test_exactly_at_a_resonance_nothing_is_determined():
    """A turn of two panels that leaves every state as it was: no NaN spreads from it, and none where it damps."""
    lefts = np.stack([np.eye(3, 2), np.eye(3, 2)])
    resonant, damped = lefts.copy(), 0.5 * lefts
    resonant[0, -1, 0] = damped[0, -1, 0] = 1.0
    unknowns, amplification = closed(lefts, resonant)
    assert amplification == np.inf and not unknowns.any()
    # x = (x/2 + 1)/2
    unknowns, amplification = closed(lefts, damped)
    assert amplification == pytest.approx(4.0 / 3.0)
    assert unknowns == pytest.approx(np.array([[2.0 / 3.0, 0.0], [4.0 / 3.0, 0.0]]))
