"""Links that grow without end: proven with the rest, refused as designs, and told."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from solvers import linkage
from solvers.errors import InvalidInput
from solvers.linkage.limits import Limits
from solvers.linkage.optimum.family import Family
from tests.solvers.linkage.machines import BREAKER, CLEANER, CLEANER_LIMITS, KINDS, designed, of_members, problem

BLOW = linkage.Scene(linkage.Restitution(0.0739, 0.0739), 5.83, 1.2237, 0.375)


def test_a_certificate_holds_for_links_without_end_and_a_design_says_when_it_lies_there():
    """Without a limit on the size the least pin force is that of a base without end."""
    asked = problem(BLOW, linkage.Limits(), "pin_force", "largest_rocker")
    found = linkage.design(asked)
    assert "grow without end" in found.certificate.evidence["searched"]
    assert any("next to links without end" in said for said in found.value.check.warnings)
    family = Family(linkage.LARGEST_ROCKER, BLOW.restitution.gain)
    margins = np.geomspace(1e-12, 1e12, 4001)
    figures = of_members(asked, family, np.log(margins))
    costs = np.where(figures.fits, asked.objective.cost(figures), np.inf)
    assert 1e-5 < 1 - costs.min() / found.value.value < 1e-2
    assert found.certificate.bound <= costs.min()
    assert found.certificate.gap < 1.1 * (1 - costs.min() / found.value.value) + 2e-6
    longest = found.value.check.mechanism.crank * found.value.check.mechanism.bar.longest
    within = replace(asked, limits=linkage.Limits(longest_link=0.1 * longest))
    held = linkage.design(within)
    assert not any("designs end" in said for said in held.value.check.warnings)
    assert held.certificate.gap <= 1.1e-6


@pytest.mark.parametrize("restitution", [0.01, 0.2, 0.8])
@pytest.mark.parametrize("kind", KINDS)
def test_beyond_the_tails_nothing_changes_but_what_grows_without_end(kind, restitution):
    """Quantities per crank at both ends of the tails and a thousand times beyond."""
    scene = replace(BLOW, restitution=linkage.Restitution(restitution, restitution))
    family = Family(linkage.KINDS[kind], scene.restitution.gain)
    subproblem = problem(scene, Limits(), "peak_torque", kind)
    low, high = family.proof_range
    for end, step in ((low, -math.log(1e3)), (high, math.log(1e3))):
        near, far = (of_members(subproblem, family, np.array([q])) for q in (end, end + step))

        def told(figures):
            lengths = figures.lengths[0]
            return np.array([*lengths, figures.members.u31_end[0], figures.torque[0], figures.force[0]])

        change = told(far) / told(near)
        # Links and loads may grow without end; |u31(2 pi)|, the crank and the base may vanish.
        endless = change > 10.0
        endless[[0, 1, 4]] |= change[[0, 1, 4]] < 0.1
        assert np.all(endless | (np.abs(change - 1.0) < 1e-8))


def test_a_frequency_without_end_is_refused_and_the_missing_limit_named():
    """A rocker ten times as long beats ten times as often, as the check confirms."""
    scene = linkage.Scene(linkage.Restitution(0.2, 0.2), 20.0, 5.0, 10.0, tool_radius=0.05)
    limits = Limits(min_link=8e-3)
    asked = problem(scene, limits, "blow_frequency")
    with pytest.raises(InvalidInput, match="without end") as refusal:
        linkage.design(asked)
    assert refusal.value.field == "limits.longest_link"
    frequencies = []
    for base in (36.0, 360.0):
        family, gain = Family(linkage.LARGEST_ROCKER, scene.restitution.gain), scene.restitution.gain
        q = math.log(gain.square_minus_one / (base / 8e-3 - gain.square))
        member = of_members(asked, family, np.array([q]))
        assert member.members.ratios.base[0] == pytest.approx(base / 8e-3, rel=1e-9)
        frequencies.append(1.0 / asked.objective.cost(member)[0])
    assert frequencies[0] == pytest.approx(28655.85, rel=1e-3)
    assert frequencies[1] == pytest.approx(10 * frequencies[0], rel=1e-3)
    # One side of the box leaves the other free; the largest coupler's base ends at g^2 cranks.
    with pytest.raises(InvalidInput):
        designed(scene, replace(limits, width=0.1), "blow_frequency")
    for kinds, more in (
        (("largest_coupler",), {}),
        ((), {"longest_link": 50.0}),
        ((), {"enclosing_radius": 0.5}),
        ((), {"width": 0.2, "height": 0.2}),
        ((), {"width": 0.02}),
    ):
        outcome = designed(scene, replace(limits, **more), "blow_frequency", *kinds)
        assert outcome.certificate.gap < 5.1e-3
        if "longest_link" in more:
            # The longest links are what beats most often.
            assert outcome.value.value == pytest.approx(28655.85 * 50.0 / 36.028, rel=1e-3)


def test_a_limit_that_only_links_beyond_the_range_of_designs_keep_is_kept():
    """Between the least pin force of a design and that of links without end."""
    least = designed(BLOW, Limits(), "pin_force", "largest_rocker")
    held = Limits(max_pin_force=0.5 * (least.value.value + least.certificate.bound))
    outcome = designed(BLOW, held, "longest_link", "largest_rocker")
    assert outcome.value.check.strike.peaks.force <= held.max_pin_force * (1 + 1e-9)


def test_a_gap_that_the_tails_leave_is_not_narrowed_elsewhere():
    scene = replace(BREAKER, restitution=linkage.Restitution(0.09, 0.09))
    outcome = designed(scene, Limits(height=0.05), "impact_speed", "largest_base")
    assert 1e-3 < outcome.certificate.gap < 5.1e-3
    assert outcome.certificate.evidence["ranges_largest_base"] < 30_000


@pytest.mark.parametrize("kind", ["largest_coupler", "largest_rocker"])
def test_a_tool_may_settle_a_ratio_beyond_the_range_of_designs(kind):
    family = Family(linkage.KINDS[kind], CLEANER.restitution.gain)
    member = family.member(family.design_range[1] + 1.0)
    scene = replace(CLEANER, tool_radius=CLEANER.impact_speed / (CLEANER.crank_speed * member.u31_end))
    found = designed(scene, replace(CLEANER_LIMITS, transmission_angle=None), "longest_link", kind).value.check
    assert found.mechanism.bar.ratios.coupler == pytest.approx(member.ratios.coupler, rel=1e-6)
    assert found.strike.impact_speed == pytest.approx(scene.impact_speed, rel=1e-9)
