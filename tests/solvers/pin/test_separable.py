"""The fast tier against brute force, the cone program, and its own certificate."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from solvers import pin
from solvers.pin.optimum.conic import slope_limited, slope_limited_optimum, thickened
from solvers.pin.optimum.dual_bound import (
    NeighbourMultipliers,
    coupled_bound,
    least_walls_bound,
    monotone_bound,
    pointwise_bound,
)
from solvers.pin.optimum.lagrangian import minimum_volume
from solvers.pin.section.flexibility import cowper, densities
from solvers.pin.shapes.free import Free
from solvers.pin.stations.lobatto_panels import Stations
from tests.solvers.pin.pins import BENDING_ONLY, GEOMETRY, VAZ, grams, program, scaled, vaz

LIMIT = 11.22302193e-6


def test_the_reference_optimum_by_an_independent_dense_quadrature():
    """Bisection on the multiplier with a search at 10,000 midpoints, from the textbook's formulas alone."""
    g, m = GEOMETRY, VAZ.material
    a, b, gap, D, P = g.boss_length, g.small_end_length, g.gap, g.outer_diameter, 15e3
    n = 10_000
    x = (np.arange(n) + 0.5) / n * 0.04
    t = x - a - gap
    shear = np.where(x < a, P * x**2 / (2 * a * a), np.where(t < 0, P / 2, P / 2 - P * t / b))
    moment = np.where(
        x < a, P * x**3 / (6 * a * a), P * a / 6 + P / 2 * (x - a) - np.where(t > 0, P * t**2 / (2 * b), 0)
    )
    mm, qq = 32 * moment / (math.pi * 150e6 * D**3), 32 * np.abs(shear) / (3 * math.pi * 150e6 * D**2)
    low, high = np.zeros(n), np.ones(n)
    for _ in range(60):
        beta = (low + high) / 2
        good = 1 - beta**4 >= np.sqrt(mm**2 + (qq * (1 + beta + beta**2)) ** 2)
        low, high = np.where(good, beta, low), np.where(good, high, beta)
    least = 1 - low**2
    inside = x > a
    bend = np.where(inside, moment * (x - a) / 2 / (m.elastic_modulus * g.inertia), 0)
    cut = np.where(inside, shear / 2 / (m.shear_modulus * g.area), 0)
    law = cowper(0.3)

    def flexibility(u):
        return bend / (u * (2 - u)) + cut * (law.a / u + law.b * (1 - u) / (u * (2 - u) ** 2))

    def best(price):
        # Convex up to 0.9, then both shapes: golden section on pieces short enough for one least value each, and 1.
        found, least_cost = np.ones(n), 1.0 + price * flexibility(np.ones(n))
        for piece in np.array([[0.0, 0.9], [0.9, 1.0]]):
            lo, hi = np.maximum(least, piece[0]), np.maximum(least, piece[1])
            for _ in range(52):
                p, q = hi - 0.618034 * (hi - lo), lo + 0.618034 * (hi - lo)
                left = p + price * flexibility(p) < q + price * flexibility(q)
                lo, hi = np.where(left, lo, p), np.where(left, q, hi)
            u = (lo + hi) / 2
            cost = u + price * flexibility(u)
            found, least_cost = np.where(cost < least_cost, u, found), np.minimum(cost, least_cost)
        return np.where(inside, found, least)

    down, up = 0.0, 1e6
    for _ in range(46):
        price = (down + up) / 2
        soft = 2 * flexibility(best(price))[inside].sum() * 0.04 / n > LIMIT
        down, up = (price, up) if soft else (down, price)
    # At this price one of the 10,000 is split, no more.
    mass = 7850 * g.area * g.length * best(up).mean() * 1e3
    assert grams(VAZ, max_deflection=LIMIT) == pytest.approx(mass, rel=2e-6)
    assert grams(VAZ, max_deflection=LIMIT) == pytest.approx(94.475914, rel=1e-8)


WORST = pin.Scene(
    pin.Geometry(54.032711269773465e-3, 28.71342618822056e-3, 29.901389266987234e-3, 2.157238812273209e-3),
    86467.93287163248,
    pin.PinMaterial(300e6, 210e9, 0.0, 7850.0),
)


@pytest.mark.parametrize(
    ("scene", "limit", "form", "rival"),
    [
        (VAZ, 8.4e-6, Free(), 120.027555),
        (VAZ, 8.4e-6, pin.Constant(), 237.120195),
        (VAZ, 8.4e-6, Free(drillable=True), 121.274203),
        (VAZ, 8.4e-6, pin.Stepped(3), 144.260239),
        (VAZ, LIMIT, Free(), 94.4769109),
        (WORST, 3.3001216212699878e-6, Free(), 693.881806),
    ],
)
def test_the_neighbours_at_a_looser_limit_are_not_lighter(scene, limit, form, rival):
    """Pins found at slightly looser limits, with a tangent for shear's concave end, kept these limits all the same."""
    outcome = pin.design(pin.PinProblem(scene, pin.Limits(max_deflection=limit), form), accuracy=1e-9)
    check, gap = outcome.value.check, outcome.certificate.gap
    assert 1e3 * check.mass <= rival * (1 + 1e-8)
    assert check.deflection == pytest.approx(limit, rel=1e-12)
    assert 0 <= gap < 2e-7


@pytest.mark.parametrize("monotone", [False, True])
@pytest.mark.parametrize("share", [0.0, 1e-9, 1e-4, 0.05, 0.5, 0.99])
def test_the_gap_is_what_it_says_from_the_solid_pin_to_no_limit(monotone, share):
    """Limits between the solid pin's deflection and the free pin's; the bound comes from tangents alone."""
    p = program(max_deflection=1.0)
    low = np.maximum.accumulate(p.lower) if monotone else p.lower
    solid, free = p.deflection(np.ones_like(low)), p.deflection(low)
    p = replace(p, limit=solid + share * (free - solid))
    found = minimum_volume(p, low, monotone)
    assert p.deflection(found.solidity) <= p.limit * (1 + 1e-12)
    bound = (monotone_bound if monotone else pointwise_bound)(p, low, found.multiplier, found.solidity)
    volume = p.volume(found.solidity)
    assert -1e-13 <= (volume - bound) / bound <= (1e-8 if monotone else 1e-5)
    if monotone:
        assert np.all(np.diff(found.solidity) >= 0)


def test_a_wrong_multiplier_makes_the_bound_loose_never_wrong():
    p = program(max_deflection=LIMIT)
    found = minimum_volume(p, p.lower, False)
    volume = p.volume(found.solidity)
    rng = np.random.default_rng(1)
    for factor in (0.0, 0.3, 0.9, 1.1, 3.0):
        anywhere = np.clip(found.solidity * rng.uniform(0.8, 1.2, p.lower.size), np.maximum(p.lower, 1e-6), 1.0)
        assert pointwise_bound(p, p.lower, factor * found.multiplier, anywhere) <= volume
        assert pointwise_bound(p, p.lower, factor * found.multiplier, found.solidity) <= volume


def test_a_limit_only_the_solid_pin_misses_has_no_answer():
    p = program(max_deflection=1.0)
    solid = p.deflection(np.ones_like(p.lower))
    assert minimum_volume(replace(p, limit=solid * (1 - 1e-9)), p.lower, False) is None
    exact = minimum_volume(replace(p, limit=solid), p.lower, False)
    assert math.isinf(exact.multiplier)
    assert p.deflection(exact.solidity) == pytest.approx(solid, rel=1e-14)


@pytest.mark.parametrize("form", [Free(), Free(drillable=True), pin.Constant(), pin.Stepped(2), pin.Cone()])
def test_every_form_uses_a_limit_next_to_the_solid_pin_up(form):
    """A design's deflection is that of its check, up to a limit that only the solid pin meets."""
    p = program(max_deflection=1.0)
    solid = p.deflection(np.ones_like(p.lower))
    for factor in (1 + 1e-9, 1.0007, 1.01):
        problem = pin.PinProblem(VAZ, pin.Limits(max_deflection=solid * factor), form)
        outcome = pin.design(problem)
        deflection = outcome.value.check.deflection
        assert solid * factor * (1 - 1e-6) <= deflection <= solid * factor * (1 + 1e-12)
        assert outcome.certificate.gap < 1e-5
    assert pin.design(pin.PinProblem(VAZ, pin.Limits(max_deflection=solid * (1 - 1e-9)), form)).value is None


def by_dynamic_programming(p, low, multiplier, levels):
    """The Lagrangian's least value over u that rise through these levels."""
    rest = np.zeros(levels.size)
    for i in range(low.size - 1, -1, -1):
        pulls = (np.full_like(levels, of[i]) for of in (p.bending, p.shear))
        pull = densities(levels, *pulls, p.law) / p.limit
        cost = p.weight[i] * (levels + multiplier * pull) + rest
        cost[levels < low[i] * (1 - 1e-12)] = np.inf
        rest = np.minimum.accumulate(cost[::-1])[::-1]
    return rest[0] - multiplier


@pytest.mark.parametrize(("scene", "limit"), [(VAZ, 8.4e-6), (VAZ, LIMIT), (WORST, 3.3001216212699878e-6)])
def test_the_bound_of_drillable_bores_is_the_lagrangians_least_value_or_less(scene, limit):
    """At prices around the answer's, against dynamic programming over 3,000 walls and every station's least one; the
    tangents at the answer are close at the answer's price."""
    p = program(scene, max_deflection=limit)
    low = np.maximum.accumulate(p.lower)
    found = minimum_volume(p, low, True)
    levels = np.unique(np.concatenate([np.linspace(0.0, 1.0, 3001), low]))
    for factor in (0.5, 0.95, 1.0, 1.05, 2.0):
        price = factor * found.multiplier
        bound = monotone_bound(p, low, price, found.solidity)
        least = by_dynamic_programming(p, low, price, levels)
        assert bound <= least + 1e-12
        assert factor != 1.0 or bound >= least * (1 - 3e-4)


@pytest.mark.parametrize("stations", [50, 500, 2000])
def test_the_two_tiers_agree_and_both_are_certified(stations):
    p = program(max_deflection=LIMIT, uniform=stations)
    for drillable in (False, True):
        low = np.maximum.accumulate(p.lower) if drillable else p.lower
        fast = Free(drillable).find(p, 1e-9)
        cone = slope_limited_optimum(p, low, drillable, 1e-9)
        for found in (fast, cone):
            assert p.deflection(found.solidity) <= LIMIT * (1 + 1e-12)
        assert 0 <= (fast.volume - fast.bound) / fast.bound <= (1e-7 if drillable else 1e-5 / stations)
        # The cone program's answer holds nowhere a jump to the solid section, which saves up to 2e-4.
        assert fast.bound <= cone.volume <= fast.volume * (1 + 2e-4)
        assert cone.bound <= fast.volume


@pytest.mark.parametrize("factor", [1e-3, 200 / 21.99])
def test_slope_limits_are_kept_and_certified_from_a_watch_to_a_ship(factor):
    scene = scaled(VAZ, factor)
    for drillable in (False, True):
        problem = pin.PinProblem(scene, pin.Limits(max_deflection=LIMIT * factor, max_slope=0.5), pin.Free(drillable))
        outcome = pin.design(problem, accuracy=1e-5)
        assert outcome.certificate.gap <= 1e-7
        along = outcome.value.check.along
        run = np.diff(along.x)
        assert np.all(np.abs(np.diff(along.bore)) <= 0.5 * run * (1 + 1e-6) + 1e-12 * factor)
        assert outcome.value.check.deflection <= LIMIT * factor * (1 + 1e-12)


def test_a_slope_limit_alone_needs_no_solver():
    p = program(max_slope=0.3)
    low = slope_limited(p, p.lower)
    D = GEOMETRY.outer_diameter
    bore, widest = D * np.sqrt(1 - low), D * np.sqrt(1 - p.lower)
    x = p.stations.x
    exact = np.min(widest[None, :] + 0.3 * np.abs(x[:, None] - x[None, :]), axis=1)
    assert bore == pytest.approx(exact, rel=1e-12)
    assert least_walls_bound(p, low) <= p.volume(low)


def test_loads_of_any_size_scale_out():
    for exponent in (-9, 9):
        scene = vaz(15e3 * 10.0**exponent, allowable_stress=150e6 * 10.0**exponent)
        limit = 6.785153977e-6 * 10.0**exponent
        assert grams(scene, effects=BENDING_ONLY, max_deflection=limit) == pytest.approx(86.5451142268, rel=1e-9)


def test_stiffer_asks_more():
    limits = [8.4e-6, 9e-6, 10e-6, 11e-6, 12e-6, 13e-6, 14e-6, 20e-6]
    masses = [grams(VAZ, max_deflection=limit) for limit in limits]
    assert np.all(np.diff(masses[:-1]) < 0)
    assert masses[-1] == pytest.approx(79.43309106, rel=1e-9)


def test_a_kink_anywhere_in_a_panel_is_not_overlooked():
    """The quadrature rules of the error estimate must not all be exact by chance where the governing constraint
    changes."""
    one = Stations(np.array([0.0, 1.0]))
    for place in np.linspace(0.0, 1.0, 2001):
        kink = np.abs(one.x - place)
        error = abs(one.weight @ kink - (place**2 + (1 - place) ** 2) / 2)
        assert error <= one.error_estimate(kink)[0] + 1e-15


@pytest.mark.parametrize("criterion", pin.CRITERIA)
def test_the_estimate_of_a_design_covers_its_error(criterion):
    for scene in (VAZ, vaz(18.5e3, allowable_shear=50e6)):
        for limits in ({}, {"min_wall": 1.7e-3}, {"max_deflection": 20e-6}, {"max_slope": 0.3}):
            for form in (Free(), Free(drillable=True)):
                exact = grams(scene, form, criterion, **limits)
                if exact is None:
                    continue
                problem = pin.PinProblem(scene, pin.Limits(**limits), form, pin.CRITERIA[criterion])
                for accuracy in (1e-2, 1e-4, 1e-6):
                    outcome = pin.design(problem, accuracy=accuracy)
                    error = abs(outcome.value.check.mass * 1e3 / exact - 1)
                    assert error <= outcome.accuracy.estimated + outcome.certificate.gap <= accuracy


@pytest.mark.parametrize("load", [1e-2, 1e-3, 1e-5])
def test_a_limit_that_asks_for_walls_far_above_the_least(load):
    """A lightly loaded pin: where the limit sets the wall, it may be thousands of times the least wall there."""
    p = program(vaz(15e3 * load), max_deflection=1.0)
    solid = p.deflection(np.ones_like(p.lower))
    for factor in (1.05, 2.0, 10.0, 20.0):
        soft = replace(p, limit=factor * solid)
        for monotone in (False, True):
            low = np.maximum.accumulate(p.lower) if monotone else p.lower
            found = minimum_volume(soft, low, monotone)
            bound = (monotone_bound if monotone else pointwise_bound)(soft, low, found.multiplier, found.solidity)
            assert 0 <= soft.volume(found.solidity) / bound - 1 <= 1e-8


@pytest.mark.parametrize("drillable", [False, True])
def test_a_slope_beside_a_deflection_leaves_next_to_no_gap(drillable):
    """Next to the solid pin the convex envelopes of single stations gave 6.6e-4 away."""
    problem = pin.PinProblem(VAZ, pin.Limits(max_deflection=8.4e-6, max_slope=0.5), pin.Free(drillable))
    outcome = pin.design(problem, accuracy=1e-5)
    assert 0.0 <= outcome.certificate.gap < 5e-6


@pytest.mark.parametrize(("accuracy", "warned"), [(1e-5, False), (1e-9, True)])
def test_a_gap_above_the_accuracy_is_told(accuracy, warned):
    problem = pin.PinProblem(VAZ, pin.Limits(max_deflection=8.4e-6, max_slope=0.5), pin.Free(drillable=True))
    outcome = pin.design(problem, accuracy=accuracy)
    assert 1e-7 < outcome.certificate.gap < 1e-6
    assert any("excluded only to" in warning for warning in outcome.value.check.warnings) == warned


@pytest.mark.parametrize("limit", [8.4e-6, 9e-6, 12e-6])
def test_no_gentle_bore_is_lighter_than_the_coupled_bound_at_any_multipliers(limit):
    p = program(tolerance=1e-4, max_deflection=limit, max_slope=0.3)
    rng = np.random.default_rng(5)
    low = slope_limited(p, p.lower)
    lightest = np.inf
    for _ in range(60):
        wave = np.interp(p.stations.x, np.linspace(0.0, 0.04, 6), rng.uniform(0.0, 1.0, 6))
        u = thickened(p, slope_limited(p, np.maximum(low, wave)))
        lightest = min(lightest, p.volume(u))
    n = low.size - 1
    for size in 10.0 ** rng.uniform(-4.0, 0.5, 60):
        rise, fall = size * rng.uniform(0.0, 1.0, (2, n)) * (rng.uniform(0.0, 1.0, (2, n)) < 0.5)
        between = NeighbourMultipliers(rise, fall, np.zeros(n))
        bound = coupled_bound(p, low, 10.0 ** rng.uniform(-3.0, 1.0), between, lightest)
        assert bound <= lightest


def test_slope_beside_deflection_on_many_stations() -> None:
    """A long pin whose slope limit governs most of its length: what the solver leaves unknown of every wall once made
    an estimate of 0.4 where 1e-3 is asked for."""
    geometry = pin.Geometry(0.14358821409389301, 0.20456153202351064, 0.0781479007277208, 0.03794185941988119)
    material = pin.PinMaterial(
        106.2495114123391e6, 63.95635111764845e9, 0.0393120194821722, 4565.529567114027, 225.024439353362e6
    )
    limits = pin.Limits(max_deflection=34.3120189696974e-6, max_slope=0.7692626461946924)
    problem = pin.PinProblem(pin.Scene(geometry, 138396.33095851226, material), limits, criterion=pin.CRITERIA["fibre"])
    found = pin.design(problem, accuracy=1e-3)
    assert found.accuracy.estimated <= 1e-2
    assert found.certificate.gap <= 1e-3
