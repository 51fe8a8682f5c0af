"""The rod's check and its kernels on hard cases, against values at 50 digits made by ``make_rod_references``.

Errors are counted in eps max(1, kappa), kappa the value's relative condition number: what a change of the inputs'
last digits does to it anyway.
"""

from __future__ import annotations

import json
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest

from oracles.textbook import rod_beam_column
from solvers import rod
from solvers.rod.cycle.composition import Composition, Cycle
from solvers.rod.effects import EFFECTS
from solvers.rod.strip import beam_column, shape
from tests.hard_cases.make_rod_references import load_cases

EPS = 2.0**-52
CASES = load_cases()
REFERENCES = json.loads((Path(__file__).parent / "rod_references.json").read_text())
KERNEL_LIMIT, CHECK_LIMIT, LOOP_LIMIT = 3.0, 30.0, 3.0


def units(found, reference, scale=None):
    """The error in eps max(1, kappa), relative to the value or to ``scale``, at least the least float."""
    with mp.workdps(40):
        exact = mp.mpf(reference["value"])
        whole = max(abs(exact) if scale is None else scale, mp.mpf(2) ** -1022)
        return float(abs(mp.mpf(float(found)) - exact) / whole) / (EPS * max(1.0, reference["condition"]))


def scene_of(case):
    data = case["scene"]
    load = dict(data["load"])
    kind = load.pop("kind")
    if kind == "schmidt":
        source = rod.SchmidtLoad(**load)
    elif kind == "constant":
        source = rod.ConstantLoad(**load)
    else:
        source = rod.TableLoad(tuple(load["angle"]), tuple(load["pressure"]))
    scene = rod.Scene(
        rod.Mechanism(**data["mechanism"]), rod.Piston(**data["piston"]), source, rod.Material(**data["material"])
    )
    return scene, rod.Dimensions(**data["dimensions"])


def answers(case, accuracy):
    scene, dimensions = scene_of(case)
    active = frozenset({"beam_column", "friction", *case["scene"]["effects"]})
    selection = rod.EffectSelection(active, frozenset(effect.name for effect in EFFECTS) - active)
    outcome = rod.check(scene, dimensions, selection, accuracy=accuracy)
    value = outcome.value
    names = ("axial_force_min", "axial_force_max", "critical_force", "stability_safety")
    found = {name: getattr(value, name) for name in names}
    if value.stresses is not None:
        names = ("fatigue_safety", "yield_safety", "deflection_ratio", "side_force_max", "clamp_moment_max",
                 "contact_pressure_max", "friction_power")  # fmt: skip
        found |= {name: getattr(value.stresses, name) for name in names}
    return outcome, {name: x for name, x in found.items() if x is not None}


def test_there_are_enough_cases():
    assert len(CASES["checks"]) >= 30 and len(CASES["kernels"]) >= 25
    assert set(REFERENCES) == {case["name"] for cases in ("checks", "kernels", "loops") for case in CASES[cases]}


@pytest.mark.parametrize("case", CASES["checks"], ids=lambda case: case["name"])
def test_check(case):
    """Every answer within a few eps kappa; what does not exist is not answered; the estimate covers the error."""
    reference = REFERENCES[case["name"]]
    outcome, found = answers(case, 1e-12)
    assert found.keys() == reference.keys()
    for name, value in found.items():
        error = units(value, reference[name])
        assert error <= CHECK_LIMIT, name
        assert error * EPS * max(1.0, reference[name]["condition"]) <= outcome.accuracy.estimated, name


@pytest.mark.parametrize("case", CASES["checks"], ids=lambda case: case["name"])
@pytest.mark.parametrize("accuracy", [1e-2, 1e-6])
def test_a_loose_check_meets_its_estimate(case, accuracy):
    reference = REFERENCES[case["name"]]
    outcome, found = answers(case, accuracy)
    assert found.keys() == reference.keys()
    for name, value in found.items():
        exact = float(reference[name]["value"])
        assert abs(value - exact) <= outcome.accuracy.estimated * abs(exact), name


def kernels(case):
    """The same constants, and fields by their names, by the kernels and by numpy."""
    q, l, L = case["coupling"], case["length"], case["rod_length"]
    z = np.array([0.25, 0.5, 0.75, 1.0]) * l
    plain = rod_beam_column.solve([q], l, L)
    constants = (plain.clamp_curvature[0], plain.clamp_shear[0], plain.head_curvature[0])
    fields = {"curvature": rod_beam_column.curvature, "deflection": rod_beam_column.deflection}
    yield constants, {name: field(plain, z)[:, 0] for name, field in fields.items()}
    one = np.array([q])
    # As a check has them.
    _, _, *found = beam_column.constants(q, l, L, 0.0)
    bent, turned, sunk = np.empty((3, z.size))
    for j, station in enumerate(z.tolist()):
        shape.bend(
            one, *(np.array([c]) for c in found), l, station, bent[j : j + 1], turned[j : j + 1], sunk[j : j + 1]
        )
    yield tuple(found), {"curvature": bent, "deflection": sunk}


def kernel_errors(case, reference):
    """The constants in eps kappa of their own; fields in eps kappa of their greatest value."""
    for constants, fields in kernels(case):
        for name, value in zip(("clamp_curvature", "clamp_shear", "head_curvature"), constants, strict=True):
            yield name, units(value, reference[name])
        for name, field in fields.items():
            exact = [reference[f"{name}_{i}"] for i in (1, 2, 3, 4)]
            known = exact if name == "deflection" else [*exact, reference["clamp_curvature"]]
            scale = max(abs(mp.mpf(entry["value"])) for entry in known)
            condition = max(entry["condition"] for entry in exact)
            for value, entry in zip(field, exact, strict=True):
                yield name, units(value, {**entry, "condition": condition}, scale)


@pytest.mark.parametrize("case", CASES["kernels"], ids=lambda case: case["name"])
def test_kernels(case):
    for name, error in kernel_errors(case, REFERENCES[case["name"]]):
        assert error <= KERNEL_LIMIT, name


def fed_back(case):
    """The axial force at the case's angle."""
    scene, dimensions = scene_of(case)
    cycle = Cycle(scene, dimensions, Composition(couples=True, feedback=True))
    return float(cycle.axial_force(np.array([case["angle"]]))[0])


@pytest.mark.parametrize("case", CASES["loops"], ids=lambda case: case["name"])
def test_friction_feedback(case):
    assert units(fed_back(case), REFERENCES[case["name"]]["axial_force"]) <= LOOP_LIMIT
