"""A share of the rivals that want to win, and searches broken on purpose, which they must notice."""

from __future__ import annotations

import numpy as np
import pytest

from bench.campaign import local_rivals
from solvers import linkage, pin
from solvers.linkage.family import Family
from solvers.pin import cones
from solvers.pin import program as pin_program
from solvers.pin.flexibility import ShearFlexibility

VAZ = pin.Scene(pin.Geometry(21.99e-3, 24e-3, 30e-3, 1e-3), 15e3, pin.PinMaterial(150e6, 210e9, 0.3, 7850.0))
SHORT = pin.Scene(pin.Geometry(30e-3, 6e-3, 24e-3, 0.5e-3), 12e3, pin.PinMaterial(150e6, 210e9, 0.3, 7850.0))
FORMS = (
    pin.Free(), pin.Free(drillable=True), pin.Constant(), pin.Stepped(2), pin.Cone(), pin.Cone(cylinder=True),
)  # fmt: skip
BLOW = linkage.Scene(linkage.Restitution(0.0739, 0.0739), 5.83, 1.2237, 0.375)


def solid(scene):
    """The solid pin's deflection [m]."""
    return pin.check(scene, pin.Profile((0.0,), (0.0,)), effects=pin.ALL).value.deflection


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
@pytest.mark.parametrize("scene", [VAZ, SHORT], ids=["paper's", "short"])
def test_no_pin_at_a_neighbouring_limit_beats_a_certificate(scene, form):
    rng = np.random.default_rng([FORMS.index(form), 1])
    limits = pin.Limits(
        min_wall=float(rng.choice([0.0, 1.5e-3])),
        max_deflection=solid(scene) * 10 ** rng.uniform(0.001, 0.2),
        max_ovalization=None if rng.random() < 0.5 else 2e-5,
    )
    judged = local_rivals.pin_neighbours(pin.PinProblem(scene, limits, form), accuracy=1e-7, steps=(1e-3,))
    assert judged.kept >= 1
    assert judged.beaten <= 2e-7


@pytest.mark.parametrize("form", [pin.Constant(), pin.Stepped(2), pin.Cone(), pin.Free()], ids=lambda form: form.name)
def test_no_local_search_on_the_check_beats_a_certificate(form):
    problem = pin.PinProblem(VAZ, pin.Limits(max_deflection=1.2 * solid(VAZ)), form)
    outcome = pin.design(problem, accuracy=1e-9)
    judged = local_rivals.pin_climbed(problem, outcome, np.random.default_rng(5), starts=2, evaluations=60)
    assert judged.kept > 10
    assert judged.beaten <= 1e-7


def test_a_wrong_law_in_the_search_is_noticed_and_its_gap_says_so(monkeypatch):
    """Shear a tenth too soft where designs are sought: part of the limit stays unused, as neighbours show."""
    problem = pin.PinProblem(VAZ, pin.Limits(max_deflection=1.1 * solid(VAZ)))
    right = pin.design(problem, accuracy=1e-9).value.check.mass
    true = pin_program.cowper
    monkeypatch.setattr(
        pin_program, "cowper", lambda nu: ShearFlexibility(1.1 * true(nu).a, 1.1 * true(nu).b)
    )  # fmt: skip
    wrong = pin.design(problem, accuracy=1e-9)
    assert wrong.value.check.mass > right * 1.001
    assert local_rivals.pin_neighbours(problem).better > 1e-3
    assert wrong.certificate.bound <= right
    assert wrong.certificate.gap > wrong.value.check.mass / right - 1


def test_cones_that_only_narrow_are_noticed(monkeypatch):
    problem = pin.PinProblem(SHORT, form=pin.Cone())
    monkeypatch.setattr(cones, "WIDENING", cones.NARROWING)
    outcome = pin.design(problem)
    judged = local_rivals.pin_climbed(problem, outcome, np.random.default_rng(1), starts=2, evaluations=80)
    assert judged.beaten > 1e-2


def force(check):
    return check.strike.peaks.force


@pytest.mark.parametrize(
    ("limits", "objective", "read"),
    [
        (linkage.Limits(), "pin_force", force),
        (linkage.Limits(min_link=1e-3, longest_link=0.4), "pin_force", force),
        (linkage.Limits(), "peak_torque", lambda check: check.strike.peaks.torque),
        (linkage.Limits(min_link=1e-3), "box_area", lambda check: check.box.area),
    ],
)
def test_no_linkage_by_local_search_or_at_a_neighbouring_limit_beats_a_certificate(limits, objective, read):
    problem = linkage.LinkageProblem(BLOW, limits, linkage.OBJECTIVES[objective])
    outcome = linkage.design(problem)
    judged = local_rivals.linkage_scanned(problem, outcome, read, pieces=6, evaluations=25)
    judged |= local_rivals.linkage_neighbours(problem)
    assert judged.kept > 10
    assert judged.beaten <= 1e-8


def test_a_cut_range_is_noticed(monkeypatch):
    problem = linkage.LinkageProblem(
        BLOW, linkage.Limits(), linkage.OBJECTIVES["pin_force"], (linkage.LARGEST_ROCKER,)
    )  # fmt: skip
    monkeypatch.setattr(Family, "tails", ())
    outcome = linkage.design(problem)
    judged = local_rivals.linkage_scanned(problem, outcome, force, pieces=6, evaluations=25)
    assert judged.beaten > 1e-4


def test_a_slope_limit_beside_a_deflection_limit_leaves_an_honest_gap():
    """What the cone program finds lies above its bound by no more than the envelopes give away."""
    limit = 8.4e-6
    looser = pin.design(pin.PinProblem(VAZ, pin.Limits(max_deflection=limit * 1.0014, max_slope=0.5)), accuracy=1e-4)
    own = pin.design(pin.PinProblem(VAZ, pin.Limits(max_deflection=limit, max_slope=0.5)), accuracy=1e-4)
    assert own.value.check.deflection == pytest.approx(limit, rel=1e-6)
    assert looser.value.check.mass < own.value.check.mass
    assert looser.value.check.deflection > limit
    assert 0 <= own.certificate.gap < 2e-3
