"""Bounds on ranges of linkages: below every member within, and close to the least."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from solvers import linkage
from solvers.linkage.limits import Limits
from solvers.linkage.optimum.family import Family
from solvers.linkage.optimum.quantities import Quantities
from tests.solvers.linkage.machines import KINDS, of_members, problem

SHARES = (0.0, 0.27, 0.5, 0.81, 1.0)
"""Of a range: where a member is looked at."""


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("restitution", [0.003, 0.2, 0.8])
def test_bounds_of_ranges_lie_below_every_member_within(kind, restitution):
    scene = linkage.Scene(linkage.Restitution(restitution, restitution), 20.0, 8.0, 10.0)
    limits = Limits(min_link=1e-6, joint_radius=2e-3, width=0.3, height=0.05)
    subproblem = problem(scene, replace(limits, width=None, height=None), "box_area", kind)
    fitted = problem(scene, limits, "impact_speed", kind)
    family = Family(linkage.KINDS[kind], scene.restitution.gain)
    rng = np.random.default_rng(5)
    low = rng.uniform(-9.0, 5.0, 300)
    high = low + 10 ** rng.uniform(-4.0, -0.1, 300)
    sizes = (np.full(300, subproblem.fixed_scale),) * 2
    area = Quantities(subproblem, family, low, high, math.inf).area(sizes)
    side = Quantities(subproblem, family, low, high, math.inf).side(sizes, 0.3)
    ranges = Quantities(fitted, family, low, high, math.inf)
    for share in SHARES:
        q = low + share * (high - low)
        member = of_members(subproblem, family, q)
        assert np.all(area <= member.area(sizes) * (1 + 1e-9))
        assert np.all(side <= member.side(sizes, 0.3) * (1 + 1e-9))
        fit = of_members(fitted, family, q).misfit(fitted.room, sizes)
        assert np.all(ranges.misfit(fitted.room, sizes) <= fit * (1 + 1e-9))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("restitution", [1e-4, 0.2, 0.8])
@pytest.mark.parametrize("quantity", ["torque", "force", "radius"])
def test_bounds_lie_below_every_member_within_and_close_in_by_the_square_of_the_width(kind, restitution, quantity):
    scene = linkage.Scene(linkage.Restitution(restitution, restitution), 20.0, 8.0, 10.0)
    subproblem = problem(scene, Limits(), "peak_torque", kind)
    family = Family(linkage.KINDS[kind], scene.restitution.gain)
    rng = np.random.default_rng(6)
    low = rng.uniform(-9.0, 5.0, 80)
    width = 10 ** rng.uniform(-3.0, -0.3, 80)
    unit = (np.ones(80),) * 2

    def told(figures):
        return figures.radius(unit) if quantity == "radius" else getattr(figures, quantity)

    bound = told(Quantities(subproblem, family, low, low + width, math.inf))
    members = [told(of_members(subproblem, family, low + share * width)) for share in SHARES]
    least = np.min(members, axis=0)
    assert np.all(bound <= least * (1 + 1e-10))
    narrow = width < 0.03
    assert np.quantile((1 - bound / least)[narrow] / width[narrow] ** 2, 0.75) < 30.0
