"""Error against time of any problem, measured on the problem itself over a ladder of accuracies.

A solver takes the wanted accuracy as an input and turns it into settings; here the same case is solved on every rung
from loose to tight. Each rung's error is its distance from a reference: of every result an independent one where there
is such a thing, or else the solver's own, two orders tighter than the tightest rung that it judges. No reference tells
an error below what it may be off itself. The runs are interleaved (one of each rung in turn), so that a machine that
slows down slows every rung alike.

Source: the work-precision diagrams of E. Hairer, G. Wanner, Solving Ordinary Differential Equations II.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from solvers.errors import InvalidInput
from solvers.watch import OutOfTime, Watch

LEAST_ACCURACY, GREATEST_ACCURACY = 1e-12, 1e-1
LADDER = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
TWO_ORDERS = 100.0
_EPS = 2.0**-52
_LAST_DIGITS = 1e-9

Clock = Callable[[], float]


@dataclass(frozen=True)
class Solved:
    """What one solution says of itself.

    results    main results by name, None where one does not exist
    estimated  its own estimate of their relative error
    gap        how far a proof leaves the best there may be, relative; None where nothing is proven
    """

    results: Mapping[str, float | None]
    settings: Mapping[str, float | int | str] = field(default_factory=dict)
    estimated: float = 0.0
    gap: float | None = None


@dataclass(frozen=True)
class Level:
    """One rung; times in seconds.

    error    the greatest relative error over the main results, None where the rung failed
    at_most  the reference cannot tell the greatest error from nothing: it is no greater than what ``error`` says
    gap      as in ``Solved``
    """

    accuracy: float
    settings: Mapping[str, float | int | str]
    error: float | None
    errors: Mapping[str, float]
    at_most: bool
    gap: float | None
    time_min: float
    time_median: float
    runs: int


@dataclass(frozen=True)
class Study:
    """The table, how its reference was made, what that may be off itself, and the level that suits the goal or None."""

    levels: tuple[Level, ...]
    reference: str
    reference_accuracy: float
    recommended: Level | None


class Goal(Protocol):
    """What the user wants of a level."""

    def pick(self, levels: Sequence[Level]) -> Level | None: ...


@dataclass(frozen=True)
class Meeting:
    """An accuracy to be met, as cheaply as can be."""

    accuracy: float

    def __post_init__(self) -> None:
        require_accuracy(self.accuracy)

    def pick(self, levels: Sequence[Level]) -> Level | None:
        """The cheapest of the levels whose error is small enough."""
        good = [level for level in levels if level.error is not None and level.error <= self.accuracy]
        return min(good, key=lambda level: level.time_median, default=None)


@dataclass(frozen=True)
class Within:
    """A time per solution [s], of which the best is to be made."""

    time: float

    def __post_init__(self) -> None:
        _require_time("time_budget", self.time)

    def pick(self, levels: Sequence[Level]) -> Level | None:
        """The most accurate of the levels that take no longer."""
        affordable = [level for level in levels if level.error is not None and level.time_median <= self.time]
        return min(affordable, key=lambda level: (level.error, level.time_median), default=None)


@dataclass(frozen=True)
class Exact:
    """A main result as a reference has it, and what it may be off, relative."""

    value: float | None
    accuracy: float = _EPS


@dataclass(frozen=True)
class Reference:
    """Main results found by other means, and a sentence on how; results that it does not name are the solver's own.

    ``results`` is given a watch to be looked at often, which raises OutOfTime.
    """

    made: str
    results: Callable[[Watch], Mapping[str, Exact]]


@dataclass(frozen=True)
class Plan:
    """The rungs, how often each is run, and times [s].

    runs            of every rung; a rung whose runs take longer than ``long_run`` is run ``long_runs`` times
    time            once the reference is there, no solution begins that would not end by then
    reference_time  after which an independent reference is given up

    The solver's own tightest solution and the loosest rung are always there; rungs that the time does not reach are
    left out.
    """

    ladder: Sequence[float] = LADDER
    runs: int = 20
    time: float = 10.0
    reference_time: float = 10.0
    long_run: float = 2.0
    long_runs: int = 3

    def __post_init__(self) -> None:
        for accuracy in self.ladder:
            require_accuracy(accuracy)
        _require_time("study_budget", self.time)
        _require_time("study_budget", self.reference_time)

    def enough(self, times: Sequence[float]) -> bool:
        """Whether a rung that took these times was run often enough."""
        return len(times) >= (self.long_runs if times and min(times) > self.long_run else self.runs)


def require_accuracy(accuracy: float) -> None:
    """Refuse, with InvalidInput, an accuracy outside [1e-12, 1e-1]."""
    if not LEAST_ACCURACY <= accuracy <= GREATEST_ACCURACY:
        raise InvalidInput("accuracy", "lies outside what can be asked for", "[1e-12, 1e-1]")


def _require_time(field: str, seconds: float) -> None:
    if not (math.isfinite(seconds) and seconds > 0):
        raise InvalidInput(field, "must be positive", "(0, inf)")


def closest_proof(levels: Sequence[Level], accuracy: float) -> Level | None:
    """The cheapest level whose answer is proven to be the best to this accuracy; where none is, the closest to it."""
    proven = [level for level in levels if level.gap is not None and level.error is not None]
    close = [level for level in proven if level.gap <= accuracy * (1.0 + _LAST_DIGITS)]
    return min(close, key=lambda level: level.time_median, default=None) or min(
        proven, key=lambda level: (level.gap, level.time_median), default=None
    )


def relative_errors(results: Mapping[str, float | None], reference: Mapping[str, float | None]) -> dict[str, float]:
    """|x - x_ref|/|x_ref| by name; |x| where the reference is 0; inf where only one of the two has the result."""
    errors = {}
    for name, exact in reference.items():
        value = results.get(name)
        if value is None or exact is None:
            errors[name] = 0.0 if value is exact else math.inf
        else:
            errors[name] = abs(value - exact) / abs(exact) if exact else abs(value)
    return errors


Independent = Callable[[], Reference | None]


def _nothing() -> None:
    return None


def study(
    solve: Callable[[float], Solved],
    goal: Goal,
    plan: Plan | None = None,
    reference: Independent = _nothing,
    clock: Clock = time.perf_counter,
) -> Study:
    """Solve one case at every accuracy of the ladder.

    solve      the case at a wanted accuracy; an ArithmeticError marks that level as failed
    reference  asked for an independent reference once the solver's own tightest solution is there; results that it
               does not tell, in time, the solver judges itself, and then not on rungs that are too tight for that

    Raises whatever ``solve`` raises besides, and whatever the reference raises.
    """
    plan = plan or Plan()
    rungs = sorted(set(plan.ladder), reverse=True)
    judge = _judge(solve, rungs, plan, reference, clock)
    rungs = [accuracy for accuracy in rungs if judge.judges(accuracy)]

    started = clock()
    solved: dict[float, Solved | None] = {}
    times: dict[float, list[float]] = {accuracy: [] for accuracy in rungs}
    for turn in range(plan.runs):
        for accuracy in rungs:
            done, begun = times[accuracy], clock()
            if turn and (solved.get(accuracy) is None or plan.enough(done)):
                continue
            if solved and begun + min(done, default=0.0) - started > plan.time:
                continue
            try:
                answer = solve(accuracy)
            except ArithmeticError:
                answer = None
            done.append(clock() - begun)
            solved.setdefault(accuracy, answer)

    levels = tuple(judge.level(accuracy, solved[accuracy], times[accuracy]) for accuracy in rungs if times[accuracy])
    return Study(levels, judge.made, judge.accuracy, goal.pick(levels))


@dataclass(frozen=True)
class _Judge:
    """What rungs are held against: independent results, and the solver's own from ``tightest``."""

    made: str
    independent: Mapping[str, Exact]
    own: Mapping[str, Exact]
    tightest: float

    @property
    def accuracy(self) -> float:
        """What the reference may be off, relative, in the result of which it knows least."""
        every = (*self.independent.values(), *self.own.values())
        return max((exact.accuracy for exact in every if exact.value is not None), default=_EPS)

    def judges(self, accuracy: float) -> bool:
        return bool(self.independent) or self._is_looser(accuracy)

    def _is_looser(self, accuracy: float) -> bool:
        return accuracy >= TWO_ORDERS * self.tightest * (1.0 - _LAST_DIGITS)

    def level(self, accuracy: float, solved: Solved | None, times: Sequence[float]) -> Level:
        exact = {**self.independent, **(self.own if self._is_looser(accuracy) else {})}
        errors, told = {}, 0.0
        if solved is not None:
            measured = relative_errors(solved.results, {name: e.value for name, e in exact.items()})
            # No reference tells an error below what it may be off itself.
            errors = {
                name: off if exact[name].value is None else max(off, exact[name].accuracy)
                for name, off in measured.items()
            }
            told = max((off for name, off in measured.items() if off > exact[name].accuracy), default=0.0)
        error = None if solved is None else max(errors.values(), default=0.0)
        if error is not None and not math.isfinite(error):
            # A result that exists on one side only is a failure of the level, not a large error.
            error, errors = None, {name: value for name, value in errors.items() if math.isfinite(value)}
        return Level(
            accuracy=accuracy,
            settings={} if solved is None else solved.settings,
            error=error,
            errors=errors,
            at_most=error is not None and told < error,
            gap=None if solved is None else solved.gap,
            time_min=min(times),
            time_median=statistics.median(times),
            runs=len(times),
        )


def _judge(
    solve: Callable[[float], Solved], rungs: Sequence[float], plan: Plan, reference: Independent, clock: Clock
) -> _Judge:
    """The solver's own tightest solution, and of it what independent means tell in time.

    It comes first, so that whatever is worked out once per process is not billed to the first rung.
    """
    judged = [accuracy for accuracy in rungs if accuracy >= TWO_ORDERS * LEAST_ACCURACY]
    tightest = max(LEAST_ACCURACY, (judged or rungs)[-1] / TWO_ORDERS)
    solution = solve(tightest)
    known, found, told = reference(), {}, ""
    if known is not None:
        try:
            found = known.results(Watch(plan.reference_time, clock))
            told = known.made
        except OutOfTime:
            told = f"one {known.made} was given up after {plan.reference_time:.3g} s"
    doubt = max(tightest, solution.estimated)
    own = {name: Exact(value, doubt) for name, value in solution.results.items() if name not in found}
    itself = f"the same case solved to {tightest:g}"
    if doubt > tightest:
        itself += f", its own estimate {doubt:.1g}"
    if all(exact.value is None for exact in own.values()) and found:
        return _Judge(told, found, own, tightest)
    if found:
        itself = f"{', '.join(name for name, exact in own.items() if exact.value is not None)}: {itself}"
    return _Judge(f"{told}; {itself}" if told else itself, found, own, tightest)
