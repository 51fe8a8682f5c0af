"""Influence and cost of effects, on a case with a known answer."""

from __future__ import annotations

import pytest

from solvers.accuracy import Solved
from solvers.effect_costs import effect_costs

WORTH = {"inertia": 0.5, "shear": 0.02, "friction": 0.0}
SECONDS = {"inertia": 2.0, "shear": 0.25, "friction": 0.125}


class Machine:
    """Every effect adds its worth to the one result 1, and its seconds to the time; only friction has a power."""

    def __init__(self) -> None:
        self.now = 0.0
        self.solved: list[frozenset[str]] = []

    def solve(self, chosen: frozenset[str]) -> Solved | None:
        self.now += 1.0 + sum(SECONDS[name] for name in chosen)
        self.solved.append(chosen)
        return Solved(
            {
                "stress": 1.0 + sum(WORTH[name] for name in chosen),
                "power": 3.0 if "friction" in chosen else None,
            }
        )

    def clock(self) -> float:
        return self.now


def test_change_and_time_of_active_and_skipped_effects():
    machine = Machine()
    costs = effect_costs(machine.solve, list(WORTH), frozenset({"inertia"}), 1e9, clock=machine.clock)
    inertia, shear, friction = costs
    assert [cost.active for cost in costs] == [True, False, False]
    # Relative to the answer that has the effect, all others as chosen.
    assert inertia.change == pytest.approx(0.5 / 1.5)
    assert shear.change == pytest.approx(0.02 / 1.52)
    assert friction.change == 0.0
    assert [cost.brings for cost in costs] == [(), (), ("power",)]
    for cost in costs:
        assert cost.time_with - cost.time_without == pytest.approx(SECONDS[cost.name])
        assert cost.runs == 7


def test_runs_are_interleaved():
    machine = Machine()
    effect_costs(machine.solve, list(WORTH), frozenset(), 1e9, runs=3, clock=machine.clock)
    assert machine.solved[:4] == machine.solved[4:8] == machine.solved[8:]
    assert len(set(machine.solved[:4])) == 4


def test_no_run_is_started_after_the_budget():
    machine = Machine()
    costs = effect_costs(machine.solve, list(WORTH), frozenset(), 3.5, clock=machine.clock)
    # 1 s without inertia and 3 s with it: then the time is used up.
    assert len(machine.solved) == 2
    assert costs[0].change == pytest.approx(0.5 / 1.5)
    assert costs[0].runs == 1
    assert costs[1].change is None
    assert costs[1].time_with is None


def test_a_combination_without_an_answer_has_no_values():
    machine = Machine()

    def stubborn(chosen: frozenset[str]) -> Solved | None:
        return machine.solve(chosen) if "shear" in chosen else None

    costs = effect_costs(stubborn, list(WORTH), frozenset({"shear"}), 1e9, clock=machine.clock)
    assert costs[1].change is None
    assert costs[0].change == pytest.approx(0.5 / 1.52)
