"""Strips under tabulated pressures: a corner at every point, far more of them than modes that matter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from solvers import rod
from solvers.numerics.periodic import TURN
from solvers.rod.cycle.composition import Composition, Cycle
from solvers.rod.vibration import resolution
from solvers.rod.vibration.equation import StripEquation
from solvers.rod.vibration.excitation import MANY, Excitation
from solvers.rod.vibration.periodic_motion import motion
from tests.solvers.rod.machines import PAPER, STRIP
from tests.solvers.rod.vibration.test_ringing import QUICK, integrated, reactions

DAMPED = replace(PAPER.material, loss_factor=0.01)
STOUT = replace(STRIP, h=0.8e-3, l=14e-3)
INERTIA = rod.EffectSelection(include=frozenset({"rod_inertia"}))


def tabulated(points: int, noise: float) -> rod.TableLoad:
    """The paper's cycle, with normally distributed noise as a share of the greatest pressure."""
    angle = TURN * np.arange(points) / points
    pressure = PAPER.load.pressure(angle)
    pressure = pressure + noise * pressure.max() * np.random.default_rng(3).standard_normal(points)
    return rod.TableLoad(tuple(angle.tolist()), tuple(pressure.tolist()))


@pytest.mark.parametrize("noise", [0.0, 3e-3])
def test_a_motion_under_a_table_is_that_of_an_integration_in_time(noise):
    """With ringing modes and omitted ones."""
    scene = replace(QUICK, load=tabulated(MANY + 16, noise), material=DAMPED)
    cycle = Cycle(scene, STRIP, Composition(couples=True))
    excitation = Excitation.of(cycle, 1e-7)
    equation = StripEquation.of(excitation.strip, excitation.inertia, excitation.mean, 5, scene.material.loss_factor)
    found = motion(equation, excitation, 1, 6.0, 1e-6)
    assert 0 < found.ringing.modes < equation.masses.size - found.slow
    angles = excitation.edges[0] + np.array([0.3, 2.0, 3.7, 5.5])
    exact = equation.clamp @ integrated(equation, excitation, angles)
    seen = np.concatenate([equation.basis.values(np.zeros(1), order) for order in (2, 3)]) @ found.at(angles)
    wrong = np.max(np.abs(seen - exact) / reactions(excitation)[:, None])
    error = found.errors.total - found.errors.space
    assert wrong <= error + 1e-8
    # Ringing from successive corners is not in phase: the sum of the amplitudes is far more than its error.
    assert error < 1e3 * wrong + 1e-6


@pytest.mark.parametrize(("points", "noise", "met"), [(360, 0.0, 1e-6), (720, 0.0, 1e-6), (720, 1e-2, 1e-2)])
def test_checks_under_tables_take_few_motions(monkeypatch, points, noise, met):
    """A smooth table meets the accuracy asked for; with a noisy one the estimated error is larger, after few
    attempts."""
    taken = []

    def counted(*given):
        taken.append(motion(*given))
        return taken[-1]

    monkeypatch.setattr(resolution, "motion", counted)
    scene = replace(PAPER, load=tabulated(points, noise), material=DAMPED)
    outcome = rod.check(scene, STOUT, INERTIA)
    assert outcome.accuracy.estimated < met
    assert len(taken) <= 2
    assert all(one.edges.size <= 2 * points + 1 for one in taken)


def test_a_finer_resolution_under_a_noisy_table_agrees_with_a_check(monkeypatch):
    """Results agree with those of many more modes within the estimated errors."""
    scene = replace(PAPER, load=tabulated(72, 1e-2), material=DAMPED)
    coarse = rod.check(scene, STRIP, INERTIA)
    monkeypatch.setattr(resolution, "_LEVELS_WITH_CORNERS", (1.0,) * (len(resolution.POLYNOMIAL_COUNTS) - 1))
    fine = rod.check(scene, STRIP, INERTIA)
    assert fine.accuracy.estimated < coarse.accuracy.estimated
    for name in ("fatigue_safety", "side_force_max", "clamp_moment_max", "contact_pressure_max", "friction_power"):
        values = [getattr(one.value.stresses, name) for one in (coarse, fine)]
        assert values[0] == pytest.approx(values[1], rel=coarse.accuracy.estimated + fine.accuracy.estimated)
