"""The bounds of the effects against what leaving them out does, and what the manifest says."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from solvers import crank
from solvers.effects import ALL, EffectSelection
from solvers.errors import InvalidInput
from tests.solvers.crank.machines import CAR, car


def random_scene(rng: np.random.Generator) -> crank.Scene:
    length = 10 ** rng.uniform(-2, 0)
    r = length * rng.uniform(0.05, 0.4)
    offset = r * rng.choice([0.0, rng.uniform(-0.1, 0.1)])
    bore, speed = r * rng.uniform(1.0, 2.5), 10 ** rng.uniform(0, 1.7)
    area = math.pi * bore**2 / 4
    angle = np.arange(72) * 2 * math.pi / 72
    pressure = 1e5 + 10 ** rng.uniform(5, 6.5) / (1.5 - np.cos(angle - rng.uniform(0, 1)))
    mass = area * rng.uniform(50, 300)
    cg = length * rng.uniform(0.5, 0.8)
    inertia = mass * cg * (length - cg) * rng.uniform(0.8, 1.1)
    return crank.Scene(
        crank.Mechanism(r, length, speed, offset),
        crank.Cylinder(bore, area * r * 0.2, 1e5, 2),
        crank.TablePressure(tuple(angle), tuple(pressure)),
        crank.Masses(mass, crank.RodMass(length, mass, cg, inertia), crank.CrankThrow()),
    )


@pytest.mark.parametrize("case", range(25))
def test_leaving_an_effect_out_changes_no_worst_force_by_more_than_its_bound(case):
    scene = random_scene(np.random.default_rng(case))
    full = crank.analyse(scene, ALL)
    bounds = {e.name: e.influence for e in full.effects}
    for name in ("reciprocating_inertia", "rod_inertia_couple", "pin_offset"):
        less = crank.analyse(scene, EffectSelection(exclude=frozenset({name}), automatic=False)).value
        named = {"gas_force_max", "rod_compression_max", "side_force_max", "wrist_pin_load_max"}
        for with_it, without in zip(full.value.worst, less.worst, strict=True):
            if with_it.name in named and bounds[name] < 1:
                assert abs(without.force / with_it.force - 1) <= bounds[name] + 1e-9, (name, with_it.name)


def _change_without(scene: crank.Scene, name: str) -> tuple[float, float]:
    """The estimated influence of an effect; the relative change that its omission causes in the greatest loads and the
    work between the extremes of the speed."""
    full = crank.analyse(scene, ALL)
    less = crank.analyse(scene, EffectSelection(exclude=frozenset({name}), automatic=False)).value
    changes = [abs(a.force / b.force - 1) for a, b in zip(less.worst, full.value.worst, strict=True)]
    changes.append(abs(less.speed_fluctuation.work_fluctuation / full.value.speed_fluctuation.work_fluctuation - 1))
    return next(e.influence for e in full.effects if e.name == name), max(changes)


@pytest.mark.parametrize("gap", [1e-4, 1e-6])
def test_the_narrow_peak_of_a_rod_hardly_longer_than_its_crank_counts(gap):
    """The inertia is a twentieth of the gas force at the peak, and next to nothing a degree away from it."""
    r, length, cylinder = 0.04, 0.04 / (1.0 - gap), crank.Cylinder(0.08, 1e-5, 1e5, 2)
    angle = np.arange(24) * (math.pi / 12.0)
    table = crank.TablePressure(tuple(angle), tuple(1e6 + 8e5 * np.cos(angle - 1.0)))
    gas = (0.9e6 + 8e5 * math.sin(1.0)) * cylinder.area
    speed = math.sqrt(0.05 * math.sqrt(2.0 * gap) * gas / (0.5 * r)) / (2.0 * math.pi)
    masses = crank.Masses(0.5, crank.RodMass(length, 0.0, 0.0), crank.CrankThrow())
    influence, change = _change_without(
        crank.Scene(crank.Mechanism(r, length, speed), cylinder, table, masses), "reciprocating_inertia"
    )
    assert change == pytest.approx(0.05, rel=0.1)
    assert change < influence < 1.5 * change


def test_the_couples_of_evenly_phased_cylinders_nearly_cancel():
    """Phases rounded to the sampled angles leave more of them than there is, or less."""
    length, r, cylinder = 0.39, 0.375, crank.Cylinder(0.5, 1e-3, 1e5, 2)
    angle = np.arange(36) * (math.pi / 18.0)
    table = crank.TablePressure(tuple(angle), tuple(1e5 + 1e5 / (1.2 - np.cos(angle))))
    rod = crank.RodMass(length, 15.0, 0.17, 1.8)
    nine = crank.Engine(tuple(2.0 * math.pi * i / 9 for i in range(9)), (0.0,) * 9)
    masses = crank.Masses(12.0, rod, crank.CrankThrow())
    scene = crank.Scene(crank.Mechanism(r, length, 1.0), cylinder, table, masses, nine)
    influence, change = _change_without(scene, "rod_inertia_couple")
    assert change < influence < 3.0 * change, (influence, change)


def test_auto_leaves_out_what_cannot_matter():
    slow = crank.analyse(car(mechanism=replace(CAR, speed=0.5)))
    states = {e.name: str(e.state) for e in slow.effects}
    assert states == dict.fromkeys(states, "skipped")
    fast = {e.name: str(e.state) for e in crank.analyse(car()).effects}
    assert (fast["reciprocating_inertia"], fast["pin_offset"]) == ("active", "skipped")


def test_a_diagram_that_only_the_offset_reaches_says_why_the_offset_counts():
    offset = replace(CAR, offset=0.04)
    cylinder, swept = car().cylinder, car().cylinder.area * offset.motion.stroke
    volumes = tuple((cylinder.clearance_volume + swept * np.linspace(0.0, 1.0, 9)).tolist())
    diagram = crank.IndicatorPressure(tuple(crank.Stroke(volumes, (p,) * 9) for p in (0.9e5, 5e5, 2e6, 1.1e5)))
    (entry,) = (e for e in crank.analyse(car(mechanism=offset, pressure=diagram)).effects if e.name == "pin_offset")
    assert str(entry.state) == "active"
    assert "without it there is no result" in entry.why


def test_an_offset_moves_the_dead_centres_and_can_be_left_out():
    shifted = car(mechanism=replace(CAR, offset=0.01))
    found = crank.analyse(shifted, ALL).value
    assert found.cycle.motion.dead_centres == pytest.approx((math.asin(0.01 / 0.18), math.pi + math.asin(0.01 / 0.10)))
    assert found.cycle.motion.stroke == pytest.approx(math.sqrt(0.18**2 - 1e-4) - math.sqrt(0.1**2 - 1e-4))
    excluded = EffectSelection(exclude=frozenset({"pin_offset"}), automatic=False)
    ours, never = crank.analyse(shifted, excluded).value, crank.analyse(car(), excluded).value
    assert np.array_equal(ours.series.tangential, never.series.tangential)


@pytest.mark.parametrize(
    ("field", "scene"),
    [
        ("mechanism.offset", lambda: crank.Mechanism(0.04, 0.14, 50.0, 0.11)),
        ("mechanism.crank_radius", lambda: crank.Mechanism(0.15, 0.14, 50.0)),
        ("cylinder.strokes", lambda: crank.Cylinder(0.08, 0.0, 1e5, 3)),
        ("masses.rod_cg_from_pin", lambda: crank.RodMass(0.14, 0.6, 0.2)),
        ("masses.web_radius", lambda: crank.CrankThrow(0.1, 0.1, -0.1)),
        ("pressure.angle.1", lambda: crank.TablePressure((0.0, math.nan, 1.0), (1.0, 1.0, 1.0))),
        ("engine.positions", lambda: crank.Engine((0.0, 1.0), (0.0, 0.0), (0.0,))),
        ("accuracy", lambda: crank.analyse(car(), accuracy=0.5)),
    ],
)
def test_what_the_model_cannot_mean_is_refused_by_name(field, scene):
    with pytest.raises(InvalidInput) as refusal:
        scene()
    assert refusal.value.field == field
