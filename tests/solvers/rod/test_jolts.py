"""What corners and jumps of the load leave ringing: the bound against integrals, and against the strip's own motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from oracles.textbook import rod_beam_column
from solvers import rod
from solvers.rod.effect_bounds.ringing_bound import left_ringing, pieces_of
from solvers.rod.effect_bounds.situation import Situation
from solvers.rod.effects import EFFECTS
from solvers.rod.load.axial_force import drive_of
from tests.solvers.rod.machines import PAPER, STRIP

NAMES = frozenset(effect.name for effect in EFFECTS)
STIFFNESS = PAPER.material.elastic_modulus * STRIP.b * STRIP.h**3 / 12.0


def table(degrees, megapascals):
    return rod.TableLoad(tuple(np.radians(degrees)), tuple(1e6 * np.array(megapascals)))


def ringing(scene, pace):
    """|int c' exp(i pace phi) dphi| of V''' and V'' at the clamp, from a million samples of the closed forms."""
    angle = np.linspace(0.0, 2.0 * np.pi, 1_000_001)
    force = -(scene.load.pressure(angle) - scene.load.reference_pressure()) * scene.piston.area
    c = rod_beam_column.solve(force / STIFFNESS, STRIP.l, scene.mechanism.rod_length)
    turned = np.exp(1j * pace * 0.5 * (angle[:-1] + angle[1:]))
    return [abs(np.sum(np.diff(part * np.sin(angle)) * turned)) for part in (c.clamp_shear, c.clamp_curvature)]


@pytest.mark.parametrize("pace", [20.0, 150.0, 1000.0, 6000.0])
@pytest.mark.parametrize("width", [20.0, 1.2, 0.01])
def test_what_rings_is_within_the_bound_and_not_far_below(width, pace):
    """A fall of the pressure over this many degrees, slow or fast for the mode."""
    scene = replace(PAPER, load=table([30.0, 100.0, 100.0 + width, 250.0], [1.9, 1.9, 1.5, 1.5]))
    ends = pieces_of(scene.load.sharp_angles())
    left = left_ringing(drive_of(scene, 0.0), ends, STIFFNESS, STRIP.l, scene.mechanism.rod_length, pace)
    for bound, true in zip(left, ringing(scene, pace), strict=True):
        assert true <= 1.01 * bound
        # Two corners' shares differ in phase, whatever the pace.
        assert bound <= 60.0 * true


def test_pieces_close_the_turn_and_none_are_those_of_a_smooth_load():
    ends = pieces_of(np.radians([300.0, 370.0, 100.0]))
    assert np.degrees(ends) == pytest.approx([10.0, 100.0, 300.0, 370.0])
    assert pieces_of(np.empty(0)).size == 0


def campaign_scene(load, lengths, piston, material):
    """Scenes that a campaign found: crank, rod [mm], speed [Hz]; diameter, skirt, offset [mm], friction; E, density."""
    radius, length, speed = lengths
    diameter, skirt, offset, friction = piston
    modulus, density, sensitivity = material
    return rod.Scene(
        rod.Mechanism(radius * 1e-3, length * 1e-3, speed),
        rod.Piston(diameter * 1e-3, skirt * 1e-3, 0.0, offset * 1e-3, friction),
        load,
        rod.Material(modulus * 1e9, 480e6, 1.15, sensitivity, 1200e6, density),
    )


STEEP = (
    campaign_scene(
        table([85.26, 216.78, 223.97, 225.63, 289.37, 327.39], [0.1168, 0.0815, 0.1012, 0.0784, 0.0918, 0.0573]),
        (0.82063, 27.221, 0.86906),
        (6.3323, 9.2724, 4.6384, 0.14468),
        (169.15, 7510.6, 0.00288),
    ),
    rod.Dimensions(3.10945e-3, 0.117868e-3, 14.22218e-3),
)
JUMP = (
    campaign_scene(
        table(
            [29.2333, 82.2698, 158.968, 186.379, 191.789, 310.084, 329.024],
            [1.51797, 1.71551, 1.54761, 1.79399, 0.832212, 1.92475, 1.1281],
        ),
        (0.0283086, 33.154, 34.8491),
        (9.7179, 20.6897, 0.0, 0.261463),
        (101.027, 2568.59, 0.388176),
    ),
    rod.Dimensions(3.00674e-3, 0.801517e-3, 11.1549e-3),
)


@pytest.mark.parametrize(("scene", "strip"), [STEEP, JUMP], ids=["1.7 degrees", "5.4 degrees"])
def test_a_steep_fall_calls_for_the_strips_inertia(scene, strip):
    """It sets the strip ringing for good, since no damping ends that: more than its accelerations alone would tell."""
    found = []
    for chosen in (NAMES, NAMES - {"rod_inertia"}):
        selection = rod.EffectSelection(include=chosen, exclude=NAMES - chosen)
        found.append(rod.check(scene, strip, selection, accuracy=1e-5))
    exact, without = (outcome.value.stresses for outcome in found)
    main = ("side_force_max", "clamp_moment_max", "fatigue_safety", "contact_pressure_max")
    change = max(abs(getattr(without, name) / getattr(exact, name) - 1.0) for name in main)
    bound = next(e for e in EFFECTS if e.name == "rod_inertia").influence(Situation.of(scene, strip))
    assert change > 2.0 * found[0].accuracy.estimated
    assert change <= bound
