"""Effects of the rod as objects: an absent effect is not computed, and auto keeps within its tolerance."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from itertools import product

import numpy as np
import pytest

from solvers import rod
from solvers.rod.check import check_of
from solvers.rod.cycle import large_displacement
from solvers.rod.cycle.composition import Composition, Cycle
from solvers.rod.cycle.large_displacement import LargeDisplacement
from solvers.rod.effects import EFFECTS, choose_for, compose
from solvers.rod.vibration import steady_response
from solvers.rod.vibration.steady_response import RodInertia
from tests.solvers.rod.machines import PAPER, STRIP, random_machine

NAMES = tuple(effect.name for effect in EFFECTS)
HEAVY = replace(PAPER, piston=replace(PAPER.piston, reciprocating_mass=0.05))
MAIN = (
    "fatigue_safety", "yield_safety", "side_force_max", "clamp_moment_max", "contact_pressure_max", "friction_power",
)  # fmt: skip


def only(names):
    names = frozenset(names)
    return rod.EffectSelection(include=names, exclude=frozenset(NAMES) - names)


def test_the_effects_are_those_of_the_contract():
    assert set(NAMES) == {
        "reciprocating_inertia", "beam_column", "friction", "rod_inertia", "large_displacement", "shear",
        "friction_feedback",
    }  # fmt: skip
    assert len(NAMES) == 7


def by_hand(names):
    """The composition written out without the effects' own objects choosing it."""
    corrections = (LargeDisplacement(),) if "large_displacement" in names else ()
    corrections += (RodInertia(),) if "rod_inertia" in names else ()
    return Composition(
        moves="reciprocating_inertia" in names,
        couples="beam_column" in names,
        shears="shear" in names,
        feedback="friction_feedback" in names,
        corrections=corrections,
    )


def count_calls(monkeypatch):
    """Counters on the code that belongs to each effect."""
    calls = dict.fromkeys(NAMES, 0)

    def counted(owner, attribute, name):
        plain = getattr(owner, attribute)

        def wrapper(*arguments):
            calls[name] += 1
            return plain(*arguments)

        monkeypatch.setattr(owner, attribute, wrapper)

    counted(large_displacement.LargeDisplacement, "prepare", "large_displacement")
    counted(large_displacement.ElasticaExpansion, "add", "large_displacement")
    counted(steady_response.RodInertia, "prepare", "rod_inertia")
    counted(steady_response.SteadyVibration, "add", "rod_inertia")
    return calls


COUNTED = {"large_displacement", "rod_inertia"}


def parameters(cycle):
    """The effects whose terms are passed to the kernels."""
    strip, terms = cycle.strip, {"reciprocating_inertia": cycle.drive.mass}
    terms |= {"beam_column": strip.couples, "shear": strip.compliance, "friction_feedback": strip.friction}
    return {name for name, term in terms.items() if term}


def test_an_effect_left_out_is_the_scene_that_never_had_it(monkeypatch):
    """All combinations: bit for bit the same fields, and only the code of active effects is called."""
    angles, stations = np.linspace(0.0, 6.0, 5), [0.0, 0.5 * STRIP.l]
    for flags in product((False, True), repeat=len(NAMES)):
        names = {name for name, on in zip(NAMES, flags, strict=True) if on}
        choice = choose_for(HEAVY, STRIP, only(names))
        assert {effect.name for effect in choice.active} == names
        with monkeypatch.context() as patch:
            calls = count_calls(patch)
            cycle = Cycle(HEAVY, STRIP, compose(choice), 1e-2)
            chosen = cycle.at(angles)
        assert {name for name, count in calls.items() if count} == names & COUNTED
        assert parameters(cycle) == names - COUNTED - {"friction"}
        plain = Cycle(HEAVY, STRIP, by_hand(names), 1e-2).at(angles)
        assert chosen.force.tobytes() == plain.force.tobytes()
        for field in ("curvature", "fibre_stresses"):
            first, second = getattr(chosen, field)(stations), getattr(plain, field)(stations)
            assert first.tobytes() == second.tobytes()
        assert chosen.side_force().tobytes() == plain.side_force().tobytes()


@pytest.mark.parametrize("others", [{"beam_column"}, {"beam_column", "large_displacement"}])
def test_without_friction_its_results_do_not_exist_and_are_not_computed(monkeypatch, others):
    """A strip without corrections is checked in compiled code, which leaves results undefined that it does not
    compute."""
    rows = []

    def told(*arguments):
        rows.append(arguments[1])
        return check_of(*arguments)

    monkeypatch.setattr(import_module("solvers.rod.check"), "check_of", told)
    stresses = rod.check(PAPER, STRIP, only(others)).value.stresses
    assert stresses.contact_pressure_max is None
    assert stresses.friction_power is None
    assert np.isnan([rows[0].contact_load, rows[0].power]).all()
    assert stresses.fatigue_safety == pytest.approx(2.69747, rel=3e-3)


@pytest.mark.parametrize("name", [name for name in NAMES if name != "friction"])
def test_every_effect_changes_something_when_it_runs(name):
    angles = np.array([1.0, 4.0])
    base = {"beam_column"} - {name}
    with_it = Cycle(HEAVY, STRIP, compose(choose_for(HEAVY, STRIP, only(base | {name})))).at(angles)
    without = Cycle(HEAVY, STRIP, compose(choose_for(HEAVY, STRIP, only(base)))).at(angles)
    assert np.all(with_it.curvature([0.0]) != without.curvature([0.0]))


def main_results(scene, strip, effects, tolerance):
    outcome = rod.check(scene, strip, effects, tolerance, 1e-6)
    value = outcome.value
    found = {"stability_safety": value.stability_safety}
    if value.stresses is not None:
        found |= {name: getattr(value.stresses, name) for name in MAIN}
    skipped = {report.name for report in outcome.effects if report.state == "skipped"}
    return found, skipped


def test_auto_differs_from_all_by_no_more_than_the_tolerance():
    """Random machines over the whole range of tolerances; and auto does leave effects out."""
    rng = np.random.default_rng(20)
    left_out = set()
    for _ in range(8):
        scene, strip = random_machine(rng)
        scene = replace(scene, piston=replace(scene.piston, reciprocating_mass=10 ** rng.uniform(-4.0, -1.0)))
        everything, _ = main_results(scene, strip, rod.ALL, 1e-2)
        for tolerance in (1e-1, 1e-3):
            found, skipped = main_results(scene, strip, rod.AUTO, tolerance)
            left_out |= skipped
            assert found.keys() == everything.keys()
            for name, value in everything.items():
                assert found[name] == pytest.approx(value, rel=tolerance + 3e-6), (name, tolerance, skipped)
    assert {"shear", "large_displacement", "friction_feedback", "rod_inertia"} <= left_out
