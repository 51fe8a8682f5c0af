"""The work-precision study on problems with known errors and times."""

from __future__ import annotations

import math

import pytest

from solvers.accuracy import (
    Exact,
    Level,
    Meeting,
    Plan,
    Reference,
    Solved,
    Within,
    closest_proof,
    relative_errors,
    require_accuracy,
    study,
)
from solvers.errors import InvalidInput


class Bench:
    """A solver whose error is half the requested accuracy and whose time, by a simulated clock, is its logarithm."""

    def __init__(self, fails_at=(), estimated=0.0, slow=1.0):
        self.now, self.order, self.fails_at = 0.0, [], fails_at
        self.estimated, self.slow = estimated, slow

    def clock(self):
        return self.now

    def solve(self, accuracy):
        self.order.append(accuracy)
        self.now += -math.log10(accuracy) * self.slow
        if accuracy in self.fails_at:
            raise ZeroDivisionError
        results = {"one": 1.0 + 0.5 * accuracy, "two": 2.0 + accuracy, "none": None}
        return Solved(results, {"digits": -math.log10(accuracy)}, self.estimated, 10 * accuracy)


def run(bench, goal, ladder, runs=1, time=1e9, reference=lambda: None, reference_time=1e9):
    return study(bench.solve, goal, Plan(ladder, runs, time, reference_time), reference, bench.clock)


def told(results, made="known"):
    return lambda: Reference(made, lambda watch: results)


def test_levels_go_from_loose_to_tight_with_their_true_errors():
    table = run(Bench(), Meeting(1e-5), (1e-6, 1e-2, 1e-4), runs=3)
    assert [level.accuracy for level in table.levels] == [1e-2, 1e-4, 1e-6]
    assert [level.error for level in table.levels] == pytest.approx([5e-3, 5e-5, 5e-7], rel=2e-2)
    assert [level.time_median for level in table.levels] == pytest.approx([2.0, 4.0, 6.0])
    assert [level.runs for level in table.levels] == [3, 3, 3]


def test_the_cheapest_sufficient_level_is_recommended():
    assert run(Bench(), Meeting(1e-4), (1e-2, 1e-4, 1e-6)).recommended.accuracy == 1e-4
    assert run(Bench(), Meeting(1e-8), (1e-2, 1e-4)).recommended is None


def test_of_levels_whose_times_cannot_be_told_apart_the_loosest_is_recommended():
    def level(accuracy, least, median):
        return Level(accuracy, {}, 1e-9, {}, False, None, least, median, 20)

    noisy = [level(1e-2, 1.9, 3.0), level(1e-4, 2.9, 3.2), level(1e-6, 1.0, 2.0)]
    assert Meeting(1e-4).pick(noisy).accuracy == 1e-2
    assert Meeting(1e-4).pick(noisy[1:]).accuracy == 1e-6


def test_the_best_within_a_time_is_recommended():
    assert run(Bench(), Within(5.0), (1e-2, 1e-4, 1e-6)).recommended.accuracy == 1e-4
    assert run(Bench(), Within(1.0), (1e-2, 1e-4, 1e-6)).recommended is None


def test_runs_are_interleaved_after_a_tighter_reference():
    bench = Bench()
    run(bench, Meeting(1e-2), (1e-2, 1e-4), runs=2)
    assert bench.order == [1e-6, 1e-2, 1e-4, 1e-2, 1e-4]


def test_an_independent_reference_judges_the_tightest_levels_too():
    known = told({"one": Exact(1.0), "two": Exact(2.0), "none": Exact(None)})
    table = run(Bench(), Meeting(1e-11), (1e-2, 1e-12), reference=known)
    assert table.reference == "known"
    assert table.levels[-1].error == pytest.approx(5e-13, rel=1e-2)
    assert not table.levels[-1].at_most
    assert table.recommended.accuracy == 1e-12


def test_results_without_a_reference_are_judged_by_the_solver():
    table = run(Bench(), Meeting(1e-2), (1e-2, 1e-10, 1e-12), reference=told({"one": Exact(1.0)}))
    assert table.reference == "known; two: the same case solved to 1e-12"
    assert [set(level.errors) for level in table.levels] == [{"one", "two", "none"}, {"one", "two", "none"}, {"one"}]
    assert table.levels[-1].error == pytest.approx(5e-13, rel=1e-2)


def test_only_an_independent_reference_detects_a_wrong_solver():
    bench = Bench()
    truth = {"one": Exact(1.25), "two": Exact(2.0), "none": Exact(None)}
    assert run(bench, Meeting(1e-4), (1e-4,), reference=told(truth)).levels[0].errors["one"] == pytest.approx(0.2, 1e-3)
    assert run(bench, Meeting(1e-4), (1e-4,)).levels[0].errors["one"] < 1e-4


def test_errors_are_limited_by_the_references_uncertainty():
    vague = told({"one": Exact(1.0, 1e-5), "two": Exact(2.0), "none": Exact(None)})
    table = run(Bench(), Meeting(1e-4), (1e-3, 1e-8), reference=vague)
    assert [(level.error, level.at_most) for level in table.levels] == [(pytest.approx(5e-4), False), (1e-5, True)]
    assert table.reference_accuracy == 1e-5
    # Nor below what the solver itself thinks of its tightest solution.
    table = run(Bench(estimated=1e-7), Meeting(1e-4), (1e-3, 1e-10))
    assert [(level.error, level.at_most) for level in table.levels] == [(pytest.approx(5e-4), False), (1e-7, True)]
    assert "its own estimate 1e-07" in table.reference


def test_a_slow_reference_is_discarded():
    bench = Bench()

    def results(watch):
        for _ in range(1000):
            bench.now += 1.0
            watch()
        raise AssertionError("nobody looked at the clock")

    table = run(bench, Meeting(1e-2), (1e-2, 1e-4), reference=lambda: Reference("by hand", results), reference_time=9.5)
    assert table.reference == "one by hand was given up after 9.5 s; the same case solved to 1e-06"
    assert bench.now < 40
    assert [level.accuracy for level in table.levels] == [1e-2, 1e-4]


def test_a_failing_reference_is_discarded():
    def results(watch):
        raise ZeroDivisionError

    table = run(Bench(), Meeting(1e-2), (1e-2,), reference=lambda: Reference("by hand", results))
    assert table.reference == "one by hand broke off (ZeroDivisionError); the same case solved to 0.0001"
    assert table.levels[0].error == pytest.approx(5e-3, rel=2e-2)


def test_a_result_that_exists_on_one_side_only_is_a_failure():
    table = run(Bench(), Meeting(1e-2), (1e-2,), reference=told({"one": Exact(None)}))
    assert table.levels[0].error is None


def test_long_runs_are_run_less_often():
    plan = Plan((1e-2, 1e-4), runs=20, time=1e9, reference_time=1.0)
    bench = Bench(slow=0.75)  # 1.5 s and 3 s
    table = study(bench.solve, Meeting(1e-2), plan, clock=bench.clock)
    assert [level.runs for level in table.levels] == [20, 3]


def test_no_run_is_started_that_would_not_end_in_time():
    table = run(Bench(), Meeting(1e-2), (1e-1, 1e-6), runs=50, time=20.0)
    # One round takes 7 s; the tighter of the two levels gets no third run, the looser one does.
    assert [(level.accuracy, level.runs) for level in table.levels] == [(1e-1, 8), (1e-6, 2)]


def test_the_cheapest_sufficient_proof_or_the_closest_is_found():
    levels = run(Bench(), Meeting(1e-2), (1e-2, 1e-4, 1e-6)).levels
    assert closest_proof(levels, 1e-3).accuracy == 1e-4
    assert closest_proof(levels, 1e-12).accuracy == 1e-6
    assert closest_proof((), 1e-3) is None


def test_without_a_reference_no_level_is_judged_by_an_equal_one():
    assert [level.accuracy for level in run(Bench(), Meeting(1e-2), (1e-2, 1e-10, 1e-12)).levels] == [1e-2, 1e-10]


def test_only_the_loosest_level_runs_after_the_budget():
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
