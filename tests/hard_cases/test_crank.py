"""The crank's motion, cycle and pendulum on hard cases, against values at 50 digits made by ``make_crank_references``.

Errors are counted in eps times what the value cannot escape: max(1, its relative condition number) for a motion and a
pendulum; for forces and works the sum of the magnitudes of their terms.
"""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path

import mpmath as mp
import pytest

from solvers import crank
from solvers.crank.motion.slider_crank import angle_functions, crank_angle_at, rod_acceleration_of
from solvers.effects import ALL
from tests.hard_cases.make_crank_references import load_cases

EPS = 2.0**-52
CASES = load_cases()
REFERENCES = json.loads((Path(__file__).parent / "crank_references.json").read_text())
MOTION_LIMIT, PENDULUM_LIMIT, CYCLE_LIMIT = 4.0, 4.0, 8.0


def off(found, reference):
    """|found - reference|, evaluated without loss of digits."""
    with mp.workdps(40):
        return abs(mp.mpf(float(found)) - mp.mpf(reference["value"]))


def units(found, reference):
    """The error in eps max(1, condition), the value at least the least normal float."""
    with mp.workdps(40):
        whole = max(abs(mp.mpf(reference["value"])), mp.mpf(2) ** -1022)
        return float(off(found, reference) / whole) / (EPS * max(1.0, reference["condition"]))


def motions(inputs):
    r, length, e = (inputs[name] for name in ("crank_radius", "rod_length", "offset"))
    motion = crank.ExactMotion(r, length, e)
    if "angle" in inputs:
        phi = inputs["angle"]
        at = angle_functions(phi, motion.geometry)
        yield "displacement", motion.displacement(phi)
        yield "velocity", r * (at.sine + at.cosine * at.tangent)
        yield "acceleration", motion.acceleration(phi)
        yield "rod_tangent", at.tangent
        yield "rod_angular_acceleration", rod_acceleration_of(at, motion.geometry)
    if "position" in inputs:
        yield "crank_angle", crank_angle_at(inputs["position"], r, length, e)


def scene_of(data):
    pressure, masses = data["pressure"], data["masses"]
    if pressure["kind"] == "table":
        source = crank.TablePressure(tuple(pressure["angle"]), tuple(pressure["pressure"]))
    else:
        source = crank.IndicatorPressure(
            tuple(crank.Stroke(tuple(s["volume"]), tuple(s["pressure"])) for s in pressure["strokes"])
        )
    mechanism = crank.Mechanism(**data["mechanism"])
    rod = crank.RodMass(mechanism.rod_length, masses["rod"], masses["rod_cg"], masses["rod_inertia"])
    phases = tuple(data["phases"])
    return crank.Scene(
        mechanism,
        crank.Cylinder(**data["cylinder"]),
        source,
        crank.Masses(masses["piston"], rod, crank.CrankThrow(masses["crank_pin"])),
        crank.Engine(phases, (0.0,) * len(phases)),
    )


def answers(case, accuracy):
    outcome = crank.analyse(scene_of(case["scene"]), ALL, accuracy=accuracy)
    value = outcome.value
    found = {worst.name: worst.force for worst in value.worst}
    found |= {
        "indicated_power": value.indicated_power,
        "torque_mean": value.torque_mean,
        "work_fluctuation": value.speed_fluctuation.work_fluctuation,
    }
    return outcome, found


def test_there_are_enough_cases():
    assert sum(len(group) for group in CASES.values()) >= 50
    assert set(REFERENCES) == {case["name"] for group in CASES.values() for case in group}


@pytest.mark.parametrize("case", CASES["motions"], ids=lambda case: case["name"])
def test_motion(case):
    reference = REFERENCES[case["name"]]
    for name, value in motions(case["inputs"]):
        assert units(value, reference[name]) <= MOTION_LIMIT, name


@pytest.mark.parametrize("case", CASES["pendulums"], ids=lambda case: case["name"])
def test_pendulum(case):
    reference = REFERENCES[case["name"]]
    found = crank.swing(crank.Pendulum(**case["inputs"])).values
    assert {field.name for field in fields(crank.Pendulum)} >= set(case["inputs"])
    for name, entry in reference.items():
        assert units(found[name], entry) <= PENDULUM_LIMIT, name


@pytest.mark.parametrize("case", CASES["cycles"], ids=lambda case: case["name"])
def test_cycle(case):
    """Every result is within a few eps of the magnitudes of its terms, and the estimate covers the error."""
    reference = REFERENCES[case["name"]]
    outcome, found = answers(case, 1e-12)
    assert found.keys() == reference.keys()
    for name, value in found.items():
        entry = reference[name]
        error = float(off(value, entry))
        rounding = EPS * entry["size"]
        assert error <= CYCLE_LIMIT * rounding, name
        assert error <= outcome.accuracy.estimated * abs(value) + CYCLE_LIMIT * rounding, name


@pytest.mark.parametrize("case", CASES["cycles"], ids=lambda case: case["name"])
@pytest.mark.parametrize("accuracy", [1e-1, 1e-2, 1e-4, 1e-6])
def test_a_loose_cycle_meets_its_estimate(case, accuracy):
    reference = REFERENCES[case["name"]]
    outcome, found = answers(case, accuracy)
    for name, value in found.items():
        entry = reference[name]
        rounding = CYCLE_LIMIT * EPS * entry["size"]
        assert float(off(value, entry)) <= outcome.accuracy.estimated * abs(value) + rounding, name
