"""Verdicts on pins and bushings; the limit on the ring's hoop stress in checks and designs."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from solvers import pin
from solvers.errors import EffectConflict
from solvers.outcome import Status
from solvers.pin.ring import ovalization
from solvers.pin.verdict import steepest
from tests.solvers.pin.pins import VAZ, vaz

FORMS = [pin.Free(), pin.Free(drillable=True), pin.Constant(), pin.Stepped(3), pin.Cone(), pin.Cone(cylinder=True)]
PIN = (15e3, 21.99e-3, 80e-3, 210e9, 0.3)


def designed(form, accuracy=1e-6, scene=VAZ, **limits):
    kept = pin.Limits(**limits)
    outcome = pin.design(pin.PinProblem(scene, kept, form), accuracy=accuracy)
    return pin.judge(outcome.value.check, scene, outcome.accuracy, kept), outcome.value.check


def checked(*bores, scene=VAZ, effects=pin.AUTO, **limits):
    kept, g = pin.Limits(**limits), scene.geometry
    profile = pin.Profile(tuple(np.linspace(0.0, 0.5 * g.length, len(bores))) if len(bores) > 1 else (0.0,), bores)
    outcome = pin.check(scene, profile, limits=kept, effects=effects)
    return pin.judge(outcome.value, scene, outcome.accuracy, kept)


def of(verdict, name):
    return next(criterion for criterion in verdict.criteria if criterion.name == name)


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
def test_the_rings_stress_is_judged_by_the_allowable_where_nothing_limits_it(form):
    """With walls of 2 mm, all forms except the constant bore have ring stresses of 338 MPa, where 150 are allowable."""
    verdict, _ = designed(form, min_wall=2e-3)
    found = of(verdict, "ring_stress")
    assert (found.required, found.asked) == (150e6, False)
    constant = form == pin.Constant()
    assert found.reached == pytest.approx(123.7e6 if constant else 337.9e6, rel=1e-3)
    assert verdict.holds is constant


@pytest.mark.parametrize("accuracy", [1e-1, 1e-3, 1e-6])
@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
def test_a_design_keeps_its_limits_and_holds(form, accuracy):
    verdict, check = designed(form, accuracy, max_ring_stress=150e6, max_deflection=12e-6, min_wall=2e-3)
    assert verdict.holds
    assert check.ring.stress_max <= 150e6 * (1.0 + 1e-9)
    assert verdict.governing.margin < 1e-3


def test_a_hardened_pin_may_be_stressed_more_as_a_ring():
    free, limited = (designed(pin.Free(), max_ring_stress=limit, min_wall=1e-3) for limit in (350e6, 150e6))
    assert free[0].holds and free[1].mass < limited[1].mass
    assert of(free[0], "max_ring_stress").asked


def test_a_free_pin_without_a_least_wall_has_none_at_its_ends():
    verdict, _ = designed(pin.Free())
    assert not of(verdict, "min_wall").holds
    assert of(verdict, "ring_stress").reached == math.inf
    assert not verdict.holds and verdict.governing.name == "min_wall"


@pytest.mark.parametrize("bore", [0.0, 2e-3, 6e-3])
def test_a_small_bore_is_no_ring_that_would_break(bore):
    """The formula's inner fibre has 1/alpha there; the elastic ring's stress stays below that of d/D = 0.3."""
    verdict = checked(bore)
    assert verdict.holds
    reached = of(verdict, "ring_stress").reached
    assert reached == pytest.approx(53.18e6, rel=1e-3)
    if bore:
        assert ovalization.thick_ring(*PIN[:3], bore / PIN[1], *PIN[3:]).greatest < reached


def test_every_limit_is_judged():
    limits = {
        "min_wall": 3e-3, "max_deflection": 1e-6, "max_ovalization": 1e-6, "max_slope": 0.01, "max_ring_stress": 40e6,
    }  # fmt: skip
    verdict = checked(17e-3, 14e-3, **limits)
    assert {c.name: c.required for c in verdict.criteria if c.asked} == limits
    assert not any(c.holds for c in verdict.criteria if c.asked)
    assert of(verdict, "max_slope").reached == pytest.approx(3.0 / 40.0)
    loose = checked(13.9e-3, **{name: 1e9 for name in limits if name != "min_wall"})
    assert loose.holds and sum(c.asked for c in loose.criteria) == 4


def test_rounding_between_close_stations_is_no_slope():
    """Where stations are 1e-8 of the length apart, the last digit of a bore was 2e-7 of the slope too much."""
    x, outer = np.array([0.0, 0.02, 0.02 + 3e-10, 0.02 + 6e-10, 0.04]), np.full(5, 0.03)
    bore = 0.025 - 0.03 * x
    for steps in (-2, -1, 0, 1, 2):
        bore[2] = 0.025 - 0.03 * x[2] + steps * np.spacing(0.025)
        assert steepest(x, bore, outer) == pytest.approx(0.03, rel=1e-12)
    assert steepest(x, 0.025 - 0.04 * x, outer) == pytest.approx(0.04, rel=1e-12)
    assert steepest(x, np.full(5, 0.01), 0.025 + 0.05 * x) == pytest.approx(0.05, rel=1e-12)


def test_a_bore_that_nearly_closes_keeps_its_slope():
    """There the measure of material does not keep all digits of the bore; the slope was exceeded by up to 2e-7."""
    geometry = pin.Geometry(39.662031658477524e-3, 10.228086279599069e-3, 12.136244337510687e-3, 4.1674120940398976e-5)
    scene = pin.Scene(geometry, 153651.04204457926, pin.PinMaterial(150e6, 210e9, 0.49, 7850.0))
    limits = pin.Limits(0.06667666e-3, 3.353323748835416e-6, max_slope=0.035775460180487516)
    problem = pin.PinProblem(scene, limits, pin.Free(), pin.CRITERIA["von_mises"])
    for accuracy in (1e-8, 1e-9):
        outcome = pin.design(problem, accuracy=accuracy)
        assert outcome.value.check.min_bore < 1e-5
        assert of(pin.judge(outcome.value.check, scene, outcome.accuracy, limits), "max_slope").holds


def test_a_step_has_no_slope_that_a_limit_allows():
    outcome = pin.check(VAZ, pin.Profile((0.0, 20e-3, 20e-3, 40e-3), (14e-3, 14e-3, 13e-3, 13e-3)))
    verdict = pin.judge(outcome.value, VAZ, outcome.accuracy, pin.Limits(max_slope=5.0))
    assert of(verdict, "max_slope").reached == math.inf and not verdict.holds


def test_a_shear_allowable_is_a_criterion_of_its_own():
    verdict = checked(13.9e-3, scene=vaz(allowable_shear=20e6))
    assert of(verdict, "equivalent_stress").holds and not of(verdict, "shear_stress").holds
    assert not verdict.holds


def test_what_was_left_out_is_a_caution_and_a_limit_keeps_it_in():
    without = pin.EffectSelection(exclude=frozenset({"ovalization"}))
    verdict = checked(13.9e-3, effects=without)
    assert not any(c.name == "ring_stress" for c in verdict.criteria)
    assert any("hoop stress is not judged" in text for text in verdict.cautions)
    with pytest.raises(EffectConflict):
        checked(13.9e-3, effects=without, max_ring_stress=1e9)


def test_an_unloaded_pin_holds_as_long_as_it_has_a_wall():
    assert checked(21e-3, scene=vaz(0.0)).holds
    assert not checked(21.99e-3, scene=vaz(0.0)).holds


def test_a_limit_below_any_rings_stress_is_out_of_reach_and_the_diameter_is_named():
    problem = pin.PinProblem(VAZ, pin.Limits(max_ring_stress=50e6))
    outcome = pin.design(problem)
    assert outcome.status is Status.INFEASIBLE
    (short,) = outcome.diagnosis
    assert (short.requirement, short.required) == ("max_ring_stress", 50e6)
    wide = pin.explain(problem).least_outer_diameter
    for factor, status in ((1 - 1e-6, Status.INFEASIBLE), (1 + 1e-6, Status.SUCCEEDED)):
        scene = replace(VAZ, geometry=replace(VAZ.geometry, outer_diameter=wide * factor))
        assert pin.design(replace(problem, scene=scene)).status is status


@pytest.mark.parametrize("limit", [60e6, 150e6, 400e6, 2e9])
def test_the_ring_at_its_limit(limit):
    ratio = ovalization.ratio_within_stress(limit, *PIN)
    assert ovalization.greatest_stress(*PIN[:3], ratio, *PIN[3:]) <= limit
    assert ovalization.greatest_stress(*PIN[:3], ratio * (1 + 1e-9), *PIN[3:]) > limit
    for bore in (0.0, 2e-3, 14e-3, 30e-3):
        outer = ovalization.outer_within_stress(limit, PIN[0], bore, *PIN[2:])

        def stress(outer: float, bore: float = bore) -> float:
            return ovalization.greatest_stress(PIN[0], outer, PIN[2], bore / outer, *PIN[3:])

        assert stress(outer) == pytest.approx(limit, rel=1e-9)
        assert stress(1.01 * outer) < limit


@pytest.mark.parametrize("form", [pin.Free(), pin.Constant(), pin.Stepped(2)], ids=lambda form: form.name)
@pytest.mark.parametrize("bore", [0.0, 14e-3])
def test_a_bushings_design_keeps_its_limits_and_holds(form, bore):
    scene = pin.Scene(pin.BushingGeometry(bore, 24e-3, 30e-3, 1e-3), 15e3, VAZ.material)
    limits = pin.Limits(max_ring_stress=100e6, max_deflection=12e-6)
    outcome = pin.design(pin.PinProblem(scene, limits, form))
    verdict = pin.judge(outcome.value.check, scene, outcome.accuracy, limits)
    assert verdict.holds
    assert of(verdict, "max_ring_stress").reached <= 100e6 * (1 + 1e-9)
    free = pin.design(pin.PinProblem(scene, pin.Limits(), form))
    plain = pin.judge(free.value.check, scene, free.accuracy, pin.Limits())
    if form == pin.Free():
        # It ends in an edge, around a bore as without one.
        assert not plain.holds and not of(plain, "min_wall").holds


def test_shear_left_out_of_a_limited_deflection_is_a_caution():
    without = pin.EffectSelection(exclude=frozenset({"shear_deflection"}))
    outcome = pin.check(VAZ, pin.Profile((0.0,), (13.9e-3,)), effects=without)
    for limit, cautions in ((1.0, 1), (None, 0)):
        verdict = pin.judge(outcome.value, VAZ, outcome.accuracy, pin.Limits(max_deflection=limit), outcome.effects)
        assert sum("shear_deflection is left out" in text for text in verdict.cautions) == cautions
