"""A bore counts as symmetric only if its halves agree, on both sides of every position."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from solvers import pin
from solvers.pin.stations.lobatto_panels import initial_stations
from tests.solvers.pin.pins import GEOMETRY, STEEL, VAZ

D, LENGTH, FORCE = GEOMETRY.outer_diameter, GEOMETRY.length, 15e3
EVEN = 12e-3


def told(x, bore, accuracy=1e-9):
    return pin.check(VAZ, pin.Profile(x, bore), accuracy=accuracy).value


GROOVES = {
    "rises to a step": ((0.0, 50e-3, 56e-3, 56e-3, LENGTH), (EVEN, EVEN, 19e-3, EVEN, EVEN)),
    "falls from a step": ((0.0, 56e-3, 56e-3, 60e-3, LENGTH), (EVEN, EVEN, 19e-3, EVEN, EVEN)),
    "a spike": ((0.0, 56e-3, 56e-3, 56.1e-3, 56.1e-3, LENGTH), (EVEN, EVEN, 19e-3, 19e-3, EVEN, EVEN)),
}


@pytest.mark.parametrize("groove", GROOVES.values(), ids=GROOVES)
def test_a_groove_in_the_second_half_is_not_overlooked(groove):
    """At its own places, and on the one side that begins there, such a bore is what its mirror image is."""
    x, bore = groove
    mirrored = tuple(LENGTH - place for place in reversed(x)), bore[::-1]
    here, there = told(x, bore), told(*mirrored)
    # At 56 mm, from the other end: M = P a/6 + P t/2 in the boss's edge and the gap, and Q = P/2.
    place = LENGTH - 56e-3
    y, moment = place / GEOMETRY.boss_length, FORCE * GEOMETRY.boss_length / 6
    ring = D**4 - 19e-3**4
    bending = 32 * moment * y**3 * D / (np.pi * ring)
    shear = 16 * FORCE / 2 * y**2 * (D**2 + D * 19e-3 + 19e-3**2) / (3 * np.pi * ring)
    assert here.equivalent_stress_max >= np.hypot(bending, 2 * shear) * (1 - 1e-9)
    for name in ("mass", "min_bore", "equivalent_stress_max", "strength_utilisation", "deflection"):
        assert getattr(here, name) == pytest.approx(getattr(there, name), rel=1e-9), name
    assert here.worst_section == pytest.approx(LENGTH - there.worst_section, rel=1e-6)
    assert here.ring.ovalization_max == pytest.approx(there.ring.ovalization_max, rel=1e-9)


def test_a_foil_that_thins_toward_one_end_is_no_foil_of_one_thickness():
    """Halves are compared by their walls, be these a millionth of the diameter."""
    thick, thin = 1.0009e-6, 1e-6
    tapered = told((0.0, LENGTH), (D * (1 - thick), D * (1 - thin)))
    even = told((0.0,), (D * (1 - thin),))
    assert tapered.mass / even.mass == pytest.approx(1 + 0.00045, rel=1e-6)
    assert 1 - tapered.deflection / even.deflection == pytest.approx(0.00045, rel=1e-2)


def test_halves_that_only_rounding_tells_apart_are_alike():
    x, bore = (0.0, 11.1e-3, 11.1e-3, 37.7e-3), (18e-3, 17e-3, 16e-3, 12e-3)
    whole = x + tuple(LENGTH - place for place in reversed(x)), bore + bore[::-1]
    half, both = pin.Profile(x, bore), pin.Profile(*whole)
    for profile in (half, both):
        along = profile.along(LENGTH)
        assert along.is_symmetric(LENGTH, np.maximum(D - np.array(along.bore), 0.0))
    assert pin.check(VAZ, half, accuracy=1e-9).value.deflection == pytest.approx(
        pin.check(VAZ, both, accuracy=1e-9).value.deflection, rel=1e-13
    )


def test_places_that_only_rounding_tells_from_the_ends_are_no_edges():
    for places in ((LENGTH * (1 - 0.9e-13), 0.03), (LENGTH * 0.9e-13, 0.03)):
        edges = initial_stations(replace(VAZ, symmetric=False), places).edges
        assert edges[0] == 0.0 and edges[-1] == pytest.approx(LENGTH, rel=1e-13)
        assert np.diff(edges).min() > 1e-13 * LENGTH
    value = told((0.0, 30e-3, LENGTH * (1 - 1e-13)), (15e-3, 12e-3, 10e-3))
    assert value.deflection == pytest.approx(told((0.0, 30e-3, LENGTH), (15e-3, 12e-3, 10e-3)).deflection, rel=1e-11)


LENGTHS = [(24e-3, 30e-3, 1e-3), (41.9e-3, 15.7e-3, 0.0), (18.3e-3, 28.1e-3, 3.3e-3), (7.7e-3, 21.3e-3, 0.7e-3)]


@pytest.mark.parametrize("lengths", LENGTHS)
@pytest.mark.parametrize("turned", [False, True])
def test_a_bushings_pressures_are_those_of_the_boss_that_bears_more(lengths, turned):
    """Its outside tapers, so that one boss has less to bear on; the rod's share is the mean diameter's."""
    geometry = pin.BushingGeometry(14e-3, *lengths)
    boss, rod, _ = lengths
    ends = (26e-3, 16e-3) if turned else (16e-3, 26e-3)
    scene = pin.Scene(geometry, FORCE, STEEL)
    found = pin.check(scene, pin.Profile((0.0, geometry.length), ends)).value.pressures
    edge = 16e-3 + 10e-3 * boss / geometry.length
    assert found.small_end == pytest.approx(FORCE / (rod * 21e-3), rel=1e-12)
    assert found.boss_mean == pytest.approx(0.5 * FORCE / (boss * 0.5 * (16e-3 + edge)), rel=1e-12)
    assert found.boss_peak == pytest.approx(FORCE / (boss * edge), rel=1e-12)
