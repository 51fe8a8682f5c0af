"""Bounds over a box of dimensions hold for strips inside it."""

from __future__ import annotations

import numpy as np

from solvers import rod
from solvers.rod.effect_bounds.over_box import choose_over_box, worst_situations
from solvers.rod.effect_bounds.situation import Situation
from tests.solvers.rod.machines import PAPER

LOWER, UPPER = rod.Dimensions(5e-3, 0.2e-3, 15e-3), rod.Dimensions(12e-3, 1.0e-3, 35e-3)


def test_no_strip_inside_has_a_greater_bound():
    worst = {report.name: report.influence for report in choose_over_box(PAPER, LOWER, UPPER).manifest}
    rng, tried = np.random.default_rng(3), 0
    for b, h, l in rng.uniform([LOWER.b, LOWER.h, LOWER.l], [UPPER.b, UPPER.h, UPPER.l], (200, 3)):
        situation = Situation.of(PAPER, rod.Dimensions(b, h, l))
        if situation.critical < 1.05 * situation.compression:
            continue
        tried += 1
        for effect in rod.EFFECTS:
            # No tolerance admits a bound of 1, so beyond it greater and smaller are the same.
            bound = min(effect.influence(situation), 1.0)
            assert bound <= worst[effect.name] * (1 + 1e-9), (effect.name, b, h, l)
    assert tried > 50


def test_a_box_without_a_stable_strip_is_judged_by_its_stoutest():
    thin = rod.Dimensions(12e-3, 0.21e-3, 35e-3)
    (only,) = worst_situations(PAPER, LOWER, thin)
    assert only.dimensions == rod.Dimensions(12e-3, 0.21e-3, 15e-3)


def test_active_effects_are_the_rods_own_objects():
    assert set(choose_over_box(PAPER, LOWER, UPPER, rod.ALL).active) == set(rod.EFFECTS)
