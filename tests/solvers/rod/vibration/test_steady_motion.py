"""Periodic motions in closed form and by time integration: slow modes by collocation, fast modes by quasi-static
series. They are solved by the kernels that a check calls, which are compiled already."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from solvers.numerics.radau import radau
from solvers.rod.cycle.composition import Composition, strip_of
from solvers.rod.vibration.equation import StripEquation
from solvers.rod.vibration.revolution import assemble, periodic_solution
from tests.solvers.rod.machines import PAPER, STRIP

TURN = 2 * np.pi
RULE = radau(10)


def points(edges):
    return edges[:-1, None] + np.diff(edges)[:, None] * RULE.points


def equation_of(masses, geometric, loss=0.0):
    """The equation of motion of given modes; the strip itself does not enter it."""
    given = StripEquation.of(strip_of(PAPER, STRIP, Composition(couples=True)), 1.0, 0.0, 4, 0.0)
    eigenvalues, vectors = np.linalg.eigh(geometric)
    return given._replace(
        loss=loss, masses=masses, geometric=geometric, eigenvalues=eigenvalues,
        eigenvectors=np.ascontiguousarray(vectors), clamp=np.ones((2, masses.size)),
    )  # fmt: skip


def assembled(edges, fluctuation, forces, equation, slow, tolerance=1e-7):
    """The solutions on all elements of one panel, of forces that act on the modes."""
    on_modes, still = np.zeros((2, fluctuation.size, equation.masses.size))
    on_modes[:] = forces.reshape(on_modes.shape)
    return assemble(equation, RULE, fluctuation.ravel(), still, on_modes, edges, np.zeros(1, np.int64), slow, tolerance)


def periodic(edges, fluctuation, forces, equation, slow, tolerance=1e-7):
    """Amplitudes at the points, amplification by the periodicity condition, the series' last term, and its ratio to the
    one before."""
    found = assembled(edges, fluctuation, forces, equation, slow, tolerance)
    none = np.empty((1, 0, 2 * equation.masses.size))
    initial, _, amplification = periodic_solution(found, none, none)
    state = np.append(initial[0], 1.0)
    at = np.array([np.append(state @ one, 1.0) for one in found.transfer])
    amplitudes = np.einsum("ec,epcn->epn", at, found.solutions)
    amplitudes[..., slow:] = amplitudes[..., slow:] @ found.fast_vectors.T
    return amplitudes, amplification, np.einsum("ec,epcq->epq", at, found.last_term), found.ratio


@pytest.mark.parametrize("frequency", [0.3, 3.4, 12.7])
def test_a_mode_rings_under_a_load_that_jumps(frequency):
    """a'' + w^2 a = w^2 sign: half a turn one way, half a turn the other; a = 1 - cos(w (x - pi/2))/cos(w pi/2)."""
    edges = np.linspace(0.0, TURN, 2 * 24 + 1)
    at = points(edges)
    side = np.where(edges[:-1] < 3.1, 1.0, -1.0)[:, None, None] * np.ones((1, RULE.points.size, 1))
    found, *_ = periodic(edges, np.zeros_like(at), side, equation_of(np.array([frequency**-2]), np.zeros((1, 1))), 1)
    half = np.where(at[:, -1:] > np.pi + 1e-9, at - np.pi, at)
    exact = side[:, :1, 0] * (1 - np.cos(frequency * (half - np.pi / 2)) / np.cos(frequency * np.pi / 2))
    assert found[..., 0] == pytest.approx(exact, abs=1e-8 * np.abs(exact).max())


@pytest.mark.parametrize("loss", [1e-3, 0.01, 0.3])
def test_a_damped_mode_rings_under_a_load_that_jumps(loss):
    """a'' + loss w a' + w^2 a = w^2 sign at an odd harmonic's resonance: a = 1 - Re(A e^(s x)) with a'(0) = -a'(pi)."""
    from mpmath import mp

    w, edges = 3.0, np.linspace(0.0, TURN, 2 * 24 + 1)
    at = points(edges)
    side = np.where(edges[:-1] < 3.1, 1.0, -1.0)[:, None, None] * np.ones((1, RULE.points.size, 1))
    equation = equation_of(np.array([w**-2]), np.zeros((1, 1)), loss)
    found, amplification, *_ = periodic(edges, np.zeros_like(at), side, equation, 1)
    with mp.workdps(40):
        s = mp.mpf(w) * mp.mpc(-mp.mpf(loss) / 2, mp.sqrt(1 - mp.mpf(loss) ** 2 / 4))
        # 1 - A - B becomes -1 after half a revolution, and so does the slope: A (1 + e^(s pi)) and its conjugate.
        a = mp.conj(s) / (mp.conj(s) - s) * 2 / (1 + mp.exp(s * mp.pi))
        exact = [1 - 2 * mp.re(a * mp.exp(s * mp.mpf(float(x)))) for x in at[:24].ravel()]
    exact = np.array([float(x) for x in exact]).reshape(24, -1)
    assert found[:24, :, 0] == pytest.approx(exact, abs=1e-8 * np.abs(exact).max())
    assert amplification == pytest.approx(1.0 / (1.0 - np.exp(-np.pi * w * loss)), rel=0.5 * loss + 1e-6)


@pytest.mark.parametrize("loss", [1e-3, 0.02])
def test_at_resonance_the_amplitude_is_the_inverse_of_the_loss_factor(loss):
    edges = np.linspace(0.0, TURN, 49)
    load = np.cos(5.0 * points(edges))
    equation = equation_of(np.array([5.0**-2]), np.zeros((1, 1)), loss)
    found, *_ = periodic(edges, np.zeros_like(load), load[..., None], equation, 1)
    assert found[..., 0] == pytest.approx(np.sin(5.0 * points(edges)) / loss, abs=1e-7 / loss)


MASSES, GEOMETRIC = np.array([0.05, 0.0004]), np.array([[0.3, 0.1], [0.1, 0.2]])
"""Two modes coupled by a force that fluctuates as cos x."""


def coupled_forces(x):
    return np.stack([np.sin(x), np.sin(2 * x) + 0.5], axis=-1)


@cache
def coupled_motion(loss):
    """The periodic motion of the two modes at every sixth of 48 edges, from the initial value problem for all initial
    states at once."""

    def motion(x, columns):
        states = columns.reshape(4, 5)
        load = coupled_forces(x)[:, None] * np.array([1.0, 0.0, 0.0, 0.0, 0.0])
        held = (np.eye(2) + np.cos(x) * GEOMETRIC) @ states[:2] + loss * np.sqrt(MASSES)[:, None] * states[2:]
        return np.concatenate([states[2:], (load - held) / MASSES[:, None]]).ravel()

    at, start = np.linspace(0.0, TURN, 9), np.eye(4, 5, 1)
    path = solve_ivp(motion, (0, TURN), start.ravel(), method="DOP853", rtol=1e-11, atol=1e-13, t_eval=at).y
    path = path.reshape(4, 5, at.size)
    initial = np.linalg.solve(np.eye(4) - path[:, 1:, -1], path[:, 0, -1])
    return (path[:2, 0] + np.einsum("acx,c->ax", path[:2, 1:], initial)).T[:-1]


@pytest.mark.parametrize("loss", [0.0, 0.05])
@pytest.mark.parametrize("slow", [2, 1])
def test_coupled_modes_against_an_initial_value_problem(slow, loss):
    """Both slow, by collocation; or the fast one by the series, without ringing as nothing excites it."""
    edges = np.linspace(0.0, TURN, 49)
    at = points(edges)
    equation = equation_of(MASSES, GEOMETRIC, loss)
    found, amplification, term, ratio = periodic(edges, np.cos(at), coupled_forces(at), equation, slow)
    path = coupled_motion(loss)
    assert found[::6, 0] == pytest.approx(path, abs=1e-7 * np.abs(path).max())
    assert 0.5 <= amplification < 100
    assert slow == 2 or (ratio < 0.2 and np.abs(term).max() < 1e-6)


@pytest.mark.parametrize(("mu", "terms"), [(0.002, 3), (0.005, 3), (0.04, 4)])
def test_the_series_of_a_fast_mode_converges_to_its_motion(mu, terms):
    """mu r'' + r = cos x has the solution cos x/(1 - mu); the relative error after k terms is (-mu)^k. The last term is
    the first one below the tolerance."""
    edges = np.linspace(0.0, TURN, 7)
    load, exact = np.cos(points(edges)), np.cos(points(edges)) / (1.0 - mu)
    equation = equation_of(np.array([mu]), np.zeros((1, 1)))
    found, _, term, ratio = periodic(edges, np.zeros_like(load), load[..., None], equation, 0, 1e-4)
    assert np.abs(found[..., 0] - exact).max() == pytest.approx(mu**terms / (1 - mu), rel=1e-2)
    assert np.abs(term).max() == pytest.approx(mu ** (terms - 1), rel=1e-2)
    assert ratio == pytest.approx(mu, rel=1e-2)


def test_a_diverging_series_ends_before_its_growing_term():
    """The series of a mode slower than the load consists of its first term only, and its error estimate is of that
    size."""
    edges = np.linspace(0.0, TURN, 17)
    load = np.cos(3.0 * points(edges))
    equation = equation_of(np.array([0.5]), np.zeros((1, 1)))
    found, _, term, ratio = periodic(edges, np.zeros_like(load), load[..., None], equation, 0)
    assert found[..., 0] == pytest.approx(load, abs=1e-12)
    # In narrow elements the speed at the ends has the largest error.
    assert ratio >= 1.0 and np.abs(term).max() == pytest.approx(3.0 * TURN / 16, rel=1e-2)


@pytest.mark.parametrize("phase", [3.0, 1.0, 0.3, 0.1, 1e-2, 1e-3])
@pytest.mark.parametrize("mu", [1e-2, 1e-4])
def test_estimates_are_honest_in_narrow_elements(mu, phase):
    """mu r'' + r = cos x from 1 on, including the speed at both ends: the effects of its errors there nearly cancel
    over a short element. Rounding errors of derivatives end the series, with the size of its last term as estimate."""
    edges, tolerance = np.array([1.0, 1.0 + phase * np.sqrt(mu)]), 1e-5
    at, equation = points(edges), equation_of(np.array([mu]), np.zeros((1, 1)))
    found = assembled(edges, np.zeros_like(at), np.cos(at), equation, 0, tolerance)
    exact, slope = np.cos(at) / (1 - mu), -np.sin(edges) / (1 - mu)
    error = np.abs(found.solutions[0, :, 0, 0] - exact[0]).max()
    error = max(error, min(phase, 1.0) * np.sqrt(mu) * np.abs(found.speeds[0, :, 0, 0] - slope).max())
    rest = found.ratio / (1.0 - found.ratio) if found.ratio < 0.5 else 1.0
    assert error < 1.1 * np.abs(found.last_term).max() * rest + 0.1 * tolerance


def test_a_fast_change_in_a_narrow_element_raises_the_error_estimate():
    edges = np.array([0.0, 1e-3])
    at, equation = points(edges), equation_of(np.array([0.01]), np.zeros((1, 1)))
    found = assembled(edges, np.zeros_like(at), 1.0 + 1e-6 * np.cos(6.0 * at / edges[1]), equation, 0, 1e-8)
    # The first term does not follow the force; its ringing is of the size of the force's change.
    assert np.abs(found.last_term).max() > 1e-6


def test_amplification_near_a_resonance():
    edges = np.linspace(0.0, TURN, 65)
    zero, one = np.zeros((64, RULE.points.size)), np.ones((64, RULE.points.size, 1))
    near, far = (
        periodic(edges, zero, one, equation_of(np.array([w**-2]), np.zeros((1, 1))), 1)[1] for w in (5.0 + 1e-6, 5.5)
    )
    assert far < 1.0
    # The least singular value of I minus a rotation by 2 pi (1 + 1e-6/5) is 2 sin(pi 1e-6).
    assert near == pytest.approx(1 / (TURN * 1e-6), rel=1e-2)


@pytest.mark.filterwarnings("error")
def test_amplification_is_infinite_exactly_at_a_resonance():
    """A revolution of two panels that reproduces every state: no NaN results from it; with damping the solution is
    regular."""
    start = np.stack([np.eye(3, 2), np.eye(3, 2)])
    resonant, damped = start.copy(), 0.5 * start
    resonant[0, -1, 0] = damped[0, -1, 0] = 1.0
    edges, none, equation = np.linspace(0.0, TURN, 3), np.empty((2, 0, 2)), equation_of(np.ones(1), np.zeros((1, 1)))
    panels = assembled(edges, *np.zeros((2, 2, RULE.points.size)), equation, 1)._replace(
        first=np.arange(2), start=start
    )
    initial, _, amplification = periodic_solution(panels._replace(end=resonant), none, none)
    assert amplification == np.inf and not initial.any()
    # x = (x/2 + 1)/2
    initial, _, amplification = periodic_solution(panels._replace(end=damped), none, none)
    assert amplification == pytest.approx(4.0 / 3.0)
    assert initial == pytest.approx(np.array([[2.0 / 3.0, 0.0], [4.0 / 3.0, 0.0]]))
