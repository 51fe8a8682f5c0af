"""Designs on the full model: slopes beside a strip, strips looked for anywhere, and problems that need both."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from solvers import rod
from solvers.fatigue import serensen
from solvers.rod.cycle.composition import BeamColumn, Composition
from solvers.rod.optimum import constraints as rows
from solvers.rod.optimum.full_model.scout import STRIPS, miss, scout
from solvers.rod.optimum.full_model.tilt import logarithms, measured, own_rows
from solvers.rod.optimum.machine import Matters
from solvers.rod.optimum.peak_model import SIDEWAYS, STRESS
from solvers.rod.optimum.proof.outer_approximation import Sizes
from solvers.rod.optimum.sampled_cycle import survey
from solvers.rod.problem import OBJECTIVES, Bounds, Requirements
from tests.solvers.rod.machines import PAPER, STRIP

BOUNDS = Bounds((4e-3, 12e-3), (0.2e-3, 1.0e-3), (15e-3, 35e-3))
ASKED = Requirements(min_fatigue_safety=2.0, min_stability_safety=1.5)


def answer(fatigue=3.0, stability=3.0, stresses=True):
    """What a scout reads of a check."""
    parts = SimpleNamespace(
        fatigue_safety=fatigue, yield_safety=None, contact_pressure_max=None, friction_power=None, side_force_max=1.0
    )
    return SimpleNamespace(stability_safety=stability, stresses=parts if stresses else None, mass=1.0)


@pytest.mark.parametrize("powers", [(0.3, -0.7, 1.1), (0.0, 0.0, 0.0)])
@pytest.mark.parametrize("strip", [STRIP, rod.Dimensions(12e-3, 1.0e-3, 15e-3)])
def test_a_ratio_that_is_a_power_of_the_sizes_has_its_exponents_for_slopes(powers, strip):
    machine = survey(PAPER, serensen(PAPER.material), Composition(beam=BeamColumn()), STRIP)
    focus, _ = machine.focus_at(strip.b, strip.h, strip.l, Matters(True, True, True))

    def full(d):
        own = own_rows(focus, d) + np.dot(powers, logarithms(d))
        values = {row: math.exp(own[row]) for row in (rows.SIDE, rows.PRESSURE, rows.POWER)}
        stresses = SimpleNamespace(
            fatigue_safety=math.exp(-own[rows.UTILISATION]),
            yield_safety=math.exp(-own[STRESS]),
            side_force_max=values[rows.SIDE],
            contact_pressure_max=values[rows.PRESSURE],
            friction_power=values[rows.POWER],
        )
        return SimpleNamespace(stability_safety=math.exp(-own[rows.STABILITY]), stresses=stresses)

    tilt = measured(focus, strip, full(strip), full, BOUNDS)
    told = [rows.UTILISATION, rows.STABILITY, rows.SIDE, rows.PRESSURE, rows.POWER, STRESS]
    assert tilt.slopes[told] == pytest.approx(np.tile(powers, (len(told), 1)), abs=1e-9)
    assert np.all(tilt.slopes[[rows.TAU, rows.LENGTH, rows.THICKNESS]] == 0.0)
    assert np.all(np.isfinite(tilt.slopes[SIDEWAYS]))


def test_a_size_whose_neighbour_buckles_and_one_that_is_settled_have_no_slope():
    machine = survey(PAPER, serensen(PAPER.material), Composition(beam=BeamColumn()), STRIP)
    focus, _ = machine.focus_at(STRIP.b, STRIP.h, STRIP.l, Matters(False, False, False))
    tilt = measured(
        focus, STRIP, answer(), lambda d: answer(stresses=d.b == STRIP.b), replace(BOUNDS, h=(STRIP.h,) * 2)
    )
    assert np.all(tilt.slopes[:, :2] == 0.0)
    assert np.any(tilt.slopes[:, 2] != 0.0)


@pytest.mark.parametrize(
    ("check", "missed"),
    [
        (answer(2.0, 1.5), 0.0),
        (answer(1.0, 9.0), math.log(2.0)),
        (answer(None, 0.75 * 1.5), math.log(4 / 3)),
        (answer(stability=0.5, stresses=False), 10.0 + math.log(2.0)),
    ],
)
def test_a_miss_is_that_of_the_requirement_missed_most(check, missed):
    assert miss(check, ASKED) == pytest.approx(missed, abs=1e-15)


@pytest.mark.parametrize("width", [0.4, 0.1])
def test_a_scout_finds_strips_that_are_few(width):
    """Admissible is only what lies within ``width``, in logarithms, of one strip."""
    there = logarithms(rod.Dimensions(6.1e-3, 0.77e-3, 22e-3))
    looked = []

    def look(d):
        looked.append(d)
        return answer(2.0 * math.exp(width - float(np.max(np.abs(logarithms(d) - there)))))

    found = scout(look, Sizes(BOUNDS), ASKED, OBJECTIVES["mass"])
    assert np.max(np.abs(logarithms(found) - there)) <= width
    assert len(looked) <= STRIPS + 24


def test_a_scout_keeps_to_the_sizes_that_are_to_be_had_and_gives_up_in_the_end():
    stock, looked = (0.3e-3, 0.5e-3, 0.8e-3), []

    def look(d):
        looked.append(d)
        return answer(1.0)

    assert scout(look, Sizes(BOUNDS, stock_h=stock, step_l=1e-3), ASKED, OBJECTIVES["mass"]) is None
    assert {d.h for d in looked} == set(stock)
    assert all(d.l / 1e-3 == pytest.approx(round(d.l / 1e-3), abs=1e-9) for d in looked)
