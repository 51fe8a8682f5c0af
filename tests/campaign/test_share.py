"""A share of the campaign: the promises held on a few random scenes of every kind; `make campaign` does thousands."""

from __future__ import annotations

import pytest

from app.designs.registry import KINDS
from bench.campaign.choices import choices
from bench.campaign.combinations import combinations
from bench.campaign.honesty import honesty
from bench.campaign.scenes import DRAWN, scenes


def test_every_kind_whose_accuracy_is_a_choice_has_its_scenes():
    assert DRAWN.keys() == {slug for slug, kind in KINDS.items() if kind.main_results}


@pytest.mark.parametrize("slug", DRAWN)
def test_estimates_are_honest_and_accuracies_met(slug):
    judged = honesty(scenes(slug, 16))
    assert len(judged.judged) >= 12
    assert judged.dishonest == ()
    assert judged.missed == ()


@pytest.mark.parametrize("slug", DRAWN)
def test_auto_keeps_its_promise(slug):
    chosen = choices(scenes(slug, 3, first_seed=500), tolerances=(1e-1, 1e-3, 1e-5))
    assert len(chosen.verdicts) >= 6
    assert chosen.false_skips == ()


@pytest.mark.parametrize("slug", DRAWN)
def test_every_combination_of_effects_runs(slug):
    tried = combinations(scenes(slug, 1, first_seed=900))
    assert tried.run == 2 ** len(KINDS[slug].effects())
    assert tried.broken == ()


def test_a_table_that_jumps_makes_the_strip_ring():
    """A scene that the campaign found: pressures a tenth of a degree apart, the strip stiff otherwise."""
    assert choices(scenes("flexible-rod", 1, first_seed=28), tolerances=(1e-1,)).false_skips == ()
