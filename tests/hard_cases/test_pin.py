"""The pin's design and check on hard cases, against values at 50 digits made by ``make_pin_references``.

Errors are counted in eps max(1, kappa), kappa the value's relative condition number: what a change of the inputs'
last digits does to it anyway.
"""

from __future__ import annotations

import json
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest

from solvers import pin
from solvers.effects import ALL
from solvers.pin.optimum.program import least_walls_at
from solvers.pin.ring import ovalization
from tests.hard_cases.make_pin_references import PLACES, load_cases

EPS = 2.0**-52
CASES, WALLS = load_cases(), load_cases("walls")
TUBES, BUSHINGS = load_cases("tubes"), load_cases("bushings")
REFERENCES = json.loads((Path(__file__).parent / "pin_references.json").read_text())
FEASIBLE = [case for case in CASES if "free_mass" in REFERENCES[case["name"]]]
INFEASIBLE = [case for case in CASES if "free_mass" not in REFERENCES[case["name"]]]
WALL_LIMIT, MASS_LIMIT = 8.0, 8.0


def units(found, reference):
    """The error in eps max(1, kappa)."""
    with mp.workdps(40):
        exact = mp.mpf(reference["value"])
        if exact == 0:
            return 0.0 if found == 0.0 else np.inf
        return float(abs(mp.mpf(float(found)) / exact - 1)) / (EPS * max(1.0, reference["condition"]))


def scene_of(case):
    x = case["pin"]
    return pin.Scene(
        pin.Geometry(x["outer_diameter"], x["boss_length"], x["small_end_length"], x["gap"]),
        x["force"],
        pin.PinMaterial(x["allowable_stress"], x["elastic_modulus"], x["poisson"], x["density"], x["allowable_shear"]),
    )


def designed(case, accuracy=1e-12, form=pin.Free(), **limits):  # noqa: B008
    x = case["pin"]
    problem = pin.PinProblem(
        scene_of(case), pin.Limits(min_wall=x["min_wall"], **limits), form, pin.CRITERIA[x["criterion"]]
    )
    return pin.design(problem, accuracy=accuracy)


def walls(case, shares=PLACES):
    """Relative walls at shares of half the pin."""
    scene, x = scene_of(case), case["pin"]
    at = np.array([float(share) for share in shares]) * 0.5 * scene.geometry.length
    floor = 2.0 * x["min_wall"] / x["outer_diameter"]
    return least_walls_at(scene, pin.CRITERIA[x["criterion"]], floor, at)


def solid_deflection(case):
    """With shear, whether it counts or not."""
    return pin.check(scene_of(case), pin.Profile((0.0,), (0.0,)), effects=ALL, accuracy=1e-12).value.deflection


def place_errors(case, reference):
    """The wall at a case's one place, and the solid pin's deflection."""
    yield "wall", units(walls(case, (case["place"],))[0], reference["wall"])
    yield "solid_deflection", units(solid_deflection(case), reference["solid_deflection"])


def tube_errors(case, reference):
    """What a pin of one bore weighs, gives and bears."""
    scene = scene_of(case)
    bore = case["ratio"] * scene.geometry.outer_diameter
    criterion = pin.CRITERIA[case["pin"]["criterion"]]
    value = pin.check(scene, pin.Profile((0.0,), (bore,)), criterion, effects=ALL, accuracy=1e-12).value
    for name, entry in reference.items():
        yield name, units(getattr(value, name), entry)


def bushing_errors(case, reference):
    """The bushing's wall at a case's one place."""
    x = case["pin"]
    geometry = pin.BushingGeometry(case["bore"], x["boss_length"], x["small_end_length"], x["gap"])
    scene = pin.Scene(geometry, x["force"], scene_of(case).material)
    at = np.array([0.5 * float(case["place"]) * geometry.length])
    yield "gap", units(least_walls_at(scene, pin.CRITERIA[x["criterion"]], 0.0, at)[0], reference["gap"])


def named(cases):
    return pytest.mark.parametrize("case", cases, ids=lambda case: case["name"])


def test_there_are_enough_cases():
    assert len(CASES) >= 40
    assert set(REFERENCES) == {case["name"] for case in CASES + WALLS + TUBES + BUSHINGS}
    assert len(INFEASIBLE) == 3


@named(FEASIBLE)
def test_the_walls(case):
    """d/D to 1e-6 of a wall of 1e-12 of the diameter: the unknown is the wall."""
    for share, wall in zip(PLACES, walls(case), strict=True):
        assert units(wall, REFERENCES[case["name"]][f"wall_{share}"]) <= WALL_LIMIT, share


@named(FEASIBLE)
@pytest.mark.parametrize("accuracy", [1e-12, 1e-6, 1e-2])
def test_the_masses(case, accuracy):
    """Free and constant bore: as exact as they say; at the tightest accuracy within some eps kappa of the truth."""
    reference = REFERENCES[case["name"]]
    outcome = designed(case, accuracy)
    value = outcome.value.check
    found = {"free_mass": value.mass, "constant_mass": value.constant_mass}
    for name, mass in found.items():
        exact, kappa = float(reference[name]["value"]), max(1.0, reference[name]["condition"])
        rounding = MASS_LIMIT * EPS * kappa
        assert abs(mass - exact) <= (outcome.accuracy.estimated + rounding) * exact, name
        assert abs(mass - exact) <= (accuracy + rounding) * exact, name
    assert 0.0 <= outcome.certificate.gap <= 1e-7
    assert outcome.certificate.bound <= float(reference["free_mass"]["value"]) * (1 + outcome.accuracy.estimated)


@named(WALLS)
def test_one_place(case):
    for name, error in place_errors(case, REFERENCES[case["name"]]):
        assert error <= case.get("within", WALL_LIMIT), name


@named(TUBES)
def test_one_bore(case):
    for name, error in tube_errors(case, REFERENCES[case["name"]]):
        assert error <= case.get("within", WALL_LIMIT), name


@named(BUSHINGS)
def test_one_place_of_a_bushing(case):
    for name, error in bushing_errors(case, REFERENCES[case["name"]]):
        assert error <= case.get("within", WALL_LIMIT), name


@named(CASES)
def test_the_load_of_the_solid_pin(case):
    reference = REFERENCES[case["name"]]
    limit = pin.force_limit(scene_of(case), pin.CRITERIA[case["pin"]["criterion"]])
    if "force_limit" in reference:
        assert units(limit, reference["force_limit"]) <= 16.0
    else:
        assert limit > 0.0


@named(INFEASIBLE)
def test_an_infeasible_load_is_diagnosed(case):
    outcome = designed(case)
    assert outcome.value is None
    (short,) = outcome.diagnosis
    assert short.requirement == "force"
    assert units(short.attainable, REFERENCES[case["name"]]["force_limit"]) <= 16.0
    weak = pin.explain(pin.PinProblem(scene_of(case))).weak
    assert 0 < weak.begin < weak.end < scene_of(case).geometry.length


@named(CASES)
def test_the_solid_pins_deflection(case):
    assert units(solid_deflection(case), REFERENCES[case["name"]]["solid_deflection"]) <= 64.0


@named([case for case in FEASIBLE if case["pin"]["force"] > 0])
@pytest.mark.parametrize("above", [1.0, 1.0 + 1e-9, 1.0 + 1e-3])
def test_a_deflection_limit_equal_to_the_solid_pins(case, above):
    """Only the solid span keeps it; a hair below, nothing does."""
    limit = pin.check(scene_of(case), pin.Profile((0.0,), (0.0,)), accuracy=1e-12).value.deflection
    outcome = designed(case, 1e-6, max_deflection=limit * above)
    assert outcome.value.check.deflection <= limit * above * (1 + 1e-12)
    assert outcome.value.check.mass <= outcome.value.check.solid_mass * (1 + 1e-14)
    assert outcome.certificate.gap <= 1e-7
    assert designed(case, 1e-6, max_deflection=limit * (1 - 1e-9)).value is None


@named([case for case in FEASIBLE if case["pin"]["force"] > 0 and case["name"] != "wall_solid"])
@pytest.mark.parametrize("ratio", [0.3, 0.79, 0.8 - 1e-9, 0.8 + 1e-9, 0.864, 0.99])
def test_no_ovalization_limit_is_met_by_the_factors_zero(case, ratio):
    """Limits that the ring of this bore meets exactly, on both sides of the seam and at the textbook factor's zero."""
    scene, g, m = scene_of(case), scene_of(case).geometry, scene_of(case).material
    limit = ovalization.ring(scene.force, g.outer_diameter, g.length, ratio, m.elastic_modulus, m.poisson).ovalization
    outcome = designed(case, 1e-4, max_ovalization=limit)
    assert 1.0 - outcome.value.evaluation.walls.min() <= ratio * (1 + 1e-9)
    # The points lie on cubics that meet the limits to the accuracy.
    assert outcome.value.check.along.bore.max() <= ratio * g.outer_diameter * (1 + 1e-4)
    assert outcome.value.check.ring.ovalization_max <= limit * (1 + 1e-9)


@named([case for case in FEASIBLE if case["pin"]["force"] > 0])
def test_no_form_is_lighter_than_the_free_one(case):
    free = designed(case, 1e-4).value.check.mass
    for form in (pin.Free(drillable=True), pin.Constant(), pin.Stepped(3), pin.Cone()):
        outcome = designed(case, 1e-3, form)
        value = outcome.value.check
        assert free * (1 - 2e-4) <= value.mass <= value.constant_mass * (1 + 2e-3), form.name
        assert outcome.certificate.bound <= value.mass * (1 + 1e-12)
