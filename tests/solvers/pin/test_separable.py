"""The fast tier against brute force, the cone program, and its own certificate."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from solvers import pin
from solvers.pin.certificate import least_walls_bound, monotone_bound, pointwise_bound
from solvers.pin.flexibility import convex_cowper, cowper
from solvers.pin.interior_point import sloped
from solvers.pin.pointwise import Free
from solvers.pin.separable import rising, weigh
from solvers.pin.slope import gentle
from solvers.pin.stations import Stations
from tests.solvers.pin.pins import BENDING_ONLY, GEOMETRY, VAZ, grams, program, scaled, vaz

LIMIT = 11.22302193e-6


def test_the_reference_optimum_by_an_independent_dense_quadrature():
    """Bisection on the multiplier with a table search at 40,000 midpoints, from the textbook's formulas alone."""
    g, m = GEOMETRY, VAZ.material
    a, b, gap, D, P = g.boss_length, g.small_end_length, g.gap, g.outer_diameter, 15e3
    n = 40_000
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
    law = convex_cowper(0.3)

    def flexibility(u):
        c = np.minimum(u, law.knee)
        value = law.a / c + law.b * (1 - c) / (c * (2 - c) ** 2)
        k = law.knee
        slope = -(law.a + law.b / 4) / k**2 + law.b / 4 / (2 - k) ** 2 - law.b / (2 - k) ** 3
        return bend / (u * (2 - u)) + cut * (value + slope * (u - c))

    def best(price):
        lo, hi = least.copy(), np.ones(n)
        for _ in range(52):  # golden section on a convex function
            p, q = hi - 0.618034 * (hi - lo), lo + 0.618034 * (hi - lo)
            left = p + price * flexibility(p) < q + price * flexibility(q)
            lo, hi = np.where(left, lo, p), np.where(left, q, hi)
        return np.where(inside, (lo + hi) / 2, least)

    down, up = 0.0, 1e6
    for _ in range(46):
        price = (down + up) / 2
        soft = 2 * flexibility(best(price))[inside].sum() * 0.04 / n > LIMIT
        down, up = (price, up) if soft else (down, price)
    mass = 7850 * g.area * g.length * best(up).mean() * 1e3
    assert grams(VAZ, max_deflection=LIMIT) == pytest.approx(mass, rel=1e-8)
    assert mass == pytest.approx(94.4897865, rel=3e-9)


@pytest.mark.parametrize("monotone", [False, True])
@pytest.mark.parametrize("share", [0.0, 1e-9, 1e-4, 0.05, 0.5, 0.99])
def test_the_gap_is_what_it_says_from_the_solid_pin_to_no_limit(monotone, share):
    """Limits between the solid pin's deflection and the free pin's; the bound comes from tangents alone."""
    p = program(max_deflection=1.0)
    low = rising(p.lower, p.anchor) if monotone else p.lower
    solid, free = p.deflection(np.ones_like(low)), p.deflection(low)
    p = replace(p, limit=solid + share * (free - solid))
    found = weigh(p, low, monotone)
    assert p.deflection(found.solidity) <= p.limit * (1 + 1e-12)
    bound = (monotone_bound if monotone else pointwise_bound)(p, low, found.multiplier, found.solidity)
    volume = p.volume(found.solidity)
    assert -1e-13 <= (volume - bound) / bound <= 1e-9
    if monotone:
        assert np.all(np.diff(found.solidity) >= 0)


def test_a_wrong_multiplier_makes_the_bound_loose_never_wrong():
    p = program(max_deflection=LIMIT)
    found = weigh(p, p.lower, False)
    volume = p.volume(found.solidity)
    rng = np.random.default_rng(1)
    for factor in (0.0, 0.3, 0.9, 1.1, 3.0):
        anywhere = np.clip(found.solidity * rng.uniform(0.8, 1.2, p.lower.size), np.maximum(p.lower, 1e-6), 1.0)
        assert pointwise_bound(p, p.lower, factor * found.multiplier, anywhere) <= volume
        assert pointwise_bound(p, p.lower, factor * found.multiplier, found.solidity) <= volume


def test_a_limit_only_the_solid_pin_misses_has_no_answer():
    p = program(max_deflection=1.0)
    solid = p.deflection(np.ones_like(p.lower))
    assert weigh(replace(p, limit=solid * (1 - 1e-9)), p.lower, False) is None
    exact = weigh(replace(p, limit=solid), p.lower, False)
    assert math.isinf(exact.multiplier)
    assert p.deflection(exact.solidity) == pytest.approx(solid, rel=1e-14)


def test_between_the_two_laws_of_shear_the_exact_one_answers():
    """The solid pin deflects by 0.14 % less than its convex law says: a limit between is kept all the same."""
    p = program(max_deflection=1.0)
    exact = replace(p, law=cowper(0.3)).deflection(np.ones_like(p.lower))
    convex = p.deflection(np.ones_like(p.lower))
    assert exact < convex
    for limit in (exact, exact * (1 + 1e-9), 0.5 * (exact + convex)):
        outcome = pin.design(pin.PinProblem(VAZ, pin.Limits(max_deflection=limit)))
        assert outcome.value.check.deflection <= limit * (1 + 1e-12)
        assert outcome.certificate.gap < 1e-7
    assert pin.design(pin.PinProblem(VAZ, pin.Limits(max_deflection=exact * (1 - 1e-9)))).value is None


def test_the_exact_law_would_save_a_ten_thousandth_by_jumping_to_solid():
    convex = weigh(program(max_deflection=LIMIT), None, False)
    p = replace(program(max_deflection=LIMIT, uniform=2000), law=cowper(0.3))
    jumping = weigh(p, None, False)
    bound = pointwise_bound(p, p.lower, jumping.multiplier, jumping.solidity)
    volume = p.volume(jumping.solidity)
    assert (volume - bound) / bound < 1e-6
    saved = 1 - volume / program(max_deflection=LIMIT).volume(convex.solidity)
    assert 1e-4 < saved < 2e-4


@pytest.mark.parametrize("stations", [50, 500, 2000])
def test_the_two_tiers_agree_and_both_are_certified(stations):
    p = program(max_deflection=LIMIT, uniform=stations)
    for drillable in (False, True):
        low = rising(p.lower, p.anchor) if drillable else p.lower
        fast = Free(drillable).find(p, 1e-9)
        cone = sloped(p, low, drillable, 1e-9)
        for found in (fast, cone):
            assert 0 <= (found.volume - found.bound) / found.bound <= 1e-7
            assert p.deflection(found.solidity) <= LIMIT * (1 + 1e-12)
        assert cone.volume == pytest.approx(fast.volume, rel=1e-7)


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
    low = gentle(p, p.lower)
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
    """Rules that judge quadrature must not all be exact by chance where one demand takes over from another."""
    one = Stations(np.array([0.0]), np.array([1.0]))
    for place in np.linspace(0.0, 1.0, 2001):
        kink = np.abs(one.x - place)
        error = abs(one.share @ kink - (place**2 + (1 - place) ** 2) / 2)
        assert error <= one.doubt(kink)[0] + 1e-15


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
            low = rising(p.lower, p.anchor) if monotone else p.lower
            found = weigh(soft, low, monotone)
            bound = (monotone_bound if monotone else pointwise_bound)(soft, low, found.multiplier, found.solidity)
            assert 0 <= soft.volume(found.solidity) / bound - 1 <= 1e-9
