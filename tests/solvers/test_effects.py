"""Selection of effects: tolerance, demands, manifest."""

from __future__ import annotations

import math
import pickle
from dataclasses import dataclass

import pytest

from solvers.effects import ALL, AUTO, Demand, EffectSelection, choose
from solvers.errors import EffectConflict, InvalidInput
from solvers.outcome import EffectState


@dataclass(frozen=True)
class Weight:
    """An effect with a given bound."""

    name: str
    bound: float
    summary: str = ""
    measure: str = ""

    def influence(self, situation: object) -> float:
        return self.bound


EFFECTS = (Weight("large", 0.5), Weight("small", 0.004), Weight("middle", 0.005), Weight("unbounded", math.inf))


def names(choice):
    return [effect.name for effect in choice.active]


def test_auto_omits_the_smallest_effects_within_the_tolerance():
    assert names(choose(EFFECTS, None, AUTO, 0.01)) == ["large", "unbounded"]
    assert names(choose(EFFECTS, None, AUTO, 0.008)) == ["large", "middle", "unbounded"]
    assert names(choose(EFFECTS, None, AUTO, 0.003)) == ["large", "small", "middle", "unbounded"]


def test_an_unbounded_effect_is_never_left_out_by_itself():
    assert "unbounded" in names(choose(EFFECTS, None, AUTO, 1.0))


def test_all_runs_everything_that_is_not_excluded():
    assert names(choose(EFFECTS, None, ALL)) == [effect.name for effect in EFFECTS]
    selection = EffectSelection(exclude=frozenset({"middle"}), automatic=False)
    assert names(choose(EFFECTS, None, selection)) == ["large", "small", "unbounded"]


def test_explicit_choices_take_precedence():
    selection = EffectSelection(include=frozenset({"small"}), exclude=frozenset({"large"}))
    assert names(choose(EFFECTS, None, selection, 0.1)) == ["small", "unbounded"]


def test_names_may_come_in_any_collection():
    assert EffectSelection(["a"], {"b"}) == EffectSelection(frozenset({"a"}), frozenset({"b"}))  # type: ignore[arg-type]
    assert len({EffectSelection({"a"}), EffectSelection(["a"])}) == 1  # type: ignore[arg-type]


def test_a_demand_activates_its_effect():
    assert "small" in names(choose(EFFECTS, None, AUTO, 0.1, [Demand("small", "max_small")]))


def test_excluding_a_demanded_effect_names_both():
    with pytest.raises(EffectConflict) as caught:
        choose(EFFECTS, None, EffectSelection(exclude=frozenset({"small"})), 0.1, [Demand("small", "max_small")])
    assert (caught.value.effect, caught.value.needed_by) == ("small", "max_small")


@pytest.mark.parametrize(
    ("selection", "field"),
    [
        (EffectSelection(include=frozenset({"magic"})), "effects.include"),
        (EffectSelection(exclude=frozenset({"magic"})), "effects.exclude"),
        (EffectSelection(include=frozenset({"small"}), exclude=frozenset({"small"})), "effects.exclude"),
    ],
)
def test_impossible_selections_are_refused(selection, field):
    with pytest.raises(InvalidInput) as caught:
        choose(EFFECTS, None, selection)
    assert caught.value.field == field


@pytest.mark.parametrize("tolerance", [0.0, -1.0, math.nan, math.inf, 1.5])
def test_the_tolerance_must_be_in_the_unit_interval(tolerance):
    with pytest.raises(InvalidInput):
        choose(EFFECTS, None, AUTO, tolerance)


def test_the_manifest_names_every_effect_with_state_bound_and_reason():
    manifest = choose(EFFECTS, None, EffectSelection(exclude=frozenset({"large"})), 0.01).manifest
    assert [(r.name, r.state, r.influence) for r in manifest] == [
        ("large", EffectState.SKIPPED, 0.5),
        ("small", EffectState.SKIPPED, 0.004),
        ("middle", EffectState.SKIPPED, 0.005),
        ("unbounded", EffectState.ACTIVE, math.inf),
    ]
    assert manifest[0].why == "excluded by the request"


def test_an_undecisive_bound_is_computed_lazily_and_once():
    asked = []

    @dataclass(frozen=True)
    class Counted:
        name: str
        summary: str = ""
        measure: str = ""

        def influence(self, situation):
            asked.append((self.name, situation))
            return 0.25

    effects = [Counted("in"), Counted("out"), Counted("free")]
    selection = EffectSelection(include=frozenset({"in"}), exclude=frozenset({"out"}))
    manifest = choose(effects, "scene", selection, 0.5).manifest
    assert asked == [("free", "scene")]
    assert [report.influence for report in manifest] == [0.25] * 3
    assert [report.influence for report in pickle.loads(pickle.dumps(manifest))] == [0.25] * 3
    assert sorted(asked) == [("free", "scene"), ("in", "scene"), ("out", "scene")]
    asked.clear()
    choose(effects, "scene", EffectSelection(automatic=False), 0.5)
    assert asked == []
