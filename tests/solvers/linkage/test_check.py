"""Checks: what a given linkage is and does, also where it cannot turn, cannot strike, or does not close."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from solvers import linkage
from solvers.errors import InvalidInput
from solvers.outcome import EffectState
from tests.solvers.linkage.machines import BREAKER, CLEANER, CLEANER_LIMITS


def checked(lengths: tuple[float, float, float, float], scene: linkage.Scene = CLEANER, **more):
    return linkage.check(scene, linkage.of_lengths(linkage.Lengths(*lengths)), **more).value


def test_a_ratio_gives_the_speed_asked_for():
    found = linkage.check(CLEANER, linkage.of_ratio(CLEANER, linkage.LARGEST_BASE, 3.17356675), CLEANER_LIMITS).value
    assert found.strike.impact_speed == pytest.approx(5.0, rel=1e-14)
    assert found.mechanism.bar.restitution == pytest.approx(0.3, rel=1e-14)
    assert found.box.area * 1e6 == pytest.approx(5834.4929, abs=1e-4)
    assert found.warnings == ()


def test_lengths_are_the_same_mechanism_as_their_ratio():
    by_ratio = linkage.check(CLEANER, linkage.of_ratio(CLEANER, linkage.LARGEST_COUPLER, 2.5)).value
    links = by_ratio.mechanism.lengths
    by_lengths = checked((links.base, links.crank, links.coupler, links.rocker))
    assert by_lengths.mechanism.bar.kind is linkage.LARGEST_COUPLER
    assert by_lengths.transfer == pytest.approx(by_ratio.transfer, rel=1e-11, abs=1e-12)
    assert by_lengths.strike.peaks.force == pytest.approx(by_ratio.strike.peaks.force, rel=1e-10)
    assert by_lengths.box.area == pytest.approx(by_ratio.box.area, rel=1e-10)


def test_a_crank_that_cannot_turn_is_confined_and_told_so():
    bar = linkage.of_ratio(CLEANER, linkage.LARGEST_COUPLER, 1.0)
    found = linkage.check(CLEANER, bar).value
    assert not found.mechanism.rotatable
    # The links stop where coupler and rocker lie on one line with the crank pin.
    r = bar.bar.ratios
    wall = math.acos((float(r.base) ** 2 + 1 - (float(r.coupler) + float(r.rocker)) ** 2) / (2 * float(r.base)))
    assert found.mechanism.confined == pytest.approx(wall, rel=1e-12)
    inside = np.minimum(found.angles, 2 * math.pi - found.angles)
    assert inside.max() < wall
    assert np.isfinite(found.transfer).all()
    assert found.box is None
    assert any("cannot turn" in text for text in found.warnings)


@pytest.mark.parametrize("exponent", range(2, 15))
@pytest.mark.parametrize("sign", [1, -1])
def test_missed_closures_get_a_window_instead_of_a_curve(exponent, sign):
    miss = sign * 10.0**-exponent
    found = checked((0.02, 0.01, 0.04 + miss * 0.01, 0.03))
    if exponent >= 12:
        assert found.window is None
        assert found.strike is not None
        return
    assert found.strike is None
    # A longer coupler is a deficit of the largest coupler's closure.
    assert found.window.blocked == (sign > 0)
    assert found.mechanism.rotatable == (sign < 0)
    assert any("miss the closure" in text for text in found.warnings)


@pytest.mark.parametrize(
    ("lengths", "field"),
    [((0.0, 1, 2, 2), "base"), ((2, -1, 2, 2), "crank"), ((9, 1, 4, 3), "base"), ((2, 1, math.nan, 3), "coupler"),
     ((2, 1, 3, math.inf), "rocker"), ((7, 1, 3, 3), "base")],
)  # fmt: skip
def test_links_that_are_none_are_refused(lengths, field):
    with pytest.raises(InvalidInput) as refused:
        linkage.Lengths(*lengths)
    assert refused.value.field == f"lengths.{field}"


def test_a_kite_never_strikes_back():
    found = checked((0.03, 0.03, 0.05, 0.05))
    assert found.strike is None
    assert any("cannot strike" in text for text in found.warnings)


def test_warnings_say_what_a_user_should_know():
    slow = linkage.check(CLEANER, linkage.of_ratio(CLEANER, linkage.LARGEST_BASE, 2.4)).value
    assert any("in mid-cycle as at the blow" in text for text in slow.warnings)
    edge = linkage.check(CLEANER, linkage.of_ratio(CLEANER, linkage.LARGEST_BASE, 2.5787)).value
    assert not any("in mid-cycle as at the blow" in text for text in edge.warnings)
    fast = replace(BREAKER, impact_speed=12.0)
    found = linkage.check(fast, linkage.of_ratio(fast, linkage.LARGEST_COUPLER, 2.1)).value
    assert any("striking parts fail early" in text for text in found.warnings)
    flat = linkage.check(CLEANER, linkage.of_ratio(CLEANER, linkage.LARGEST_COUPLER, 30.0)).value
    assert any("transmission angle" in text for text in flat.warnings)
    assert any("may differ" in text for text in found.warnings)


def test_greatest_u31_is_the_greatest_of_the_curve():
    found = linkage.check(CLEANER, linkage.of_ratio(CLEANER, linkage.LARGEST_BASE, 1.95)).value
    dense = np.linspace(1e-9, math.pi, 200_001)
    curve = np.abs(np.concatenate([found.mechanism.bar.transfer(dense), found.mechanism.bar.transfer(-dense)]))
    assert found.strike.peaks.u31 == pytest.approx(curve.max(), rel=1e-8)


def test_effects_run_only_where_they_are_called_for_and_their_data_are_there():
    bar = linkage.of_ratio(CLEANER, linkage.LARGEST_BASE, 3.2)
    plain = linkage.check(CLEANER, bar)
    states = {effect.name: effect.state for effect in plain.effects}
    assert states["envelope"] is EffectState.ACTIVE
    assert plain.value.running is None
    assert plain.value.coupler_peak is None
    motor = linkage.Drive(5.0, 2 * math.pi * 27, 2e-3)
    full = replace(CLEANER, drive=motor, coupler_stiffness=2e7, length_tolerance=2e-5)
    everything = linkage.check(full, bar, effects=linkage.ALL)
    assert all(effect.state is EffectState.ACTIVE for effect in everything.effects)
    assert everything.value.running is not None
    # What a last digit of R makes of the root of 2 k_c E.
    assert everything.value.coupler_peak <= 2.0**-50 * math.sqrt(2 * 2e7 * CLEANER.impact_energy)
    assert everything.value.tolerance_window.blocked
    assert np.array_equal(everything.value.transfer, plain.value.transfer)
    left_out = linkage.check(full, bar, effects=linkage.EffectSelection(exclude=frozenset({"envelope"})))
    assert left_out.value.box is None
    with pytest.raises(InvalidInput):
        linkage.check(CLEANER, bar, effects=linkage.EffectSelection(include=frozenset({"impact_dynamics"})))


def test_what_is_out_of_range_is_refused():
    for wrong in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(InvalidInput):
            linkage.of_ratio(CLEANER, linkage.LARGEST_BASE, wrong)
    with pytest.raises(InvalidInput, match="mechanism of this type"):
        linkage.of_ratio(CLEANER, linkage.LARGEST_ROCKER, 3.0)
    for low, high in ((0.0, 0.3), (0.4, 0.2), (0.3, 1.0), (math.nan, 0.3)):
        with pytest.raises(InvalidInput):
            linkage.Restitution(low, high)
    with pytest.raises(InvalidInput):
        linkage.Limits(joint_radius=5e-3, width=9e-3)
    with pytest.raises(InvalidInput):
        linkage.Limits(transmission_angle=(2.0, 1.0))
