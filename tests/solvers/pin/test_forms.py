"""Stepped and conical bores against brute force; their order; what producibility costs."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from solvers import pin
from solvers.errors import InvalidInput
from tests.solvers.pin.pins import GEOMETRY, PAPER, STEEL, VAZ, grams, program

HALF = 0.5 * GEOMETRY.length


def bores(count, force=15e3):
    x = np.linspace(0.0, HALF, count)
    return x, pin.free_sizes(VAZ, PAPER, force, x)


@pytest.mark.parametrize("steps", [2, 3])
def test_steps_against_all_choices_of_breaks(steps):
    x, widest = bores(201)
    narrow = np.minimum.accumulate(widest)
    u = 1 - (narrow / GEOMETRY.outer_diameter) ** 2
    best = min(
        sum(u[j] * (x[j] - x[i]) for i, j in itertools.pairwise((0, *inner, 200)))
        for inner in itertools.combinations(range(1, 200), steps - 1)
    )
    found = program().mass_unit * best / HALF * 1e3
    mine = grams(VAZ, pin.Stepped(steps), accuracy=1e-7)
    assert mine <= found * (1 + 1e-12)
    assert mine == pytest.approx(found, rel=2e-4)


def test_more_steps_come_down_to_the_drillable_bore():
    masses = [grams(VAZ, pin.Stepped(n), accuracy=1e-4) for n in (1, 2, 3, 4, 6, 10)]
    assert np.all(np.diff(masses) < 0)
    drillable = grams(VAZ, pin.Free(drillable=True))
    assert masses[0] == pytest.approx(grams(VAZ, pin.Constant()), rel=1e-9)
    assert drillable < masses[-1] < 1.06 * drillable


def test_cones_against_a_dense_search():
    x, widest = bores(4001)
    t = x / HALF
    D = GEOMETRY.outer_diameter

    def mass(bore_volume):
        return program().mass_unit * (1 - bore_volume) * 1e3

    def hollow(r):
        size = np.min(np.minimum(widest / D, 1.0) / np.maximum(1 - (1 - r) * t, 1e-300))
        return min(size, 1.0) ** 2 * (1 + r + r * r) / 3

    # The volume has a kink where the bore touches at another place: a second, finer look around the first best.
    first = max(np.linspace(0, 1, 2001), key=hollow)
    best = max(hollow(r) for r in np.linspace(first - 5e-4, first + 5e-4, 2001))
    assert grams(VAZ, pin.Cone(), accuracy=1e-7) == pytest.approx(mass(best), rel=1e-6)

    def hollow_with_cylinder(pair):
        c, r = pair
        size = min(np.min(widest / D / (1 - (1 - r) * np.minimum(t / c, 1.0))), 1.0)
        return size**2 * (c * (1 + r + r * r) / 3 + (1 - c) * r * r)

    middle, reach = (0.625, 0.65), 0.075
    for _ in range(4):
        grids = [np.linspace(place - reach, place + reach, 31) for place in middle]
        middle, reach = max(itertools.product(*grids), key=hollow_with_cylinder), reach / 8
    mine = grams(VAZ, pin.Cone(cylinder=True), accuracy=1e-7)
    assert mine == pytest.approx(mass(hollow_with_cylinder(middle)), rel=1e-4)
    assert mine <= mass(hollow_with_cylinder(middle)) * (1 + 1e-9)


FORMS = (
    pin.Free(), pin.Free(drillable=True), pin.Constant(), pin.Stepped(2), pin.Stepped(3), pin.Cone(),
    pin.Cone(cylinder=True),
)  # fmt: skip


@pytest.mark.parametrize("limits", [{}, {"min_wall": 2e-3}, {"max_deflection": 11e-6}, {"max_ovalization": 2e-5}])
@pytest.mark.parametrize("form", FORMS, ids=lambda f: f"{f.name}-{getattr(f, 'steps', '')}")
def test_every_form_keeps_every_limit_and_its_own_bound(form, limits):
    outcome = pin.design(pin.PinProblem(VAZ, pin.Limits(**limits), form), accuracy=1e-5)
    value = outcome.value.check
    assert value.strength_utilisation <= 1 + 1e-9
    assert outcome.certificate.bound <= value.mass * (1 + 1e-12)
    assert value.mass >= outcome.value.free_mass * (1 - 1e-6)
    if "min_wall" in limits:
        assert np.all(0.5 * (GEOMETRY.outer_diameter - value.along.bore) >= 2e-3 * (1 - 1e-9))
    if "max_deflection" in limits:
        assert value.deflection <= 11e-6 * (1 + 1e-6)
    if "max_ovalization" in limits:
        assert value.ring.ovalization_max <= 2e-5 * (1 + 1e-9)
    if outcome.value.corners is not None:
        made = pin.Profile(*zip(*outcome.value.corners, strict=True))
        again = pin.check(VAZ, made).value
        assert again.mass == pytest.approx(value.mass, rel=1e-6)
        assert again.strength_utilisation <= 1 + 1e-6


def test_a_cone_may_not_be_steeper_than_asked():
    outcome = pin.design(pin.PinProblem(VAZ, pin.Limits(max_slope=0.2), pin.Cone()), accuracy=1e-5)
    (x0, d0), (x1, d1) = outcome.value.corners[:2]
    assert abs(d1 - d0) <= 0.2 * (x1 - x0) * (1 + 1e-9)
    assert outcome.certificate.gap < 1e-4


def test_what_contradicts_itself_is_refused():
    with pytest.raises(InvalidInput) as refusal:
        pin.PinProblem(VAZ, pin.Limits(max_slope=0.2), pin.Stepped(2))
    assert refusal.value.field == "limits.max_slope"
    sleeve = pin.Scene(pin.BushingGeometry(14e-3, 24e-3, 30e-3), 15e3, STEEL)
    for form in (pin.Cone(), pin.Cone(cylinder=True)):
        with pytest.raises(InvalidInput) as refusal:
            pin.PinProblem(sleeve, form=form)
        assert refusal.value.field == "form"
    with pytest.raises(InvalidInput):
        pin.Stepped(0)
    with pytest.raises(InvalidInput):
        pin.design(pin.PinProblem(VAZ, pin.Limits(min_wall=12e-3)))


def test_a_second_load_case_makes_the_pin_thicker_and_it_stays_certified():
    other = pin.LoadCase(
        (pin.MacaulayTerm(2e3, 0.0, 0, 1), pin.MacaulayTerm(-4e3, 0.03, 0, 1), pin.MacaulayTerm(2e3, 0.06, 0, 1)),
        axial_force=2e3,
        torque=20.0,
    )
    scene = pin.Scene(GEOMETRY, 15e3, VAZ.material, (other,))
    for form in (pin.Free(), pin.Free(drillable=True), pin.Stepped(2), pin.Cone(), pin.Constant()):
        outcome = pin.design(pin.PinProblem(scene, form=form), accuracy=1e-5)
        value = outcome.value.check
        assert value.strength_utilisation <= 1 + 1e-9
        assert outcome.certificate.gap < 1e-4
        assert value.mass >= 1e-3 * grams(VAZ, form, accuracy=1e-5) * (1 - 1e-6)
    limited = pin.design(pin.PinProblem(scene, pin.Limits(max_deflection=11e-6)), accuracy=1e-5)
    assert limited.certificate.gap < 1e-7


@pytest.mark.parametrize("room", [1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("form", [pin.Constant(), pin.Stepped(2), pin.Free(drillable=True)], ids=lambda form: form.name)
def test_a_wall_slightly_too_soft_is_thickened_slightly(form, room):
    """Of a short span under shear the least Lagrangian jumps from such a wall to the solid section."""
    scene = pin.Scene(pin.Geometry(30e-3, 60e-3, 5e-3, 0.2e-3), 20e3, VAZ.material)
    wall = 10.5e-3
    uniform = pin.check(scene, pin.Profile((0.0,), (30e-3 - 2.0 * wall,)), effects=pin.ALL).value
    limits = pin.Limits(min_wall=wall, max_deflection=uniform.deflection * (1.0 - room))
    found = pin.design(pin.PinProblem(scene, limits, form)).value.check
    assert uniform.mass < found.mass <= uniform.mass * (1.0 + 2.0 * room)
    assert found.deflection <= limits.max_deflection * (1.0 + 1e-12)


@pytest.mark.parametrize("form", [pin.Constant(), pin.Free(drillable=True), pin.Stepped(2), pin.Cone()])
def test_the_free_mass_beside_another_form_is_as_accurate_as_the_design(form):
    """The free bore jumps where that form is smooth: on its stations the free mass was off by 1.7e-5."""
    limits = pin.Limits(max_deflection=9.5e-6)
    exact = pin.design(pin.PinProblem(VAZ, limits), accuracy=1e-10).value.check.mass
    for accuracy in (1e-4, 1e-6, 1e-8):
        outcome = pin.design(pin.PinProblem(VAZ, limits, form), accuracy=accuracy)
        assert outcome.accuracy.met
        assert outcome.value.free_mass == pytest.approx(exact, rel=outcome.accuracy.estimated)
