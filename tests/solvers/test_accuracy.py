"""The error-against-time study on problems whose errors and times are known."""

from __future__ import annotations

import math

import pytest

from solvers.accuracy import Meeting, Plan, Reference, Solved, Within, relative_errors, require_accuracy, study
from solvers.errors import InvalidInput


class Bench:
    """A solver whose error is half the wanted accuracy and whose time is its logarithm, by its own clock."""

    def __init__(self, fails_at=()):
        self.now, self.order, self.fails_at = 0.0, [], fails_at

    def clock(self):
        return self.now

    def solve(self, accuracy):
        self.order.append(accuracy)
        self.now += -math.log10(accuracy)
        if accuracy in self.fails_at:
            raise ZeroDivisionError
        return Solved({"one": 1.0 + 0.5 * accuracy, "none": None}, {"digits": -math.log10(accuracy)})


def run(bench, goal, ladder, runs=1, time=1e9, reference=None):
    return study(bench.solve, goal, Plan(ladder, runs, time), reference, bench.clock)


def test_levels_go_from_loose_to_tight_with_their_true_errors():
    table = run(Bench(), Meeting(1e-5), (1e-6, 1e-2, 1e-4), runs=3)
    assert [level.accuracy for level in table.levels] == [1e-2, 1e-4, 1e-6]
    assert [level.error for level in table.levels] == pytest.approx([5e-3, 5e-5, 5e-7], rel=2e-2)
    assert [level.time_median for level in table.levels] == pytest.approx([2.0, 4.0, 6.0])
    assert [level.runs for level in table.levels] == [3, 3, 3]


def test_the_cheapest_sufficient_level_is_recommended():
    assert run(Bench(), Meeting(1e-4), (1e-2, 1e-4, 1e-6)).recommended.accuracy == 1e-4
    assert run(Bench(), Meeting(1e-8), (1e-2, 1e-4)).recommended is None


def test_the_best_within_a_time_is_recommended():
    assert run(Bench(), Within(5.0), (1e-2, 1e-4, 1e-6)).recommended.accuracy == 1e-4
    assert run(Bench(), Within(1.0), (1e-2, 1e-4, 1e-6)).recommended is None


def test_runs_are_interleaved_after_a_tighter_reference():
    bench = Bench()
    run(bench, Meeting(1e-2), (1e-2, 1e-4), runs=2)
    assert bench.order == [1e-6, 1e-2, 1e-4, 1e-2, 1e-4]


def test_an_independent_reference_judges_the_tightest_rungs_too():
    told = Reference("known", lambda: {"one": 1.0, "none": None})
    table = run(Bench(), Meeting(1e-11), (1e-2, 1e-12), reference=told)
    assert table.reference == "known"
    assert table.levels[-1].error == pytest.approx(5e-13, rel=1e-2)
    assert table.recommended.accuracy == 1e-12


def test_without_one_no_rung_is_judged_by_its_equal():
    assert [level.accuracy for level in run(Bench(), Meeting(1e-2), (1e-2, 1e-10, 1e-12)).levels] == [1e-2, 1e-10]


def test_no_solution_begins_after_the_budget_but_the_loosest():
    table = run(Bench(), Meeting(1e-2), (1e-2, 1e-4), runs=50, time=1e-3)
    assert [(level.accuracy, level.runs) for level in table.levels] == [(1e-2, 1)]
    assert table.recommended is not None


def test_a_level_that_fails_has_no_error_and_is_not_recommended():
    table = run(Bench(fails_at=(1e-2,)), Meeting(1e-1), (1e-2, 1e-4), runs=2)
    assert table.levels[0].error is None
    assert table.recommended.accuracy == 1e-4


def test_errors_are_relative_except_at_zero():
    assert relative_errors({"a": 1.1, "b": 0.2, "c": None}, {"a": 1.0, "b": 0.0, "c": None}) == pytest.approx(
        {"a": 0.1, "b": 0.2, "c": 0.0}
    )
    assert relative_errors({"a": None}, {"a": 1.0}) == {"a": math.inf}


@pytest.mark.parametrize("accuracy", [0.0, 1e-13, 0.2, math.nan, math.inf])
def test_impossible_accuracies_are_refused(accuracy):
    with pytest.raises(InvalidInput):
        require_accuracy(accuracy)
    with pytest.raises(InvalidInput):
        Meeting(accuracy)
    with pytest.raises(InvalidInput):
        Plan(ladder=(1e-2, accuracy))


@pytest.mark.parametrize("budget", [0.0, -1.0, math.nan, math.inf])
def test_impossible_times_are_refused(budget):
    with pytest.raises(InvalidInput):
        Plan(time=budget)
    with pytest.raises(InvalidInput):
        Within(budget)
