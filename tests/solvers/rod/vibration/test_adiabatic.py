"""Vibration in adiabatic modes, against eigenvalues, the equation of motion integrated in time, and exact motions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from bench import rod_tables
from solvers import rod
from solvers.rod.cycle.composition import Composition, Cycle
from solvers.rod.vibration import resolution
from solvers.rod.vibration.adiabatic_motion import adiabatic_motion, coordinates_of
from solvers.rod.vibration.adiabatic_response import AdiabaticRodInertia
from solvers.rod.vibration.equation import StripEquation
from solvers.rod.vibration.excitation import MANY, RULE, Excitation, states_in
from solvers.rod.vibration.steady_response import RodInertia
from tests.solvers.rod.machines import PAPER, STRIP
from tests.solvers.rod.vibration.test_ringing import QUICK, integrated, reactions
from tests.solvers.rod.vibration.test_tables import DAMPED, STOUT, tabulated

ANGLES = np.linspace(0.0, 2.0 * np.pi, 500)


def cycle_of(correction, scene, dimensions, tolerance=1e-4):
    return Cycle(scene, dimensions, Composition(couples=True, feedback=True, corrections=(correction,)), tolerance)


def moments(cycle):
    """Clamp moment and side force over the revolution, relative to their greatest values."""
    shape = cycle.at(ANGLES)
    rows = np.array([shape.clamp_moment(), shape.side_force()])
    return rows / np.abs(rows).max(axis=1)[:, None]


def test_modes_are_those_under_every_force():
    """Also at nine tenths of the force that buckles the strip."""
    cycle = cycle_of(RodInertia(), PAPER, STRIP)
    excitation = Excitation.of(cycle, 1e-6)
    equation = StripEquation.of(excitation.strip, excitation.inertia, excitation.mean, 9, 0.0)
    n, shape = equation.masses.size, (4, RULE.points.size)
    fluctuation = np.linspace(-0.9, 0.5, 4 * RULE.points.size) / equation.geometric[0, 0]
    found = coordinates_of(
        equation,
        RULE,
        np.linspace(0.0, 1.0, 5),
        fluctuation.reshape(shape),
        np.zeros((*shape, n)),
        np.zeros(shape),
        n - 1,
    )
    frequencies, modes = found.frequency.reshape(-1, n), found.modes.reshape(-1, n, n)
    mass = np.diag(equation.masses)
    for force, frequency, own in zip(fluctuation, frequencies, modes, strict=True):
        stiffness = np.eye(mass.shape[0]) + force * equation.geometric
        squares, vectors = eigh(stiffness, mass)
        assert frequency**2 == pytest.approx(squares, rel=1e-6)
        signs = np.sign(np.sum(vectors * (mass @ own), axis=0))
        assert np.abs(own - signs * vectors).max(axis=0) == pytest.approx(0.0, abs=1e-5 * np.abs(own).max())
    assert np.allclose(modes[0] * np.sqrt(equation.masses), np.abs(np.eye(mass.shape[0])), atol=0.3)


@pytest.mark.parametrize(("noise", "loss"), [(0.0, 0.01), (3e-3, 0.01), (3e-3, 0.03)])
def test_a_motion_is_that_of_an_integration_in_time(noise, loss):
    """Within the estimated error, all modes ringing."""
    scene = replace(QUICK, load=tabulated(MANY + 16, noise), material=replace(DAMPED, loss_factor=loss))
    excitation = Excitation.of(Cycle(scene, STRIP, Composition(couples=True)), 1e-7)
    equation = StripEquation.of(excitation.strip, excitation.inertia, excitation.mean, 5, loss)
    found = adiabatic_motion(equation, excitation, excitation.edges, 1e-4)
    angles = excitation.edges[0] + np.array([0.3, 2.0, 3.7, 5.5])
    exact = equation.clamp @ integrated(equation, excitation, angles)
    seen = np.concatenate([equation.basis.values(np.zeros(1), order) for order in (2, 3)]) @ found.at(angles)
    wrong = np.max(np.abs(seen - exact) / reactions(excitation)[:, None])
    assert wrong <= found.errors.total
    assert found.errors.total < 100.0 * wrong


@pytest.mark.parametrize("seed", [5, 10, 16, 24, 41])
def test_motions_and_their_changes_are_the_exact_ones_to_some_percent(seed):
    """Measured pressures with and without noise: the vibration of a strip, and its change to strips next to it."""
    problem = rod_tables.problem(seed)
    bounds, scene = problem.bounds, problem.scene
    middle = np.log([(low * high) ** 0.5 for low, high in (bounds.b, bounds.h, bounds.l)])
    strips = [rod.Dimensions(*np.exp(middle + step)) for step in (np.zeros(3), [0.0, 2e-3, 0.0], [0.0, 0.0, 2e-3])]
    exact, found = (cycle_of(part, scene, strips[0], 1e-6) for part in (RodInertia(), AdiabaticRodInertia()))
    assert found.refinements[0].motion.rule is not exact.refinements[0].motion.rule
    vibration = np.abs(moments(exact) - moments(exact.without_corrections())).max()
    assert np.abs(moments(found) - moments(exact)).max() < 0.05 * vibration
    for one, other in zip(exact.neighbours(strips[1:]), found.neighbours(strips[1:]), strict=True):
        change, found_change = moments(one) - moments(exact), moments(other) - moments(found)
        assert np.abs(found_change - change).max() < 0.1 * np.abs(change).max()


def test_the_force_is_taken_between_corners():
    """Of 72 measured pressures, where resolving the forces would take twice as many elements."""
    cycle = cycle_of(AdiabaticRodInertia(), rod_tables.problem(24).scene, rod.Dimensions(5.9e-3, 0.24e-3, 9.2e-3))
    excitation = cycle.refinements[0].excitation
    assert np.array_equal(excitation.edges, excitation.anchors)
    assert Excitation.of(cycle, 3e-6, excitation.rule).edges.size > 2 * excitation.edges.size


def test_where_the_method_is_not_valid_motions_are_exact():
    """Few corners; two points of a table next to each other; and a strip so stiff that exact motions are quicker."""
    few, table = replace(PAPER, material=DAMPED), tabulated(MANY, 0.0)
    angles, pressures = [*table.angle, table.angle[-1] + 1e-6], [*table.values, 1.000001 * table.values[-1]]
    narrow = replace(few, load=rod.TableLoad(tuple(angles), tuple(pressures)))
    stiff = replace(STRIP, h=1.2e-3, l=9e-3)
    for scene, strip in ((few, STOUT), (narrow, STOUT), (replace(few, load=tabulated(72, 0.0)), stiff)):
        exact, found = (cycle_of(part, scene, strip).refinements[0] for part in (RodInertia(), AdiabaticRodInertia()))
        assert np.array_equal(exact.motion.samples, found.motion.samples)


def test_searches_take_few_exact_motions(monkeypatch):
    """The answer is checked exactly."""
    taken = []
    motion = resolution.motion

    def counted(*given):
        taken.append(given)
        return motion(*given)

    monkeypatch.setattr(resolution, "motion", counted)
    problem = rod_tables.problem(16)
    outcome = rod.design(problem)
    assert 0 < len(taken) < 10
    answer = outcome.value.check
    again = rod.check(problem.scene, answer.dimensions)
    error = outcome.accuracy.estimated + again.accuracy.estimated
    assert again.value.stresses.fatigue_safety == pytest.approx(answer.stresses.fatigue_safety, rel=error)


@pytest.mark.parametrize(("seed", "points"), [(38, 4), (23, 5), (24, 6)])
def test_elements_in_which_the_first_mode_turns_less_need_fewer_points(seed, points):
    problem = rod_tables.problem(seed)
    found = cycle_of(AdiabaticRodInertia(), problem.scene, problem.bounds.middle)
    assert found.refinements[0].motion.rule.points.size == points


def test_states_of_an_end_that_two_elements_share_are_those_at_its_angle():
    cycle = cycle_of(AdiabaticRodInertia(), PAPER, STRIP)
    edges = np.array([0.3, 1.0, 1.1, 4.0])
    angles = edges[:-1, None] + np.diff(edges)[:, None] * RULE.points
    found = states_in(cycle.drive, cycle.strip, np.empty(0), edges, RULE)
    assert found == pytest.approx(cycle.states(angles.ravel()), rel=1e-12)
