"""Designs: the reference optima to every printed digit, and nothing better in a dense search."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from solvers import linkage
from solvers.errors import EffectConflict, InvalidInput
from solvers.linkage.limits import Limits
from tests.solvers.linkage import brute_force
from tests.solvers.linkage.machines import BREAKER, BREAKER_LIMITS, CLEANER, CLEANER_LIMITS, KINDS, designed, problem


@pytest.mark.parametrize(
    ("scene", "limits", "kind", "areas", "lengths", "box", "angle"),
    [
        (BREAKER, BREAKER_LIMITS, "largest_coupler", (1412.2836, 3617.795, 18038.985),
         (8.96034, 13.55177, 18.04777, 13.45634), (47.20, 29.92), 19.376),
        (CLEANER, CLEANER_LIMITS, "largest_base", (None, None, 5834.4929),
         (23.248532, 73.780769, 50.532237, 46.497065), (103.2707, 56.4971), 18.367),
    ],
    ids=["breaker", "pipe cleaner"],
)  # fmt: skip
def test_the_examples_of_least_box(scene, limits, kind, areas, lengths, box, angle):
    outcome = designed(scene, limits, "box_area")
    found, links = outcome.value.check, outcome.value.check.mechanism.lengths
    assert found.mechanism.bar.kind.name == kind
    shown = [1e3 * length for length in (links.crank, links.base, links.coupler, links.rocker)]
    assert shown == pytest.approx(lengths, abs=6e-6)
    assert (found.box.width * 1e3, found.box.height * 1e3) == pytest.approx(box, abs=5e-3)
    assert math.degrees(found.box.angle) == pytest.approx(angle, abs=6e-4)
    for alternative, area in zip(outcome.value.alternatives, areas, strict=True):
        assert (alternative.mechanism is None) == bool(alternative.reason) == (area is None)
        assert area is None or alternative.value * 1e6 == pytest.approx(area, abs=6e-4)
    assert outcome.value.value == min(a.value for a in outcome.value.alternatives if a.value is not None)
    assert outcome.certificate.bound <= outcome.value.value
    assert outcome.certificate.gap <= 1.1e-6


def test_the_least_boxes_of_the_examples_lie_at_corners():
    breaker = designed(BREAKER, BREAKER_LIMITS, "box_area").value.check.mechanism.bar.ratios
    cleaner = designed(CLEANER, CLEANER_LIMITS, "box_area").value.check.mechanism.bar.ratios
    assert float(breaker.coupler) == pytest.approx(math.sqrt(2) * BREAKER.restitution.gain.value, rel=1e-9)
    assert float(cleaner.rocker) == pytest.approx(2.0, rel=1e-9)


@pytest.mark.parametrize(
    ("scene", "limits", "objective", "kind", "value", "ratio", "within"),
    [
        (BREAKER, BREAKER_LIMITS, "longest_link", "largest_coupler", 16.272e-3, None, 5e-7),
        (BREAKER, BREAKER_LIMITS, "longest_link", "largest_rocker", 52.660e-3, None, 5e-7),
        (BREAKER, BREAKER_LIMITS, "longest_link", "largest_base", 106.831e-3, None, 5e-7),
        (BREAKER, BREAKER_LIMITS, "peak_torque", "largest_base", 7.4369, 4.0637, 5e-4),
        (BREAKER, BREAKER_LIMITS, "pin_force", "largest_base", 261.08, 9.0904, 5e-3),
        (CLEANER, CLEANER_LIMITS, "peak_torque", "largest_base", 1.37028, 4.7032, 5e-6),
        (CLEANER, CLEANER_LIMITS, "pin_force", "largest_base", 96.466, 7.7632, 6e-4),
    ],
)
def test_further_optima_of_the_examples(scene, limits, objective, kind, value, ratio, within):
    found = designed(scene, limits, objective, kind).value
    assert found.value == pytest.approx(value, abs=within)
    if ratio is not None:
        # The torque is flat about its least value, so its place is known to half as many digits.
        assert float(found.check.mechanism.bar.ratios.base) == pytest.approx(ratio, abs=6e-4)


def test_loads_where_the_breakers_box_is_least():
    expected = {"largest_coupler": (25.48, 5309), "largest_rocker": (12.72, 2254), "largest_base": (17.05, 543)}
    for kind, (torque, force) in expected.items():
        peaks = designed(BREAKER, BREAKER_LIMITS, "box_area", kind).value.check.strike.peaks
        assert peaks.torque == pytest.approx(torque, abs=6e-3)
        assert peaks.force == pytest.approx(force, abs=0.6)


def allowed(kind: str, restitution: float, p: float, limits: Limits, lengths: tuple[float, ...]) -> bool:
    square = ((1 + restitution) / (1 - restitution)) ** 2
    if p <= (square if kind == "largest_rocker" else math.sqrt(square)) * (1 + 1e-6):
        return False
    if min(lengths) < limits.min_link or (limits.longest_link and max(lengths) > limits.longest_link):
        return False
    nu = 2 * math.asin(min(math.sqrt(square) / brute_force.ratios(kind, restitution, p)[1], 1.0))
    return limits.transmission_angle[0] <= nu <= limits.transmission_angle[1]


def sized(kind: str, scene: linkage.Scene, p: float) -> tuple[float, ...]:
    """Lengths from speed and frequency: l3 omega |u31(2 pi)| = v."""
    lambda0, lambda2, lambda3 = brute_force.ratios(kind, scene.restitution.middle, p)
    g = math.sqrt(lambda0 * lambda2 / lambda3)
    end = (g + 1) / (lambda0 + 1 if kind == "largest_base" else lambda0 - 1)
    crank = scene.impact_speed / (scene.crank_speed * lambda3 * end)
    return crank * lambda0, crank, crank * lambda2, crank * lambda3


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("objective", ["box_area", "enclosing_radius"])
def test_no_sampled_mechanism_is_smaller(kind, objective):
    scene = replace(BREAKER, restitution=linkage.Restitution(0.1, 0.22))
    limits = Limits(min_link=6e-3, joint_radius=4e-3)
    outcome = designed(scene, limits, objective, kind)
    least = math.inf
    for p in np.geomspace(1.01, 30.0, 90):
        lengths = sized(kind, scene, p)
        if not allowed(kind, scene.restitution.middle, p, limits, lengths):
            continue
        swept = brute_force.cycle(kind, lengths, 241)
        measure = brute_force.minimum_box if objective == "box_area" else brute_force.enclosing_radius
        found = measure(swept, limits.joint_radius)
        least = min(least, found[0] if objective == "box_area" else found)
    # Sampled joints miss a little of the sweep; sampled ratios miss a little of the optimum.
    assert outcome.certificate.bound <= least * (1 + 1e-3)
    assert outcome.value.value <= least * (1 + 1e-3)
    assert outcome.value.value >= least * (1 - 0.05)


@pytest.mark.parametrize("objective", ["peak_torque", "pin_force"])
@pytest.mark.parametrize("kind", KINDS)
def test_no_sampled_mechanism_carries_less(kind, objective):
    limits = Limits(min_link=8e-3, joint_radius=6e-3, longest_link=0.2)
    outcome = designed(BREAKER, limits, objective, kind)
    least = math.inf
    for p in np.geomspace(1.01, 60.0, 300):
        lengths = sized(kind, BREAKER, p)
        if allowed(kind, BREAKER.restitution.middle, p, limits, lengths):
            _, torque, force = brute_force.loads(brute_force.cycle(kind, lengths, 721), BREAKER.impact_energy)
            # At the ends force and lever both vanish: what lies there is extrapolated.
            ends = (3 * f[4] - 3 * f[8] + f[12] for f in (force, force[::-1]))
            peak = max(force[4:-4].max(), *ends)
            least = min(least, np.abs(torque).max() if objective == "peak_torque" else peak)
    assert outcome.certificate.bound <= least * (1 + 2e-3)
    assert outcome.value.value == pytest.approx(least, rel=2e-2)


def test_limits_hold_and_are_told_where_they_shape_the_answer():
    limits = Limits(min_link=8e-3, joint_radius=6e-3, max_pin_force=2500.0, width=0.12, height=0.08)
    outcome = designed(BREAKER, limits, "box_area")
    check = outcome.value.check
    assert check.mechanism.bar.kind is linkage.LARGEST_ROCKER
    assert check.strike.peaks.force <= 2500.0 * (1 + 1e-9)
    assert check.box.width <= 0.12 * (1 + 1e-9)
    tight = designed(BREAKER, replace(limits, max_pin_force=2000.0), "box_area").value
    assert tight.value >= outcome.value.value
    assert "max_pin_force" in tight.active_limits


def test_greatest_speed_and_frequency_in_a_given_box():
    limits = Limits(min_link=8e-3, joint_radius=6e-3, width=0.08, height=0.06)
    fast = designed(BREAKER, limits, "impact_speed")
    assert fast.value.check.box.width <= 0.08 * (1 + 1e-9)
    assert fast.value.value == pytest.approx(fast.value.check.strike.impact_speed, rel=1e-9)
    # The same box can be reached at that speed, but not at a higher one.
    same = designed(replace(BREAKER, impact_speed=fast.value.value * 0.999), limits, "longest_link")
    more = designed(replace(BREAKER, impact_speed=fast.value.value * 1.001), limits, "longest_link")
    assert same.value is not None
    assert more.value is None
    often = designed(BREAKER, limits, "blow_frequency").value
    assert often.check.strike.impact_speed == pytest.approx(BREAKER.impact_speed, rel=1e-9)
    assert often.scene.blow_frequency == pytest.approx(often.value, rel=1e-12)


def test_a_tool_at_its_own_radius_settles_the_ratio_and_leaves_the_size():
    scene = replace(CLEANER, tool_radius=0.06)
    found = designed(scene, CLEANER_LIMITS, "box_area").value.check
    assert found.strike.impact_speed == pytest.approx(scene.impact_speed, rel=1e-9)
    lengths = found.mechanism.lengths
    assert min(lengths.base, lengths.crank, lengths.coupler, lengths.rocker) == pytest.approx(12e-3, rel=1e-9)


def test_what_makes_no_sense_is_refused():
    with pytest.raises(InvalidInput, match="types"):
        linkage.LinkageProblem(BREAKER, BREAKER_LIMITS, linkage.OBJECTIVES["box_area"], ())
    with pytest.raises(InvalidInput):
        problem(BREAKER, Limits(), "impact_speed")
    with pytest.raises(InvalidInput):
        problem(replace(BREAKER, tool_radius=0.1), Limits(), "box_area")
    without = linkage.EffectSelection(exclude=frozenset({"envelope"}))
    with pytest.raises(EffectConflict):
        designed(BREAKER, BREAKER_LIMITS, "box_area", effects=without)


def test_without_the_envelope_nothing_of_it_is_told():
    without = linkage.EffectSelection(exclude=frozenset({"envelope"}))
    found = designed(BREAKER, BREAKER_LIMITS, "longest_link", effects=without).value
    assert found.check.box is None
    assert found.check.enclosing_radius is None
    assert found.value == designed(BREAKER, BREAKER_LIMITS, "longest_link").value.value


def test_what_is_asked_loosely_is_answered_by_less_work():
    ranges, values = [], []
    for accuracy in (1e-2, 1e-4, 1e-6):
        outcome = designed(BREAKER, BREAKER_LIMITS, "peak_torque", accuracy=accuracy)
        assert outcome.certificate.gap <= 1.1 * accuracy
        ranges.append(sum(n for name, n in outcome.certificate.evidence.items() if name.startswith("ranges_")))
        values.append(outcome.value.value)
    assert ranges[0] < ranges[1] < ranges[2]
    assert values == pytest.approx([values[2]] * 3, rel=1e-6)


def test_a_low_box_about_a_long_base_is_proven_too():
    # All members that the least link allows are nearly as high as the box.
    scene = linkage.Scene(linkage.Restitution(0.002656, 0.002656), 20.0, 8.0, 10.0, tool_radius=0.0471)
    limits = Limits(min_link=0.0132, height=0.03829, transmission_angle=None)
    outcome = designed(scene, limits, "blow_frequency")
    assert outcome.value is not None
    assert outcome.certificate.gap <= 1.1e-6
