"""Checks of a given bore, further load cases, and the diagnosis of an infeasible pin."""

from __future__ import annotations

import math
import re
import tracemalloc
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from solvers import pin
from solvers.errors import InvalidInput
from solvers.pin.stations.lobatto_panels import initial_stations
from tests.solvers.pin.pins import GEOMETRY, PAPER, STEEL, VAZ, grams, macaulay_terms, vaz

D, LENGTH = GEOMETRY.outer_diameter, GEOMETRY.length


def deflection_by_brute_force(bore_of, n=400_000, shear=True):
    """int M m/(E I) + Q q/(k G A) over midpoints of the span, from the textbook's pieces."""
    g, m, P = GEOMETRY, STEEL, 15e3
    x = g.boss_length + (np.arange(n) + 0.5) / n * (LENGTH - 2 * g.boss_length)
    y = np.minimum(x, LENGTH - x)
    t = np.maximum(y - g.boss_length - g.gap, 0.0)
    moment = P * g.boss_length / 6 + P / 2 * (y - g.boss_length) - P * t**2 / (2 * g.small_end_length)
    force = P / 2 - P * t / g.small_end_length
    d = bore_of(x)
    inertia, area, r2 = math.pi * (D**4 - d**4) / 64, math.pi * (D**2 - d**2) / 4, (d / D) ** 2
    k = 6 * 1.3 * (1 + r2) ** 2 / ((7 + 1.8) * (1 + r2) ** 2 + (20 + 3.6) * r2)
    density = moment * (y - g.boss_length) / 2 / (m.elastic_modulus * inertia)
    density = density + (force / 2 / (k * m.shear_modulus * area) if shear else 0)
    return float(density.mean() * (LENGTH - 2 * g.boss_length))


@pytest.mark.parametrize(
    ("x", "bore"),
    [
        ((0.0,), (13.99e-3,)),
        ((0.0, 40e-3), (20e-3, 8e-3)),
        ((10e-3, 30e-3, 30e-3), (16e-3, 16e-3, 12e-3)),
        ((0.0, 33e-3, 33e-3, 80e-3), (16e-3, 15e-3, 12e-3, 14e-3)),
        ((0.0, 80e-3), (18e-3, 10e-3)),
    ],
    ids=["one bore", "double cone", "steps", "unlike halves", "one taper"],
)
def test_given_bores_deflect_and_weigh_what_they_must(x, bore):
    value = pin.check(VAZ, pin.Profile(x, bore), accuracy=1e-9).value

    def bore_of(place):
        px, pd = list(x), list(bore)
        if px[-1] <= LENGTH / 2:
            px, pd = px + [LENGTH - p for p in reversed(px)], pd + pd[::-1]
        px = np.array(px) + 1e-12 * np.arange(len(px))
        return np.interp(place, px, pd)

    assert value.deflection == pytest.approx(deflection_by_brute_force(bore_of), rel=2e-6)
    places = (np.arange(400_000) + 0.5) / 400_000 * LENGTH
    mass = STEEL.density * math.pi / 4 * LENGTH * float((D**2 - bore_of(places) ** 2).mean())
    assert value.mass == pytest.approx(mass, rel=1e-6)


def test_a_bore_that_is_too_wide_is_told_where():
    value = pin.check(
        VAZ, pin.Profile((0.0,), (17e-3,)), limits=pin.Limits(min_wall=3e-3, max_deflection=1e-5, max_ovalization=1e-5)
    ).value
    assert value.strength_utilisation > 1
    said = " ".join(value.warnings)
    for words in ("the strength is exceeded", "at its thinnest", "deflection", "ovalization"):
        assert words in said
    wider = pin.check(VAZ, pin.Profile((0.0,), (20e-3,))).value
    assert f"by {100 * (wider.strength_utilisation - 1):.0f} %" in wider.warnings[0]
    fine = pin.check(VAZ, pin.Profile((0.0,), (13.9e-3,))).value
    assert fine.strength_utilisation < 1
    assert fine.warnings == ()


def test_a_wall_that_runs_out_has_no_stress_and_no_failure():
    value = pin.check(VAZ, pin.Profile((0.0,), (D,))).value
    assert value.mass == 0.0
    assert value.deflection is None
    assert value.equivalent_stress_max is None
    assert any("no wall" in warning for warning in value.warnings)


@pytest.mark.parametrize(
    ("x", "bore", "field"),
    [
        ((), (), "profile"), ((0.0, 1e-3), (1e-2,), "profile"), ((2e-3, 1e-3), (1e-2, 1e-2), "profile.1.x"),
        ((-1e-3,), (1e-2,), "profile.0.x"), ((0.0,), (-1e-2,), "profile.0.bore"),
        ((0.0,), (math.nan,), "profile.0.bore"),
        ((0.0,), (23e-3,), "profile.0.bore"), ((0.0, 1.0), (1e-2, 1e-2), "profile.1.x"),
    ],
)  # fmt: skip
def test_bores_that_make_no_sense_are_refused(x, bore, field):
    with pytest.raises(InvalidInput) as refusal:
        pin.check(VAZ, pin.Profile(x, bore))
    assert refusal.value.field == field


def test_a_second_plane_and_a_torque_ask_for_more_where_they_act():
    """The same load turned by 90 degrees requires nothing more; a torque requires more everywhere."""
    turned = pin.LoadCase(tuple(pin.MacaulayTerm(*term, plane=1) for term in macaulay_terms(VAZ)))
    alike = pin.Scene(GEOMETRY, 15e3, STEEL, (turned,))
    assert grams(alike, accuracy=1e-8) == pytest.approx(grams(VAZ, accuracy=1e-8), rel=1e-8)
    twisted = pin.Scene(GEOMETRY, 15e3, STEEL, (pin.LoadCase((), axial_force=2e3, torque=60.0),))
    outcome = pin.design(pin.PinProblem(twisted), accuracy=1e-6)
    assert outcome.value.check.mass * 1e3 > grams(VAZ)
    assert outcome.value.check.min_bore > 0
    # A thin tube at the ends, where only the torque acts: sqrt(sigma^2 + 4 tau^2) is just allowed.
    d = outcome.value.check.along.bore[0]
    sigma = 2e3 / (math.pi / 4 * (D**2 - d**2))
    tau = 16 * 60.0 * D / (math.pi * (D**4 - d**4))
    assert math.hypot(sigma, 2 * tau) == pytest.approx(150e6, rel=1e-9)


def test_a_load_on_one_side_counts_with_its_mirror_image():
    """A pin may be fitted either way round."""
    extra = pin.LoadCase(
        (pin.MacaulayTerm(6e3, 5e-3, 0), pin.MacaulayTerm(-8e3, 20e-3, 0), pin.MacaulayTerm(2e3, 65e-3, 0))
    )
    scene = pin.Scene(GEOMETRY, 5e3, STEEL, (extra,))
    for form in (pin.Free(), pin.Free(drillable=True), pin.Constant(), pin.Stepped(2), pin.Cone()):
        outcome = pin.design(pin.PinProblem(scene, form=form), accuracy=1e-4)
        value = outcome.value.check
        assert value.strength_utilisation <= 1 + 1e-9, form.name
        assert value.along.x[-1] == pytest.approx(LENGTH)
        assert outcome.certificate.bound <= value.mass * (1 + 1e-12)
    free = pin.design(pin.PinProblem(scene), accuracy=1e-6).value.check
    assert np.allclose(free.along.bore, free.along.bore[::-1], rtol=1e-12)
    other = pin.MacaulayTerm(2e3, 15e-3, 0), pin.MacaulayTerm(-8e3, 60e-3, 0), pin.MacaulayTerm(6e3, 75e-3, 0)
    turned = pin.design(pin.PinProblem(replace(scene, further_cases=(pin.LoadCase(other),))), accuracy=1e-6).value.check
    assert turned.mass == pytest.approx(free.mass, rel=2e-6)


def test_the_worst_section_of_a_further_case_lies_between_stations():
    """A load that grows in proportion to x between two supports: M = A (x - x^3/L^2)."""
    whole = 4e3
    case = pin.LoadCase((pin.MacaulayTerm(whole, 0.0, 0), pin.MacaulayTerm(-3 * whole / LENGTH**2, 0.0, 2)))
    scene = pin.Scene(GEOMETRY, 1e3, STEEL, (case,))
    x = np.linspace(0.0, 1.0, 400_001) * LENGTH
    moment, shear = whole * (x - x**3 / LENGTH**2), np.abs(whole * (1 - 3 * x**2 / LENGTH**2))

    def used(d):
        bending = 32 * moment * D / (math.pi * (D**4 - d**4))
        force = 16 * shear * (D**2 + D * d + d**2) / (3 * math.pi * (D**4 - d**4))
        return float(np.hypot(bending, 2 * force).max()) / 150e6

    assert pin.force_limit(scene, PAPER) == pytest.approx(1e3 / used(0.0), rel=1e-11)
    outcome = pin.design(pin.PinProblem(scene, form=pin.Constant()), accuracy=1e-6)
    ((_, bore), _) = outcome.value.corners
    checked = pin.check(scene, pin.Profile((0.0,), (bore,)), accuracy=1e-6)
    assert used(bore) == pytest.approx(1.0, abs=5e-7)
    assert checked.value.constant_mass == pytest.approx(outcome.value.check.mass, rel=1e-6)
    assert checked.value.strength_utilisation >= used(bore) * (1 - checked.accuracy.estimated - 1e-9)


def test_no_edge_is_lost():
    places = (1e-3, LENGTH - 1e-3, 3e-3, LENGTH - (LENGTH - 3e-3), 0.07, 0.04)
    for scene in (VAZ, replace(VAZ, symmetric=False)):
        edges = initial_stations(scene, places).edges
        for place in (GEOMETRY.boss_length, *places):
            near = min(place, LENGTH - place) if scene.symmetric else place
            assert np.abs(edges - near).min() <= 1e-13 * LENGTH
        assert np.diff(edges).min() > 1e-13 * LENGTH


def test_forces_end_where_they_must():
    at = np.array([LENGTH, 0.5 * LENGTH])
    ends = VAZ.own_forces(at, at)
    assert ends[1].max() <= 1e-10 * 15e3
    assert ends[0, 0] <= 1e-12 * 123.75


def test_the_diagnosis_names_every_requirement_and_a_diameter_that_does():
    limits = pin.Limits(max_deflection=2e-6, max_ovalization=1e-7)
    outcome = pin.design(pin.PinProblem(vaz(20e3), limits))
    assert outcome.value is None
    assert [s.requirement for s in outcome.diagnosis] == ["force", "max_deflection", "max_ovalization"]
    # No diameter makes the solid pin's ring stiffer.
    assert pin.explain(pin.PinProblem(vaz(20e3), limits)).least_outer_diameter == 0.0
    why = pin.explain(pin.PinProblem(vaz(20e3), pin.Limits(max_deflection=2e-6)))
    assert why.weak.begin < 0.5 * LENGTH < why.weak.end
    assert why.force_limit == pytest.approx(18980.73, abs=0.01)
    for factor, feasible in ((1 + 1e-9, True), (1 - 1e-9, False)):
        geometry = pin.Geometry(why.least_outer_diameter * factor, 24e-3, 30e-3, 1e-3)
        wider = pin.Scene(geometry, 20e3, STEEL)
        problem = pin.PinProblem(wider, pin.Limits(max_deflection=2e-6))
        assert (pin.design(problem).value is not None) == feasible


def solid_pin():
    return pin.Profile((0.0,), (0.0,))


def beyond_the_solid_pin(name, excess):
    """A problem whose limit of this name, or force, exceeds what the solid pin reaches by a relative excess."""
    hard = {"force": 20e3}.get(name, 10e3)
    limits = {} if name == "force" else {name: 1e-9}
    (short,) = pin.design(pin.PinProblem(vaz(hard), pin.Limits(**limits))).diagnosis
    assert short.requirement == name
    if name == "force":
        return vaz(short.attainable * (1.0 + excess)), pin.Limits()
    return vaz(hard), pin.Limits(**{name: short.attainable / (1.0 + excess)})


FORMS = [pin.Free(), pin.Free(drillable=True), pin.Constant(), pin.Stepped(2), pin.Cone(), pin.Cone(cylinder=True)]
BEYOND = ["force", "max_deflection", "max_ovalization", "max_ring_stress"]


@pytest.mark.parametrize("name", BEYOND)
@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
def test_what_the_diagnosis_calls_attainable_is_attained(name, form):
    for excess in (-1e-12, 0.0, 1e-15, 1e-14, 1e-13):
        outcome = pin.design(pin.PinProblem(*beyond_the_solid_pin(name, excess), form), accuracy=1e-12)
        assert outcome.value is not None
        assert outcome.value.check.strength_utilisation <= 1.0 + 1e-12


def test_steps_attain_the_deflection_of_a_solid_pin_with_long_bosses():
    """A thin wall over a billionth of the boss next to its short span once added 1.7e-6 to the deflection."""
    scene = replace(VAZ, geometry=pin.Geometry(21.99e-3, 53.7e-3, 3.47e-3, 0.5e-3), force=481.0)
    limit = pin.check(scene, solid_pin()).value.deflection
    outcome = pin.design(pin.PinProblem(scene, pin.Limits(max_deflection=limit), pin.Stepped(2)), accuracy=1e-9)
    assert outcome.value.check.deflection <= limit * (1.0 + 1e-12)
    assert 0.0 <= outcome.certificate.gap <= 1e-7


@pytest.mark.parametrize("boss_length", [8e-3, 24e-3, 31e-3])
def test_cones_within_the_bosses_attain_the_deflection_of_a_solid_pin(boss_length):
    """Only bores within the bosses leave the deflection as it is, so that rounding decides whether there are any."""
    scene = replace(vaz(15e3), geometry=replace(GEOMETRY, boss_length=boss_length))
    limits = pin.Limits(
        min_wall=3e-3, max_ring_stress=300e6, max_deflection=pin.check(scene, solid_pin()).value.deflection
    )
    length, bore = scene.geometry.length, scene.geometry.outer_diameter - 2 * limits.min_wall
    rival = pin.check(scene, pin.Profile((0.0, boss_length, length - boss_length, length), (bore, 0.0, 0.0, bore)))
    assert rival.value.strength_utilisation <= 1.0
    outcome = pin.design(pin.PinProblem(scene, limits, pin.Cone(cylinder=True)))
    assert outcome.value.check.deflection <= limits.max_deflection * (1.0 + 1e-12)
    assert outcome.value.check.mass <= rival.value.mass
    assert 0.0 <= outcome.certificate.gap <= 1e-6


@pytest.mark.parametrize("name", BEYOND)
def test_an_infeasible_pin_never_lacks_a_diagnosis(name):
    for excess in np.geomspace(1e-13, 1e-11, 41):
        outcome = pin.design(pin.PinProblem(*beyond_the_solid_pin(name, excess)))
        assert outcome.value is not None or [short.requirement for short in outcome.diagnosis] == [name]
    assert outcome.value is None


@pytest.mark.parametrize("more", [1e-8, 1e-6, 1e-4])
@pytest.mark.parametrize("form", [pin.Free(), pin.Constant(), pin.Stepped(2), pin.Cone()], ids=lambda form: form.name)
def test_a_short_pin_of_the_least_diameter_can_be_designed(form, more):
    # Shear governs its deflection, so that the lightest uniform wall jumps to nearly solid.
    material = pin.PinMaterial(220e6, 137.4e9, 0.2228, 3268.0)
    scene = pin.Scene(pin.Geometry(25.4e-3, 24.32e-3, 28.14e-3), 4960.0, material)
    problem = pin.PinProblem(scene, pin.Limits(max_deflection=1.912e-6), form)
    least = pin.explain(problem).least_outer_diameter
    wider = replace(scene, geometry=replace(scene.geometry, outer_diameter=least * (1 + more)))
    found = pin.design(replace(problem, scene=wider)).value.check
    assert found.deflection <= 1.912e-6 * (1 + 1e-9)
    assert found.mass <= found.constant_mass * (1 + 1e-9) <= found.solid_mass * (1 + 1e-9)


@pytest.mark.parametrize("growth", [1.02, 1.05, 1.1])
def test_a_nearly_solid_pin_is_proven_lightest(growth):
    solid = pin.check(VAZ, solid_pin()).value.ring.ovalization
    outcome = pin.design(
        pin.PinProblem(pin.Scene(GEOMETRY, 5e3, STEEL), pin.Limits(max_ovalization=solid * growth / 3))
    )
    assert outcome.value.check.mass < outcome.value.check.solid_mass
    assert outcome.certificate.gap <= 1e-9


def test_the_load_sweep_of_figure_5():
    """More load, less bore, at every place; each member is the free profile of its load."""
    forces = [5e3, 10e3, 15e3, 17.5e3, 18.9e3]
    x = np.unique([*np.linspace(0.0, 0.5 * LENGTH, 121), 24e-3, 25e-3])
    sweep = [pin.free_sizes(VAZ, PAPER, force, x) for force in forces]
    for lighter, heavier in pairwise(sweep):
        assert np.all(heavier[1:] < lighter[1:])
    for force, diameter in zip(forces, sweep, strict=True):
        mass = STEEL.density * GEOMETRY.area * 2 * np.trapezoid(1 - (diameter / D) ** 2, x)
        assert mass * 1e3 == pytest.approx(grams(vaz(force)), rel=1e-3)
    assert np.isnan(pin.free_sizes(VAZ, PAPER, 20e3, x)[-1])


def test_a_table_of_many_bores_needs_memory_for_its_points_only():
    """Not for every pair of a point and a station, which took gigabytes and seconds."""
    x = np.linspace(0.0, LENGTH, 4001)
    value = pin.check(VAZ, pin.Profile(tuple(x), tuple(13e-3 + 1e-3 * np.sin(300.0 * x)))).value
    tracemalloc.start()
    along = value.along
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert np.isin(x, along.x).sum() > 0.99 * x.size
    assert peak < 20e6


@pytest.mark.parametrize(
    ("x", "bore"),
    [
        ((0.0,), (17e-3,)),
        ((0.0, 40e-3), (19e-3, 11e-3)),
        ((0.0, 80e-3), (18e-3, 10e-3)),
        ((0.0, 40e-3), (14e-3, 16e-3)),
    ],
    ids=["one bore", "double cone", "one taper", "double cone, wide in the middle"],
)
def test_the_places_where_the_strength_is_exceeded_are_those_of_the_whole_pin(x, bore):
    """By the textbook's stresses at many places."""
    check = pin.check(VAZ, pin.Profile(x, bore))
    warning = next(w for w in check.value.warnings if w.startswith("the strength"))
    g, P, place = GEOMETRY, 15e3, np.linspace(0.0, LENGTH, 400_001)[1:-1]
    y = np.minimum(place, LENGTH - place)
    t, in_boss = np.maximum(y - g.boss_length - g.gap, 0.0), y < g.boss_length
    force = np.where(in_boss, P * y**2 / (2 * g.boss_length**2), P / 2 - P * t / g.small_end_length)
    beside = P * g.boss_length / 6 + P / 2 * (y - g.boss_length) - P * t**2 / (2 * g.small_end_length)
    moment = np.where(in_boss, P * y**3 / (6 * g.boss_length**2), beside)
    d = np.interp(place if x[-1] > 41e-3 else y, x, bore)
    bending = 32 * D * moment / (math.pi * (D**4 - d**4))
    shear = 16 * force * (D**2 + D * d + d**2) / (3 * math.pi * (D**4 - d**4))
    over = np.hypot(bending, 2 * shear) > STEEL.allowable_stress
    first, last = (float(number) * 1e-3 for number in re.findall(r"[\d.]+", warning)[:2])
    where = place[over & (y == place)] if "mirrored" in warning else place[over]
    # Interpolated between stations.
    assert (where[0], where[-1]) == pytest.approx((first, last), abs=1e-4)


@pytest.mark.parametrize(("modulus", "beyond"), [(210e9, False), (1e9, False), (0.5e9, True)])
def test_deformations_beyond_the_theory_are_told(modulus, beyond):
    """Of the paper's pin, which is 80 mm long: 5.5 mm and, of the diameter of 22 mm, 3.9 mm at 0.5 GPa."""
    scene = replace(VAZ, material=replace(VAZ.material, elastic_modulus=modulus))
    value = pin.check(scene, pin.Profile((0.0,), (13.9e-3,))).value
    assert any("small-deformation theory" in warning for warning in value.warnings) == beyond
