"""Limits at or hardly above what is attainable."""

from __future__ import annotations

from dataclasses import replace

import pytest

from solvers import linkage
from solvers.linkage.limits import Limits
from tests.solvers.linkage.machines import BREAKER, designed


@pytest.mark.parametrize("room", [1e-3, 1e-5, 1e-7])
def test_limits_hardly_above_what_is_attainable_are_met(room):
    scene = linkage.Scene(linkage.Restitution(0.336, 0.336), 36.5, 3.0, 2.4)
    limits = Limits(joint_radius=2e-3, transmission_angle=None)
    kinds = "largest_coupler", "largest_base"
    least = designed(scene, limits, "enclosing_radius", *kinds).value.value
    for objective in ("pin_force", "peak_torque", "longest_link"):
        held = replace(limits, enclosing_radius=least * (1 + room))
        assert designed(scene, held, objective, *kinds).value is not None
        assert designed(scene, replace(limits, enclosing_radius=least * (1 - room)), objective, *kinds).value is None


def test_a_linkage_that_fits_its_box_only_aslant_is_told_in_that_box():
    scene = replace(BREAKER, tool_radius=0.072223)
    limits = Limits(5e-3, 2e-3, width=0.19, height=0.224)
    box = designed(scene, limits, "blow_frequency").value.check.box
    assert box.width <= limits.width * (1 + 1e-9) and box.height <= limits.height * (1 + 1e-9)


@pytest.mark.parametrize("objective", ["box_area", "longest_link", "blow_frequency"])
@pytest.mark.parametrize("limit", ["min_link", "longest_link", "enclosing_radius"])
def test_limits_that_the_answer_just_meets_leave_it_as_it_is(objective, limit):
    """Two limits then meet in a single mechanism."""
    scene = linkage.Scene(linkage.Restitution(0.02, 0.3), 17.7, 7.0, 10.0)
    limits = Limits(10e-3, 2e-3, width=0.4, height=0.3, transmission_angle=(0.7, 2.4))
    best = designed(scene, limits, objective).value
    links = best.check.mechanism.links
    reached = {"min_link": min(links), "longest_link": max(links), "enclosing_radius": best.check.enclosing_radius}
    held = designed(scene, replace(limits, **{limit: float(reached[limit])}), objective)
    assert held.value.value == pytest.approx(best.value, rel=1e-6)


@pytest.mark.parametrize("room", [1e-6, 1e-4, 1e-2])
def test_a_limit_that_the_best_linkage_keeps_anyway_does_not_change_it(room):
    scene = linkage.Scene(linkage.Restitution(0.115, 0.115), 13.99, 3.394, 0.7619)
    limits = Limits(6.735e-3, 4.395e-3, width=0.07179, transmission_angle=(0.3121, 2.728))
    best = designed(scene, limits, "peak_torque").value
    held = designed(scene, replace(limits, height=best.check.box.height * (1 + room)), "peak_torque")
    assert held.value.value == pytest.approx(best.value, rel=2e-6)
    assert held.certificate.gap <= 1.1e-6


@pytest.mark.parametrize("restitution", [0.035, 0.04, 0.045, 0.05, 0.055])
def test_the_box_and_the_crank_of_the_answer_leave_it_as_it_is(restitution):
    """Of a long slender linkage only members that agree to 1e-11 keep to all of them."""
    scene = linkage.Scene(linkage.Restitution(restitution, restitution), 20.0, 6.0, 10.0)
    limits = Limits(min_link=8e-3, enclosing_radius=0.5, max_pin_force=300.0)
    answer = designed(scene, limits, "blow_frequency", "largest_base", effects=linkage.ALL).value
    box, crank = answer.check.box, answer.check.mechanism.crank
    just = replace(
        limits, min_link=crank, width=box.width, height=box.height, enclosing_radius=answer.check.enclosing_radius
    )
    again = designed(scene, just, "blow_frequency", "largest_base").value
    assert again is not None
    assert again.value == pytest.approx(answer.value, rel=1e-8)


@pytest.mark.parametrize("room", [0.0, 1e-10, 1e-8])
@pytest.mark.parametrize("limit", ["longest_link", "enclosing_radius"])
@pytest.mark.parametrize("objective", ["impact_speed", "blow_frequency"])
def test_a_size_hardly_above_the_least_that_the_least_link_allows_is_met_at_once(objective, limit, room):
    """There the two limits meet in a smooth minimum."""
    scene = linkage.Scene(linkage.Restitution(0.42, 0.42), 14.6, 1.0, 110.3)
    asked = Limits(min_link=27.79e-3, transmission_angle=None, **{limit: 0.05})
    (entry,) = designed(scene, asked, objective, "largest_rocker").diagnosis
    outcome = designed(scene, replace(asked, **{limit: entry.attainable * (1 + room)}), objective, "largest_rocker")
    assert outcome.certificate.gap <= 1.1e-6
    assert outcome.certificate.evidence["ranges_largest_rocker"] < 1000
