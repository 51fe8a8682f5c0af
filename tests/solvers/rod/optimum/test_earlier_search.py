"""Searches that follow one with slightly different effects."""

from __future__ import annotations

import gc

import pytest

from bench.rod_problems import problem as realistic
from solvers import rod
from solvers.outcome import Status
from solvers.rod.optimum.full_model.strip import FullStrip
from solvers.rod.optimum.search.context import Context
from solvers.rod.optimum.strip_search import StripSearch


def reached(outcome):
    """The objective, or what is attainable of each missed requirement."""
    if outcome.status is Status.SUCCEEDED:
        return {outcome.value.objective: rod.OBJECTIVES[outcome.value.objective].read(outcome.value.check)}
    return {entry.requirement: entry.attainable for entry in outcome.diagnosis}


@pytest.mark.parametrize("seed", [718, 1412], ids=["continuous sizes", "in steps"])
def test_gaps_between_resonances_are_searched_once_for_an_effect_more_or_less(seed, monkeypatch):
    """The answer is that of a search that knows of no other one."""
    asked, starts, search_again = realistic(seed), [], Context.search_again

    def recorded(self):
        starts.append(self.search_count)
        return search_again(self)

    with monkeypatch.context() as patch:
        patch.setattr(Context, "search_again", recorded)
        found = rod.design(asked)
    assert starts
    monkeypatch.setattr(StripSearch, "_earlier_search", lambda *_: None)
    afresh = rod.design(asked)
    assert found.accuracy.met
    assert reached(found) == pytest.approx(reached(afresh), rel=found.accuracy.estimated + afresh.accuracy.estimated)


def strips():
    """The strips with vibrations that are in memory."""
    return [id(each) for each in gc.get_objects() if isinstance(each, FullStrip)]


def test_the_strips_of_searches_are_freed_with_them():
    """Kept by cycles, those of a design and the designs within it took a gigabyte until they were collected."""
    gc.collect()
    gc.disable()
    try:
        known = set(strips())
        assert rod.design(realistic(1041)).status is Status.INFEASIBLE
        assert set(strips()) <= known
    finally:
        gc.enable()
