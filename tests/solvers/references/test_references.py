"""The independent models against values at 50 digits and more, against closed forms, and against the solvers."""

from __future__ import annotations

import json
from itertools import product
from pathlib import Path

import mpmath as mp
import pytest

from solvers.fatigue import CRITERIA
from solvers.fatigue.kernels import utilisation_of
from solvers.materials import Material
from solvers.references import crank, linkage, pin, rod_check, searching
from solvers.references.rod import Machine, natural_frequency
from solvers.watch import OutOfTime, Watch
from tests.hard_cases import make_crank_references, make_linkage_references, make_pin_references, make_rod_references

HARD = Path(__file__).parents[2] / "hard_cases"
CLOSE = 1e-15
"""What references are trusted to, less the rounding of a float."""


def digits(wing: str, name: str) -> dict[str, dict]:
    return json.loads((HARD / f"{wing}_references.json").read_text())[name]


def off(value: object, reference: dict) -> float:
    with mp.workdps(40):
        exact = mp.mpf(reference["value"])
        return float(abs(value - exact) / abs(exact)) if exact else float(abs(value))


def patient() -> None:
    pass


def named(cases: list[dict], name: str) -> dict:
    return next(case for case in cases if case["name"] == name)


@pytest.mark.parametrize("name", ["car", "rod_of_1.001_radii", "odd_three", "stirling_tiny"])
def test_a_cycle_has_the_digits_of_the_hard_cases(name):
    case = named(make_crank_references.load_cases()["cycles"], name)
    known, called = digits("crank", name), {"mean_torque": "torque_mean"}
    found = crank.cycle(case["scene"], patient)
    assert {called.get(n, n) for n in found} <= known.keys()
    for own, (value, doubt) in found.items():
        assert off(value, known[called.get(own, own)]) <= CLOSE + doubt, own
        assert doubt <= CLOSE


@pytest.mark.parametrize("name", ["paper", "limit_1e-9", "thin_1e-12", "beyond"])
def test_a_pin_has_the_digits_of_the_hard_cases(name):
    case = named(make_pin_references.load_cases(), name)["pin"]
    known = digits("pin", name)
    found = pin.common(case, patient) | pin.free_bore(case, True, patient)
    for own, called in {
        "force_limit": "force_limit",
        "constant_bore_mass": "constant_mass",
        "mass": "free_mass",
    }.items():
        if called in known:
            assert off(found[own][0], known[called]) <= CLOSE + found[own][1], own
    assert (found["constant_bore_mass"][0] is None) == ("constant_mass" not in known)
    assert ("mass" in found) == ("free_mass" in known)


def test_a_given_bore_is_the_difference_of_two_solids_and_the_solid_pin_its_own_limit():
    case = named(make_pin_references.load_cases(), "paper")["pin"]
    with mp.workdps(pin.DIGITS):
        plain = pin.Pin(case)
        length, outer = plain.L, plain.D
        bored = pin.given_bore(case, [(0.0, float(outer) / 2), (float(length), float(outer) / 2)], True, patient)
        solid = pin.common(case, patient)["solid_mass"][0]
        assert abs(bored["mass"][0] / solid - mp.mpf(3) / 4) < 1e-15
        full = pin.given_bore(case, [(0.0, 0.0), (float(length), 0.0)], True, patient)
        assert off(full["deflection"][0], digits("pin", "paper")["solid_deflection"]) <= CLOSE
        # A tube's bending is that of the solid section divided by 1 - r^4; its shear deflection uses Cowper's
        # coefficient of a tube.
        bent = [pin.given_bore(case, [(0.0, d), (float(length), d)], False, patient)["deflection"][0]
                for d in (0.0, float(outer) / 2)]  # fmt: skip
        assert abs(bent[1] / bent[0] * (1 - mp.mpf(1) / 16) - 1) < 1e-14
        assert bored["deflection"][0] > bent[1]


@pytest.mark.parametrize("name", ["coupler_R0.3", "base_R0.95_parallelogram_1e-12", "rocker_R0.3_near_least"])
def test_a_strike_has_the_digits_of_the_hard_cases(name):
    case = named(make_linkage_references.load_cases()["ratios"], name)
    with mp.workdps(180):
        restitution, parameter = make_linkage_references.inputs(case)
    known = digits("linkage", name)
    found = linkage.strike(case["kind"], float(restitution), float(parameter), True, patient)
    for own in ("start", "end", "transmission_angle", "torque", "force"):
        assert off(found[own][0], known[own]) <= CLOSE, own
    area = linkage.box_area(case["kind"], float(restitution), float(parameter), 0, patient)
    assert off(area, known["area"]) <= CLOSE
    wider = linkage.box_area(case["kind"], float(restitution), float(parameter), 0.1, patient)
    assert wider > area + 0.04


@pytest.mark.parametrize(
    "name", ["paper", "load_through_zero_1", "buckling_1e-8", "tension_kl_40", "beyond_buckling_2"]
)
def test_a_strip_has_the_digits_of_the_hard_cases(name):
    case = named(make_rod_references.load_cases()["checks"], name)
    known = digits("rod", name)
    found = rod_check.check(case["scene"], "serensen", patient, known.keys())
    assert known.keys() - {"deflection_ratio"} <= found.keys()
    for own, reference in known.items():
        if own in found:
            value, doubt = found[own]
            assert off(value, reference) <= CLOSE + doubt, own
            assert doubt <= CLOSE


def test_a_strip_at_rest_rings_as_a_cantilever_whose_head_is_guided():
    """With L = l the head is at the pin: clamped-pinned, 1.0 of beta l = 3.926602312047919 (tables of beam modes)."""
    case = named(make_rod_references.load_cases()["checks"], "paper")["scene"]
    length = case["dimensions"]["l"]
    with mp.workdps(30):
        machine = Machine({**case, "mechanism": {**case["mechanism"], "rod_length": length}})
        x = machine.x
        line = x["density"] * x["b"] * x["h"]
        expected = (mp.mpf("3.926602312047918778") / x["l"]) ** 2 * mp.sqrt(machine.stiffness / line) / (2 * mp.pi)
        assert abs(natural_frequency(machine, mp.mpf(0), patient) / expected - 1) < 1e-17
        assert natural_frequency(machine, -2 * machine.critical_bending(), patient) == 0


@pytest.mark.parametrize("criterion", CRITERIA)
def test_utilisations_are_those_of_the_limiting_curves(criterion):
    material = Material(210e9, 480e6, 1.15, 0.2, 1200e6, 7850.0, ultimate_strength=1500e6)
    own, theirs = rod_check.utilisation(criterion, vars(material)), CRITERIA[criterion](material).diagram()
    for amplitude, mean in product((0.0, 1e6, 2e8), (-3e8, 0.0, 1e8, 2.2e8, 5e8, 9e8)):
        high, low = mean + amplitude, mean - amplitude
        used = float(own(mp.mpf(high), mp.mpf(low)))
        assert used == pytest.approx(utilisation_of(high, low, *theirs), rel=1e-12, abs=1e-300)


def test_a_search_finds_summits_corners_and_zeros():
    with mp.workdps(40):
        third, ends = mp.mpf(1) / 3, (mp.mpf(0), mp.mpf("0.5"), mp.mpf(1))
        place, value = searching.refined_maximum(lambda x: -((x - third) ** 2), *ends)
        assert abs(place - third) < 1e-15 and abs(value) < 1e-30
        assert abs(searching.refined_maximum(lambda x: -abs(x - third), *ends)[1]) < 1e-29
        assert abs(searching.find_root(mp.cos, mp.mpf(1), mp.mpf(2)) - mp.pi / 2) < 1e-37
        assert abs(mp.fsum(w * x**9 for x, w in searching.gauss(mp.mpf(0), mp.mpf(1), 5)) - mp.mpf(1) / 10) < 1e-38


@pytest.mark.parametrize("wing", ["crank", "pin", "linkage", "rod"])
def test_every_reference_ends_when_its_time_is_over(wing):
    now = iter(range(10**9))
    watch = Watch(50.0, lambda: float(next(now)))
    with pytest.raises(OutOfTime):
        if wing == "crank":
            crank.cycle(named(make_crank_references.load_cases()["cycles"], "car")["scene"], watch)
        elif wing == "pin":
            pin.free_bore(named(make_pin_references.load_cases(), "paper")["pin"], True, watch)
        elif wing == "linkage":
            linkage.strike("largest_coupler", 0.3, 3.0, True, watch)
        else:
            case = named(make_rod_references.load_cases()["checks"], "paper")["scene"]
            rod_check.check(case, "serensen", watch, ["fatigue_safety"])
