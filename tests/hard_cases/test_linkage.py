"""The linkage on hard cases, against values at 240 digits made by ``make_linkage_references``.

Errors are counted in eps max(1, kappa), kappa the value's relative condition number: what a change of the inputs' last
digits does to it anyway. u31 is judged by the greater of |u31| and |du31/dphi|: what a change of phi does;
its slope by the greatest of both and its own slope.
"""

from __future__ import annotations

import json
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest

from solvers import linkage
from solvers.errors import InvalidInput
from solvers.linkage.loads.torque_and_pin_force import peaks
from solvers.linkage.mechanism.angular_velocity_ratio import transfer_and_slope
from solvers.linkage.mechanism.kinematics import of_family
from solvers.linkage.swept_area.bounding_box import minimum_box
from solvers.linkage.swept_area.outline import sweep
from tests.hard_cases.make_linkage_references import load_cases

EPS = 2.0**-52
CASES = load_cases()
REFERENCES = json.loads((Path(__file__).parent / "linkage_references.json").read_text())
CLOSED_FORM, TRANSFER, SEARCHED = 8.0, 15.0, 30.0
"""Limits in eps kappa: for closed forms, for u31, and for extremes over angles or directions."""

SCENE = linkage.Scene(linkage.Restitution(0.3, 0.3), blow_frequency=25.0, impact_speed=5.0, impact_energy=2.0)


def units(found: float, reference: dict) -> float:
    with mp.workdps(40):
        exact = mp.mpf(reference["value"])
        return float(abs(mp.mpf(found) - exact) / abs(exact)) / (EPS * max(1.0, reference["condition"]))


def bar_of(case: dict, reference: dict):
    parameter = float(reference["parameter"]["value"])
    return of_family(linkage.KINDS[case["kind"]], case["restitution"], parameter)


def curve_units(bar, phi: float, entry: dict) -> float:
    """The error of u31 in eps of the greater of |u31| and its slope."""
    with mp.workdps(40):
        off = abs(mp.mpf(float(bar.transfer(phi))) - mp.mpf(entry["value"]))
        return float(off / mp.mpf(entry["scale"])) / EPS


def slope_units(bar, phi: float, entry: dict) -> float:
    """The error of u31' in eps of the greatest of |u31|, |u31'| and its own slope."""
    _, slope = transfer_and_slope(bar.coefficients, np.array([phi]))
    with mp.workdps(40):
        off = abs(mp.mpf(float(slope[0])) - mp.mpf(entry["slope"]))
        return float(off / mp.mpf(entry["slope_scale"])) / EPS


def angles(case):
    return (*CASES["angles"], *case.get("angles", ()))


def closed_forms(bar):
    yield "lambda0", float(bar.ratios.base)
    yield "lambda2", float(bar.ratios.coupler)
    yield "lambda3", float(bar.ratios.rocker)
    yield "start", bar.u31_start
    yield "end", bar.u31_end
    yield "swing", bar.swing
    yield "transmission_angle", bar.middle_transmission_angle


def searched(bar):
    found = peaks(bar, 1.0, 1.0)
    yield "torque", found.torque
    yield "force", found.force
    yield "area", minimum_box(sweep(bar, 1.0), 0.0).area


def checked(case):
    return linkage.check(SCENE, linkage.of_lengths(linkage.Lengths(*map(float, case["lengths"])))).value


def told_by_lengths(found, reference):
    """(name, value) of what lengths tell beyond yes and no."""
    if reference.get("restitution") is not None:
        return "restitution", found.mechanism.bar.restitution
    if "blocked" in reference:
        return "blocked", found.window.angle
    if "short_stop" in reference:
        return "short_stop", found.window.short_stop
    return None


def limited(case):
    """What no type meets, as the design answers it."""
    scene = linkage.Scene(
        linkage.Restitution(*case["restitution"]), float(case["frequency"]), float(case["speed"]), impact_energy=1.0
    )
    limits = linkage.Limits(**{name: case[name] for name in ("longest_link", "min_link") if name in case})
    return linkage.design(linkage.LinkageProblem(scene, limits, linkage.OBJECTIVES["longest_link"]))


def attainable(case):
    (entry,) = limited(case).diagnosis
    return entry.attainable


def test_there_are_enough_cases():
    assert len(CASES["ratios"]) >= 25
    assert len(CASES["lengths"]) >= 20
    judged = [case["name"] for group in ("ratios", "lengths", "designs") for case in CASES[group]]
    refused = {case["name"] for case in CASES["lengths"] if "refused" in case}
    assert set(judged) - refused == set(REFERENCES)


@pytest.mark.parametrize("case", CASES["ratios"], ids=lambda case: case["name"])
def test_closed_forms(case):
    reference = REFERENCES[case["name"]]
    bar = bar_of(case, reference)
    for name, value in closed_forms(bar):
        assert units(value, reference[name]) <= CLOSED_FORM, name
    assert abs(bar.restitution / case["restitution"] - 1) <= 8 * EPS


@pytest.mark.parametrize("case", CASES["ratios"], ids=lambda case: case["name"])
def test_transfer_function(case):
    reference = REFERENCES[case["name"]]
    bar = bar_of(case, reference)
    assert bar.rotatable
    for phi, exact in zip(angles(case), reference["curve"], strict=True):
        assert curve_units(bar, phi, exact) <= TRANSFER, phi
        assert slope_units(bar, phi, exact) <= case.get("within", TRANSFER), phi


@pytest.mark.parametrize("case", CASES["ratios"], ids=lambda case: case["name"])
def test_peak_loads_and_box(case):
    reference = REFERENCES[case["name"]]
    bar = bar_of(case, reference)
    for name, value in searched(bar):
        assert units(value, reference[name]) <= SEARCHED, name


@pytest.mark.parametrize("case", CASES["lengths"], ids=lambda case: case["name"])
def test_lengths(case):
    lengths = [float(text) for text in case["lengths"]]
    if "refused" in case:
        with pytest.raises(InvalidInput) as refused:
            linkage.Lengths(*lengths)
        assert refused.value.field == f"lengths.{case['refused']}"
        return
    reference = REFERENCES[case["name"]]
    found = checked(case)
    assert found.mechanism.closure.closes == reference["closes"]
    assert found.mechanism.rotatable == reference["rotatable"]
    if "restitution" in reference:
        assert found.mechanism.bar.kind.name == reference["kind"]
        assert (found.strike is None) == (reference["restitution"] is None)
        if found.strike is not None:
            assert found.mechanism.bar.restitution == pytest.approx(float(reference["restitution"]), rel=1e-14)
    if not reference["closes"]:
        assert found.strike is None
        assert found.mechanism.bar.kind.name == reference["kind"]
        # The miss itself is a difference of the lengths, good to their last digits only.
        surplus = abs(found.mechanism.closure.surplus)
        within = 1e-14 + 4 * EPS * max(lengths) / (surplus * found.mechanism.crank)
        assert found.window.blocked == ("blocked" in reference)
        told = found.window.angle if found.window.blocked else found.window.short_stop
        exact = float(reference["blocked" if found.window.blocked else "short_stop"])
        assert told == pytest.approx(exact, rel=within)


@pytest.mark.parametrize("case", CASES["designs"], ids=lambda case: case["name"])
def test_infeasible_limits(case):
    reference, outcome = REFERENCES[case["name"]], limited(case)
    assert outcome.value is None
    (entry,) = outcome.diagnosis
    assert entry.requirement == reference["requirement"]
    assert entry.attainable == pytest.approx(float(reference["value"]), rel=1e-9)
    assert reference["kind"].replace("_", " ") in entry.advice
