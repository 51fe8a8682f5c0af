"""The frequency ratio of strips against finite elements, and against resonances found by checks."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import eigh

from bench.rod_problems import problem
from solvers import rod
from solvers.effects import EffectSelection
from solvers.rod.cycle.composition import Cycle
from solvers.rod.effects import EFFECTS, choose_for, compose
from solvers.rod.optimum.full_model.frequency_ratio import log_frequency_ratio, log_frequency_ratio_gradient
from solvers.rod.optimum.full_model.strip import dimensions_of, logarithms
from solvers.rod.strip.stiffness import bending_stiffness
from tests.solvers.rod.finite_elements import matrices

ASKED = problem(316)
SCENE = ASKED.scene
ACTIVE = frozenset({"beam_column", "friction_feedback", "rod_inertia", "friction"})
CHOSEN = EffectSelection(ACTIVE, frozenset(effect.name for effect in EFFECTS) - ACTIVE)


def cycle_of(strip):
    return Cycle(SCENE, strip, compose(choose_for(SCENE, strip, CHOSEN, 1e-2)))


def expected(strip, angles=64):
    """Mean of omega_1/omega over instantaneous axial forces."""
    bending, geometric, mass, free, _ = matrices(strip.l, SCENE.mechanism.rod_length)
    line_mass = SCENE.material.density * strip.b * strip.h
    squares = []
    for force in cycle_of(strip).axial_force(2.0 * math.pi * np.arange(angles) / angles):
        stiffness = bending_stiffness(SCENE, strip) * bending + float(force) * geometric
        squares.append(eigh(free.T @ stiffness @ free, line_mass * free.T @ mass @ free, eigvals_only=True)[0])
    return float(np.mean(np.sqrt(squares))) / (2.0 * math.pi * SCENE.mechanism.speed)


@pytest.mark.parametrize(("b", "h", "l"), [(11.9, 0.4755, 38.1), (11.9, 0.4469, 37.5), (6.0, 0.5, 20.0)])
def test_it_is_the_mean_over_the_revolution(b, h, l):
    strip = rod.Dimensions(1e-3 * b, 1e-3 * h, 1e-3 * l)
    assert math.exp(log_frequency_ratio(cycle_of(strip))) == pytest.approx(expected(strip), rel=2e-4)


def test_its_gradient_is_that_of_finite_elements():
    strip = rod.Dimensions(11.9e-3, 0.4755e-3, 38.1e-3)
    x = logarithms(strip)
    changes = [
        math.log(expected(dimensions_of(x + step, SCENE)) / expected(dimensions_of(x - step, SCENE))) / 2e-3
        for step in 1e-3 * np.eye(3)
    ]
    # The axial force hardly depends on the strip.
    assert log_frequency_ratio_gradient(cycle_of(strip)) == pytest.approx(changes, rel=5e-3, abs=5e-3)


@pytest.mark.parametrize("h", [0.4469e-3, 0.4755e-3])
def test_resonances_lie_at_integers(h):
    """Under the mean force alone they would lie up to half a gap from them."""
    lengths = np.geomspace(34.8e-3, 39.9e-3, 120)
    strips = [rod.Dimensions(11.896636719333557e-3, h, float(length)) for length in lengths]
    safeties = np.array(
        [rod.check(SCENE, strip, CHOSEN, accuracy=1e-3).value.stresses.fatigue_safety for strip in strips]
    )
    inner = safeties[1:-1]
    least = 1 + np.flatnonzero((inner < safeties[:-2]) & (inner < safeties[2:]))
    ratios = [math.exp(log_frequency_ratio(cycle_of(strips[k]))) for k in least]
    assert len(ratios) >= 2
    assert np.abs(np.array(ratios) - np.round(ratios)).max() < 0.04
