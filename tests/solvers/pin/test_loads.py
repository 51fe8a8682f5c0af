"""Internal forces against the textbook's pieces and against equilibrium."""

from __future__ import annotations

import numpy as np
import pytest

from solvers import pin
from solvers.errors import InvalidInput
from solvers.pin.load.macaulay import forces_of
from solvers.pin.stations.lobatto_panels import Stations, initial_stations
from tests.solvers.pin.pins import VAZ, exact_forces, macaulay_terms, relative


@pytest.mark.parametrize("x", [1e-9, 5e-3, 24e-3, 24.5e-3, 25e-3, 31e-3, 39.99e-3])
def test_the_own_forces_are_the_pieces(x):
    at = np.array([x])
    shear, moment = exact_forces(VAZ, x)
    for place in (at, VAZ.geometry.length - at) if x > 1e-3 else (at,):
        found = VAZ.own_forces(place, place)
        assert relative(found[1, 0], shear) < 1e-12
        assert relative(found[0, 0], moment) < 1e-12


def test_macaulay_sums_are_the_pieces():
    """The pin's own load as a further case."""
    case, x = pin.LoadCase(tuple(pin.MacaulayTerm(*term) for term in macaulay_terms(VAZ))), initial_stations(VAZ)
    found, own = forces_of(case, x.x, x.side), VAZ.own_forces(x.x, x.side)
    assert np.allclose(found.moment, own[0], rtol=1e-12, atol=1e-12 * own[0].max())
    assert np.allclose(found.shear, own[1], rtol=1e-12, atol=1e-12 * VAZ.force)


def test_the_pin_is_in_equilibrium():
    end = np.array([VAZ.geometry.length])
    found = VAZ.own_forces(end, end)
    assert found[1, 0] < 1e-9 * VAZ.force
    assert found[0, 0] < 1e-12 * VAZ.force


def test_point_loads_jump_where_their_panels_meet():
    case = pin.LoadCase((pin.MacaulayTerm(5.0, 0.0, 0), pin.MacaulayTerm(-10.0, 0.5, 0)))
    stations = Stations(np.array([0.0, 0.5, 1.0]))
    found = forces_of(case, stations.x, stations.side)
    at = stations.x == 0.5
    assert sorted(found.shear[at]) == [5.0, 5.0]
    assert np.allclose(found.moment, 5.0 * np.minimum(stations.x, 1 - stations.x))
    uneven = pin.LoadCase((pin.MacaulayTerm(5.0, 0.0, 0), pin.MacaulayTerm(-8.0, 0.5, 0)))
    assert sorted(forces_of(uneven, stations.x, stations.side).shear[at]) == [3.0, 5.0]


def test_two_planes_add_as_vectors():
    case = pin.LoadCase((pin.MacaulayTerm(3.0, 0.0, 0, 0), pin.MacaulayTerm(4.0, 0.0, 0, 1)))
    at = np.array([2.0])
    found = forces_of(case, at, at)
    assert found.shear[0] == 5.0
    assert found.moment[0] == 10.0


def test_quadrature_is_exact_for_polynomials_and_doubts_kinks():
    stations = Stations(np.array([0.0, 0.25, 1.0]))
    for power in range(14):
        assert stations.weight @ stations.x**power == pytest.approx(1 / (power + 1), rel=1e-14)
        if power <= 6:
            assert stations.error_estimate(stations.x**power).max() < 1e-15
    assert stations.error_estimate(np.abs(stations.x - 0.3)).max() > 1e-4
    assert stations.weight.sum() == pytest.approx(1.0, rel=1e-15)


def test_the_opening_stations_hold_every_place_where_something_begins():
    x = initial_stations(VAZ).x
    for place in (0.0, 24e-3, 25e-3, 40e-3):
        assert place in x


@pytest.mark.parametrize("bad", [{"order": 7}, {"plane": 2}, {"coefficient": float("nan")}, {"start": float("inf")}])
def test_terms_without_meaning_are_refused(bad):
    with pytest.raises(InvalidInput):
        pin.MacaulayTerm(**{"coefficient": 1.0, "start": 0.0, "order": 1, **bad})
