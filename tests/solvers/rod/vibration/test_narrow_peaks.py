"""Pressures that rise and fall within a few degrees of a revolution."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from solvers import rod
from solvers.effects import EffectSelection
from solvers.errors import InvalidInput
from solvers.rod.cycle.composition import Composition, Cycle
from solvers.rod.vibration import resolution
from solvers.rod.vibration.excitation import Excitation
from solvers.rod.vibration.periodic_motion import motion
from tests.solvers.rod.machines import PAPER, STRIP
from tests.solvers.rod.vibration.test_jumps import UnderADiagram

MOVED = frozenset({"beam_column", "friction", "friction_feedback", "rod_inertia"})
SELECTION = EffectSelection(MOVED, frozenset(effect.name for effect in rod.EFFECTS) - MOVED)


def peak(width: float) -> rod.Scene:
    """The paper's machine under three pressures, ``width`` degrees apart."""
    angle = np.radians([100.0, 100.0 + width, 100.0 + 2.0 * width])
    return replace(PAPER, load=rod.TableLoad(tuple(angle.tolist()), (1.4e6, 2.3e6, 1.6e6)))


def test_the_motion_behind_a_narrow_peak_is_that_of_a_galerkin_method_on_a_fine_mesh():
    scene = peak(5.0)
    outcome = rod.check(scene, STRIP, SELECTION)
    found = np.array([outcome.value.stresses.side_force_max, outcome.value.stresses.clamp_moment_max])
    assert outcome.accuracy.estimated < 1e-3
    dense = UnderADiagram(scene, STRIP, MOVED)
    coarse, fine = dense.greatest_reactions(8, 400), dense.greatest_reactions(12, 800)
    own = np.abs(coarse / fine - 1.0)
    assert np.all(own < 1e-3)
    assert np.all(np.abs(found / fine - 1.0) < own)
    assert np.all(np.abs(found / fine - 1.0) < outcome.accuracy.estimated)


def test_corners_of_the_friction_are_found_within_a_narrow_piece():
    """The piston begins and ceases to contact both walls on the way up, and again on the way down."""
    scene = peak(1.0)
    cycle = Cycle(scene, STRIP, Composition(couples=True, feedback=True))
    corners = np.degrees(Excitation.of(cycle, 1e-7).corners)
    assert corners[[0, 3, 6]] == pytest.approx([100.0, 101.0, 102.0])
    # Angles at which the couple of both walls equals the side force, from the dense model's samples.
    angle = np.radians(np.linspace(100.0, 102.0, 20_001))
    still = UnderADiagram(scene, STRIP, frozenset({"friction_feedback"})).bent(angle)
    beyond = 6.0 * np.abs(still.moment) / scene.piston.skirt_length - np.abs(still.side)
    switched = np.degrees(angle[:-1][beyond[1:] * beyond[:-1] < 0.0])
    assert corners[[1, 2, 4, 5]] == pytest.approx(switched, abs=2e-4)


def test_motions_of_narrow_peaks_are_few_and_quick(monkeypatch):
    """If more modes are excited than can be integrated in time, attempts end early."""
    work = []

    def counted(equation, excitation, slow, step, tolerance):
        found = motion(equation, excitation, slow, step, tolerance)
        work.append(resolution._work(found.edges.size - 1, found.slow, equation.masses.size))
        return found

    monkeypatch.setattr(resolution, "motion", counted)
    estimates = [rod.check(peak(width), STRIP, SELECTION).accuracy.estimated for width in (20.0, 5.0, 1.0)]
    assert estimates[0] < 1e-4 and estimates[1] < 1e-3 and estimates[2] < 1.0
    assert len(work) <= 15
    assert max(work) <= 1.5 * resolution.MOST_WORK


@pytest.mark.parametrize("width", [0.1, 1e-3])
def test_a_peak_too_narrow_for_the_vibration_is_refused_by_the_load(width):
    with pytest.raises(InvalidInput) as refusal:
        rod.check(peak(width), STRIP, SELECTION)
    assert refusal.value.field == "load"
    # Without vibration its stresses are known.
    still = EffectSelection(MOVED - {"rod_inertia"}, SELECTION.exclude | {"rod_inertia"})
    assert rod.check(peak(width), STRIP, still).accuracy.met


@pytest.mark.parametrize("load", [PAPER.load, peak(20.0).load])
def test_a_speed_far_above_the_strip_is_refused_as_such(load):
    fast = replace(PAPER, load=load, mechanism=replace(PAPER.mechanism, speed=1e6))
    with pytest.raises(InvalidInput, match="natural frequency") as refusal:
        rod.check(fast, STRIP, SELECTION)
    assert refusal.value.field == "mechanism.speed"


def test_where_a_steep_rise_calls_for_more_modes_than_there_is_time_for_polynomials_know_those_followed(monkeypatch):
    """With too few of them, as many modes as there was time for left 4 % unknown, in twice the time."""
    angle = np.radians([21.22, 153.41, 154.96, 175.78, 314.28, 348.84, 356.34])
    pressure = (30_910.0, 36_040.0, 36_200.0, 52_670.0, 42_990.0, 23_430.0, 52_810.0)
    scene = rod.Scene(
        rod.Mechanism(1.574e-3, 0.2103, 7.939),
        rod.Piston(60.8e-3, 58.24e-3, 0.0, 0.0, 0.0),
        rod.TableLoad(tuple(angle.tolist()), pressure),
        replace(PAPER.material, elastic_modulus=128.9e9, density=8830.0, loss_factor=0.01),
    )
    strip = rod.Dimensions(26.01e-3, 0.6521e-3, 148.9e-3)
    moved = frozenset({"beam_column", "friction", "rod_inertia"})
    selection = EffectSelection(moved, frozenset(effect.name for effect in rod.EFFECTS) - moved)
    outcome = rod.check(scene, strip, selection, accuracy=1e-4)
    assert outcome.accuracy.estimated < 2e-3
    # All modes that are called for.
    monkeypatch.setattr(resolution, "MOST_WORK", 10 * resolution.MOST_WORK)
    monkeypatch.setattr(resolution, "ENOUGH_WORK", 20 * resolution.ENOUGH_WORK)
    exact = rod.check(scene, strip, selection, accuracy=1e-6)
    assert exact.accuracy.estimated < 1e-5
    for name in ("fatigue_safety", "side_force_max", "clamp_moment_max"):
        found, known = (getattr(one.value.stresses, name) for one in (outcome, exact))
        assert found == pytest.approx(known, rel=outcome.accuracy.estimated)
