"""Bounds of boxes of cones against shapes drawn in them, and the proof under a deflection limit."""

from __future__ import annotations

import numpy as np
import pytest

from solvers import pin
from solvers.pin.cone_bounds import hollow, second_order
from solvers.pin.cones import _Cones
from solvers.pin.flexibility import cowper
from solvers.pin.program import Physics, assemble, opening_stations
from tests.solvers.pin.pins import PAPER, VAZ


def cones(deflection, slope=None):
    limits = pin.Limits(max_deflection=deflection, max_slope=slope)
    law = cowper(VAZ.material.poisson)
    return _Cones(assemble(VAZ, limits, PAPER, Physics(), opening_stations(VAZ), law))


def boxes(random, count):
    for _ in range(count):
        width = 10.0 ** random.uniform(-5, -1.7, 2)
        low = random.uniform((0.0, 0.05), (1.0, 1.0)) * (1.0 - width)
        yield float(low[0]), float(low[0] + width[0]), float(low[1]), float(low[1] + width[1])


@pytest.mark.parametrize(("deflection", "slope"), [(8.5e-6, None), (11e-6, None), (13e-6, None), (11e-6, 0.2)])
def test_no_shape_of_a_box_holds_more_than_its_bound(deflection, slope):
    random, some = np.random.default_rng(7), cones(deflection, slope)
    for box in boxes(random, 60):
        bound = min(second_order(box, some._rules(box)), some.most(box))
        shapes = random.uniform((box[0], box[2]), (box[1], box[3]), (30, 2)).tolist()
        shapes += [(r, c) for r in box[:2] for c in box[2:]]
        assert max(some.gain(r, c) for r, c in shapes) <= bound * (1.0 + 1e-13)


def test_each_rules_slopes_hold_every_difference_in_the_box():
    random, some = np.random.default_rng(11), cones(11e-6)
    for box in boxes(random, 60):
        deflection = some._rules(box)[-1]
        for _ in range(10):
            r, c = random.uniform((box[0], box[2]), (box[1], box[3]))
            for side, (dr, dc) in ((0, (box[1] - r, 0.0)), (2, (0.0, box[3] - c))):
                step = dr + dc
                change = np.log(some._stiff(r + dr, c + dc)) - np.log(some._stiff(r, c))
                least, most = deflection.slopes[side : side + 2]
                assert least * step - 1e-13 <= change <= most * step + 1e-13


def test_on_a_ridge_of_two_rules_the_bound_loses_the_square_of_the_width():
    some = cones(11e-6)
    rows = np.linspace(0.41, 0.43, 401)
    # Along the ridge the full diameter is just what the deflection allows.
    ridge = []
    for r in rows:
        low, high = 0.7, 1.0
        for _ in range(50):
            c = 0.5 * (low + high)
            low, high = (c, high) if some._stiff(r, c) >= 1.0 else (low, c)
        ridge.append((hollow(r, low), r, low))
    best, r, c = max(ridge)
    lost = []
    for half in (4e-3, 1e-3):
        box = (r - half, r + half, c - half, c + half)
        lost.append(second_order(box, some._rules(box)) / best - 1.0)
    assert 0.0 <= lost[1] < lost[0] / 8.0


@pytest.mark.parametrize("limit", [8.5e-6, 11e-6, 11.22302193e-6, 13e-6])
def test_cones_with_cylinders_are_proven_under_a_deflection_limit(limit):
    form = pin.Cone(cylinder=True)
    outcome = pin.design(pin.PinProblem(VAZ, pin.Limits(max_deflection=limit), form), accuracy=1e-6)
    assert 0.0 <= outcome.certificate.gap <= 1e-7
    assert outcome.value.check.deflection <= limit * (1.0 + 1e-9)


@pytest.mark.parametrize(
    ("geometry", "force", "criterion"),
    [
        (pin.Geometry(1.574e-3, 3.457e-6, 1.794e-3), 214.0, "fibre"),
        (pin.Geometry(87.8e-3, 93.06e-6, 52.7e-3), 1e6, "fibre"),
        (pin.Geometry(5.65e-3, 2.93e-3, 11.94e-3), 500.0, "tresca_paper"),
    ],
)
def test_cones_of_unlike_sides_are_proven(geometry, force, criterion):
    """A cone of 0.4 % of the half, whose volume hardly knows its length; one that touches strength between stations."""
    scene = pin.Scene(geometry, force, pin.PinMaterial(250e6, 210e9, 0.3, 7850.0))
    solid = pin.check(scene, pin.Profile((0.0,), (0.0,)), pin.CRITERIA[criterion]).value.deflection
    limits = pin.Limits(max_deflection=2.0 * solid)
    outcome = pin.design(pin.PinProblem(scene, limits, pin.Cone(cylinder=True), pin.CRITERIA[criterion]))
    assert 0.0 <= outcome.certificate.gap <= 1e-7
    assert outcome.value.check.strength_utilisation <= 1.0 + 1e-6
    assert outcome.certificate.bound >= outcome.value.free_mass * (1.0 - 1e-6)
