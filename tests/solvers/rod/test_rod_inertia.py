"""Harmonic balance of the vibrating strip against finite elements in space and collocation in time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from solvers.rod.cycle import BeamColumn, Composition, Cycle
from solvers.rod.rod_inertia import RodInertia
from solvers.rod.vibration import natural_frequency
from tests.solvers.rod.finite_elements import vibration
from tests.solvers.rod.machines import PAPER, STRIP

ANGLES = 2 * np.pi * np.arange(40) / 40
"""Enough for the harmonics that the balance keeps; both models leave out what a far higher one may resonate with."""
STATIONS = np.linspace(0.0, STRIP.l, 41)
STILL, MOVING = Composition(beam=BeamColumn()), Composition(beam=BeamColumn(), corrections=(RodInertia(),))


def departure(scene):
    """Deflection beyond the quasi-static one, (stations, angles)."""
    still, moving = (Cycle(scene, STRIP, c).at(ANGLES).shape.deflection(STATIONS) for c in (STILL, MOVING))
    return moving - still


def at_speed(speed):
    return replace(PAPER, mechanism=replace(PAPER.mechanism, speed=speed))


@pytest.mark.parametrize("speed", [50.0, 400.0, 900.0])
def test_matches_an_independent_beam(speed):
    scene = at_speed(speed)
    force = Cycle(scene, STRIP, STILL).axial_force(ANGLES)
    reference = vibration(scene, STRIP, ANGLES, force)
    assert departure(scene) == pytest.approx(reference, abs=1e-3 * np.abs(reference).max())


def test_grows_with_the_square_of_the_speed_when_slow():
    slow, fast = (np.abs(departure(at_speed(f))).max() for f in (1.0, 2.0))
    assert fast / slow == pytest.approx(4.0, rel=1e-3)


@pytest.mark.parametrize("harmonic", [2, 3])
def test_is_amplified_where_a_harmonic_meets_the_natural_frequency(harmonic):
    mean = float(Cycle(PAPER, STRIP, STILL).axial_force(ANGLES).mean())
    resonance = natural_frequency(PAPER, STRIP, mean) / harmonic
    near = max(np.abs(departure(at_speed(resonance * f))).max() for f in (0.99, 0.995, 1.0, 1.005, 1.01))
    aside = min(np.abs(departure(at_speed(resonance * f))).max() for f in (0.9, 1.1))
    assert near > 3 * aside
