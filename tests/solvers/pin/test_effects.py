"""Effects: their bounds hold, and an omitted effect leaves no trace and runs no code."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

from solvers import pin
from solvers.errors import EffectConflict
from solvers.pin.effects import Physics
from solvers.pin.optimum.program import assemble
from solvers.pin.ring import ovalization
from solvers.pin.stations.lobatto_panels import initial_stations
from tests.solvers.pin.pins import BENDING_ONLY, GEOMETRY, STEEL, VAZ

CORE = pin.EffectSelection(exclude=frozenset(effect.name for effect in pin.EFFECTS))


def scenes(count):
    rng = np.random.default_rng(8)
    for _ in range(count):
        outer = 10 ** rng.uniform(-3, -1)
        a, b, gap = outer * 10 ** rng.uniform(-1, 1.3, 3)
        material = replace(STEEL, poisson=rng.uniform(0, 0.49))
        yield pin.Scene(pin.Geometry(outer, a, b, gap), 10 ** rng.uniform(0, 5), material)


@pytest.mark.parametrize("form", ["one bore", "thin", "tapered", "stepped"])
def test_the_bound_on_shear_holds(form):
    rng = np.random.default_rng(4)
    for scene in scenes(60):
        bound = pin.EFFECTS[0].influence(scene)
        assert 0 < bound <= 1
        D, half = scene.geometry.outer_diameter, 0.5 * scene.geometry.length
        low, high = (0.98 * D, (1 - 1e-6) * D) if form == "thin" else (0.0, 0.95 * D)
        first, last = rng.uniform(low, high, 2)
        bore = {
            "one bore": pin.Profile((0.0,), (first,)),
            "thin": pin.Profile((0.0,), (first,)),
            "tapered": pin.Profile((0.0, half), (first, first * rng.uniform(0.9, 1.0))),
            "stepped": pin.Profile(
                (0.0, 0.7 * half, 0.7 * half, half), (first, first, min(first, last), min(first, last))
            ),
        }[form]
        both = pin.check(scene, bore, effects=pin.ALL, accuracy=1e-9).value.deflection
        bent = pin.check(scene, bore, effects=BENDING_ONLY, accuracy=1e-9).value.deflection
        assert bent < both
        share = (both - bent) / both
        assert share <= bound * (1 + 1e-9)
        if form in ("one bore", "thin"):
            assert share <= bound / 1.5 * (1 + 1e-9) or bound == 1.0


def test_slender_pins_go_without_shear():
    slender = pin.Scene(pin.Geometry(1e-3, 0.5, 0.5, 0.5), 1.0, STEEL)
    outcome = pin.check(slender, pin.Profile((0.0,), (0.5e-3,)))
    states = {report.name: str(report.state) for report in outcome.effects}
    assert states["shear_deflection"] == "skipped"
    exact = pin.check(slender, pin.Profile((0.0,), (0.5e-3,)), effects=pin.ALL).value.deflection
    assert outcome.value.deflection == pytest.approx(exact, rel=1e-2)


def test_what_is_left_out_is_as_if_it_had_never_been():
    """Bit for bit: masses, bores, stresses and bending do not know whether ring and pressures were computed."""
    bare, full = (pin.design(pin.PinProblem(VAZ), effects, accuracy=1e-8).value.check for effects in (CORE, pin.ALL))
    for name in ("mass", "min_bore", "bore_mid", "equivalent_stress_max", "force_limit", "constant_mass"):
        assert getattr(bare, name) == getattr(full, name), name
    for name in ("x", "bore", "equivalent"):
        assert np.array_equal(getattr(bare.along, name), getattr(full.along, name))
    assert bare.ring is None
    assert bare.pressures is None


def test_none_of_its_code_runs(monkeypatch):
    def never(*_args, **_named):
        raise AssertionError("an effect that was left out ran")

    monkeypatch.setattr(ovalization, "ring", never)
    monkeypatch.setattr(ovalization, "greatest_ratio", never)
    monkeypatch.setattr(sys.modules["solvers.pin.check"], "bearing_pressures", never)
    for found in (
        pin.design(pin.PinProblem(VAZ), CORE).value.check,
        pin.check(VAZ, pin.Profile((0.0,), (14e-3,)), effects=CORE).value,
    ):
        assert found.ring is None
        assert not any("ring" in warning for warning in found.warnings)
    with pytest.raises(AssertionError, match="left out"):
        assert pin.check(VAZ, pin.Profile((0.0,), (14e-3,))).value.ring


def test_shears_coefficients_are_zero_without_it():
    found = assemble(VAZ, pin.Limits(), pin.CRITERIA["fibre"], Physics(shear_deflection=False), initial_stations(VAZ))
    assert not found.shear.any()
    assert found.bending.any()


def test_a_limit_calls_for_its_effect():
    limits = pin.Limits(max_ovalization=2e-5)
    outcome = pin.design(pin.PinProblem(VAZ, limits))
    reason = next(report.why for report in outcome.effects if report.name == "ovalization")
    assert "limits.max_ovalization" in reason
    with pytest.raises(EffectConflict) as refusal:
        pin.design(pin.PinProblem(VAZ, limits), CORE)
    assert refusal.value.needed_by == "limits.max_ovalization"


def test_leaving_shear_out_halves_the_truth():
    bore = pin.Profile((0.0,), (13.99e-3,))
    both = pin.check(VAZ, bore).value.deflection
    assert both / pin.check(VAZ, bore, effects=BENDING_ONLY).value.deflection == pytest.approx(1.85, abs=0.01)
    assert GEOMETRY.length == 80e-3
