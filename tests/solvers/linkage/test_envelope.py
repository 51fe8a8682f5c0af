"""Swept box and enclosing circle against sampled joints."""

from __future__ import annotations

import math

import pytest

from solvers.linkage.mechanism.change_point import KINDS, Gain
from solvers.linkage.mechanism.kinematics import of_family
from solvers.linkage.swept_area.bounding_box import minimum_box
from solvers.linkage.swept_area.enclosing_circle import enclosing_radius
from solvers.linkage.swept_area.outline import sweep
from tests.solvers.linkage import brute_force

CASES = [
    (kind, restitution, factor)
    for kind in KINDS
    for restitution, factor in ((0.05, 1.2), (0.175, 1.42), (0.3, 1.7), (0.6, 3.0))
]


@pytest.mark.parametrize(("kind", "restitution", "factor"), CASES)
@pytest.mark.parametrize("pad", [0.0, 0.4])
def test_box_and_circle_are_those_of_the_sampled_sweep(kind, restitution, factor, pad):
    p = KINDS[kind].parameter_limit(Gain(restitution)) * factor
    bar, crank = of_family(KINDS[kind], restitution, p), 1.7
    lambda0, lambda2, lambda3 = brute_force.ratios(kind, restitution, p)
    swept = brute_force.cycle(kind, (crank * lambda0, crank, crank * lambda2, crank * lambda3))
    area, _ = brute_force.minimum_box(swept, pad)
    box = minimum_box(sweep(bar, crank), pad)
    assert box.area == pytest.approx(area, rel=2e-5)
    assert enclosing_radius(sweep(bar, crank), pad) == pytest.approx(brute_force.enclosing_radius(swept, pad), rel=3e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_within_width_and_height_the_box_is_turned_and_never_smaller(kind):
    bar = of_family(KINDS[kind], 0.2, 3.1)
    outline = sweep(bar, 1.0)
    free = minimum_box(outline, 0.1)
    held = minimum_box(outline, 0.1, width=free.height * (1 + 1e-12), height=math.inf)
    assert held.width <= free.height * (1 + 1e-9)
    assert held.area >= free.area * (1 - 1e-9)
    turned = minimum_box(outline, 0.1, width=free.height * (1 + 1e-9), height=free.width * (1 + 1e-9))
    assert turned.area == pytest.approx(free.area, rel=1e-8)
    assert minimum_box(outline, 0.1, width=2.0, height=2.0) is None


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("restitution", [1e-6, 1.1e-5, 0.9])
@pytest.mark.parametrize("margin", [1e-6, 3e-3, 0.4, 50.0])
def test_the_enclosing_circle_exists_also_for_what_is_almost_a_kite(kind, restitution, margin):
    p = KINDS[kind].parameter_limit(Gain(restitution)) * (1 + margin)
    bar = of_family(KINDS[kind], restitution, p)
    lambda0, _, lambda3 = brute_force.ratios(kind, restitution, p)
    outline = sweep(bar, 1.0)
    found = enclosing_radius(outline, 0.0)
    assert math.isfinite(found)
    # It holds both circles that stand still, and is held by the circle about the base that holds everything.
    assert found >= max(1.0, (1.0 + lambda0) / 2) * (1 - 1e-12)
    assert found <= (lambda0 + max(1.0, lambda3) + 1.0) * (1 + 1e-12)
