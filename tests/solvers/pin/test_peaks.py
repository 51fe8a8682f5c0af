"""Maximum utilisation between stations: dense sampling finds no excess beyond the accuracy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from solvers import pin
from solvers.pin.optimum.program import constraints_at
from tests.solvers.pin.pins import VAZ

PAPER = "tresca_paper"


def cone(seed):
    rng = np.random.default_rng(seed)
    outer = 10 ** rng.uniform(-2.5, -0.7)
    boss, small = outer * 10 ** rng.uniform(-0.3, 0.4, 2)
    geometry = pin.Geometry(outer, boss, small, outer * rng.uniform(0.01, 0.2))
    end = outer * rng.uniform(0.4, 0.95)
    scene = pin.Scene(geometry, 1e6 * outer**2, pin.PinMaterial(1e8, 2e11, 0.3, 7850.0))
    return scene, end, end * rng.uniform(0.1, 1.0)


def strength_used(scene, end, middle, count=100_001):
    """From the textbook's sums: v = 1 - (d/D)^4 as it stands, at many places."""
    half = 0.5 * scene.geometry.length
    x = np.linspace(0.0, half, count)[1:-1]
    ratio = (end + (middle - end) * x / half) / scene.geometry.outer_diameter
    constraints = constraints_at(scene, pin.CRITERIA[PAPER], x, x)
    wall = 1.0 - ratio
    forces = (
        np.hypot(
            c.bending + c.axial * (1.0 + ratio**2),
            c.shear * (c.law.c0 + c.law.c1 * wall + c.law.c2 * wall**2) + c.torsion,
        )
        for c in constraints
    )
    return max((force / (1.0 - ratio**4)).max() for force in forces)


@pytest.mark.parametrize("accuracy", [1e-4, 1e-7])
@pytest.mark.parametrize("seed", range(12))
def test_no_dense_look_finds_more_of_the_strength_used(seed, accuracy):
    scene, end, middle = cone(seed)
    told = pin.check(scene, pin.Profile((0.0, 0.5 * scene.geometry.length), (end, middle)), accuracy=accuracy)
    doubt = told.accuracy.estimated + 1e-9
    assert doubt < accuracy
    assert told.value.strength_utilisation >= strength_used(scene, end, middle) * (1.0 - doubt)


@pytest.mark.parametrize("allowable", [1e6, 3e7, 4e8])
@pytest.mark.parametrize("seed", range(6))
def test_each_strength_has_a_greatest_use_of_its_own(seed, allowable):
    """A limit on the shear stress that is used most elsewhere must not hide where the criterion is."""
    scene, end, middle = cone(seed)
    limited = replace(scene, material=replace(scene.material, allowable_shear=allowable))
    profile = pin.Profile((0.0, 0.5 * scene.geometry.length), (end, middle))
    told = pin.check(limited, profile, accuracy=1e-6)
    dense = strength_used(scene, end, middle) * scene.material.allowable_stress
    assert dense * (1.0 - told.accuracy.estimated - 1e-9) <= told.value.equivalent_stress_max <= dense * (1.0 + 1e-4)


# The bushing's check, against the textbook's stresses of a tube of the outer diameter at hand.


def sleeve(seed):
    """A bushing with an outside that is straight from the end to the middle, under a load with equal bending and shear
    utilisation."""
    rng = np.random.default_rng(seed)
    bore = 10 ** rng.uniform(-2.5, -0.7)
    boss, small = bore * 10 ** rng.uniform(-0.3, 0.6, 2) * np.array([1.0, 2.0])
    geometry = pin.BushingGeometry(bore, boss, small, bore * rng.uniform(0.01, 0.2))
    scene = pin.Scene(geometry, 1e6 * bore**2, pin.PinMaterial(1e8, 2e11, 0.3, 7850.0))
    return scene, bore * rng.uniform(1.02, 1.2), bore * rng.uniform(1.2, 1.7)


def strength_used_outside(scene, end, middle, count=200_001):
    """The third theory with the greatest bending and Zhuravsky's greatest shear stress taken together."""
    half, d = 0.5 * scene.geometry.length, scene.geometry.bore
    kinks = [place for place in scene.breakpoints if place < half]
    x = np.sort(np.concatenate([np.linspace(0.0, half, count)[1:], kinks]))
    outer = end + (middle - end) * x / half
    moment, force = scene.own_forces(x, x)[:2]
    ring = outer**4 - d**4
    bending = 32.0 * moment * outer / (np.pi * ring)
    shear = 16.0 * force * (outer**2 + outer * d + d**2) / (3.0 * np.pi * ring)
    return np.hypot(bending, 2.0 * shear).max() / scene.material.allowable_stress


@pytest.mark.parametrize("accuracy", [1e-4, 1e-7])
@pytest.mark.parametrize("seed", range(12))
def test_no_dense_look_finds_more_of_a_bushings_strength_used(seed, accuracy):
    scene, end, middle = sleeve(seed)
    outside = pin.Profile((0.0, 0.5 * scene.geometry.length), (end, middle))
    told = pin.check(scene, outside, accuracy=accuracy).value
    dense = strength_used_outside(scene, end, middle)
    assert dense * (1.0 - accuracy) <= told.strength_utilisation <= dense * (1.0 + 1e-9)


def test_a_steep_rise_from_a_bare_end_is_no_maximum():
    """A slope limit lets the wall end in almost nothing, where the utilisation rises to its plateau at once."""
    geometry = pin.Geometry(7.831e-3, 7.482e-3, 2.179e-3, 0.02e-3)
    scene = pin.Scene(geometry, 7156.0, pin.PinMaterial(508e6, 190e9, 0.088, 6114.0, 266e6))
    limits = pin.Limits(max_deflection=0.769e-6, max_slope=1.938)
    problem = pin.PinProblem(scene, limits, pin.Free(drillable=True), pin.CRITERIA["fibre"])
    for accuracy in (1e-4, 1e-6):
        assert pin.design(problem, accuracy=accuracy).accuracy.met


@pytest.mark.parametrize(("accuracy", "most"), [(1e-6, 100), (1e-9, 300)])
def test_a_smooth_maximum_in_the_middle_needs_no_further_stations(accuracy, most):
    """The line through the two nodes before the end passes above it, for which designs were repeated nine times."""
    limits = pin.Limits(max_deflection=9e-6, max_slope=0.3)
    found = pin.design(pin.PinProblem(VAZ, limits, pin.Free()), accuracy=accuracy)
    assert found.accuracy.met
    assert found.accuracy.settings["stations"] <= most
    # Deflection governs: nowhere is the strength used up, and most of it in the middle.
    assert found.value.check.strength_utilisation < 0.8
    assert found.value.check.worst_section == 0.5 * VAZ.geometry.length
