"""Work-precision study of any problem: error against time over a ladder of requested accuracies.

The case is solved at every accuracy from loose to tight. The error of a level is its deviation from a reference: an
independent solution where available, otherwise the solver's own at an accuracy two orders tighter than any level it
judges. Errors below the reference's own uncertainty are not resolved. Runs of the levels are interleaved, so that
machine load affects all of them alike.

Source: work-precision diagrams in E. Hairer, G. Wanner, Solving Ordinary Differential Equations II.
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
REFERENCE_FACTOR = 100.0
_EPS = 2.0**-52
_ROUNDING = 1e-9

Clock = Callable[[], float]


@dataclass(frozen=True)
class Solved:
    """One solution.

    results    main results by name, None if undefined
    settings   numerical settings used
    estimated  the solver's estimate of their relative error
    gap        relative gap of an optimality proof, None without one
    """

    results: Mapping[str, float | None]
    settings: Mapping[str, float | int | str] = field(default_factory=dict)
    estimated: float = 0.0
    gap: float | None = None


@dataclass(frozen=True)
class Level:
    """A level of the ladder; times in seconds.

    error    maximum relative error of the main results, None if the level failed
    at_most  the error is below the reference's uncertainty: ``error`` is an upper bound
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
    """Levels, description and relative uncertainty of the reference, and the recommended level, if any."""

    levels: tuple[Level, ...]
    reference: str
    reference_accuracy: float
    recommended: Level | None


class Goal(Protocol):
    """A user's goal, which selects a level."""

    def pick(self, levels: Sequence[Level]) -> Level | None: ...


@dataclass(frozen=True)
class Meeting:
    """The cheapest level that meets an accuracy; of several whose times cannot be told apart, the loosest."""

    accuracy: float

    def __post_init__(self) -> None:
        require_accuracy(self.accuracy)

    def pick(self, levels: Sequence[Level]) -> Level | None:
        """The cheapest level with a sufficiently small error. A level that was once as fast as the fastest is in the
        median may well be the cheapest."""
        good = [level for level in levels if level.error is not None and level.error <= self.accuracy]
        fastest = min((level.time_median for level in good), default=math.inf)
        return max(
            (level for level in good if level.time_min <= fastest), key=lambda level: level.accuracy, default=None
        )


@dataclass(frozen=True)
class Within:
    """The most accurate level within a time per solution [s]."""

    time: float

    def __post_init__(self) -> None:
        _require_time("time_budget", self.time)

    def pick(self, levels: Sequence[Level]) -> Level | None:
        """The most accurate level that is fast enough."""
        affordable = [level for level in levels if level.error is not None and level.time_median <= self.time]
        return min(affordable, key=lambda level: (level.error, level.time_median), default=None)


@dataclass(frozen=True)
class Exact:
    """A reference value and its relative uncertainty."""

    value: float | None
    accuracy: float = _EPS


@dataclass(frozen=True)
class Reference:
    """An independent reference: its description, and main results; the solver itself is used for results it omits.

    ``results`` must often call the given watch, which raises OutOfTime.
    """

    made: str
    results: Callable[[Watch], Mapping[str, Exact]]


@dataclass(frozen=True)
class Plan:
    """Plan of a study.

    ladder          accuracies
    runs            repetitions per level; ``long_runs`` if a run takes longer than ``long_run`` [s]
    time            no run is started that would not end within this time [s] after the reference
    reference_time  time limit of an independent reference [s]

    The solver's own tightest solution and the loosest level are always computed; levels beyond the time are omitted.
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
        """Whether a level with these run times was repeated often enough."""
        return len(times) >= (self.long_runs if times and min(times) > self.long_run else self.runs)


def require_accuracy(accuracy: float) -> None:
    """Raise InvalidInput for an accuracy outside [1e-12, 1e-1]."""
    if not LEAST_ACCURACY <= accuracy <= GREATEST_ACCURACY:
        raise InvalidInput("accuracy", "lies outside what can be asked for", "[1e-12, 1e-1]")


def _require_time(field: str, seconds: float) -> None:
    if not (math.isfinite(seconds) and seconds > 0):
        raise InvalidInput(field, "must be positive", "(0, inf)")


def closest_proof(levels: Sequence[Level], accuracy: float) -> Level | None:
    """The cheapest level with an optimality gap within this accuracy; otherwise the level with the smallest gap."""
    proven = [level for level in levels if level.gap is not None and level.error is not None]
    close = [level for level in proven if level.gap <= accuracy * (1.0 + _ROUNDING)]
    return min(close, key=lambda level: level.time_median, default=None) or min(
        proven, key=lambda level: (level.gap, level.time_median), default=None
    )


def relative_errors(results: Mapping[str, float | None], reference: Mapping[str, float | None]) -> dict[str, float]:
    """|x - x_ref|/|x_ref| by name; |x| where x_ref = 0; inf if only one of them has the result."""
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

    solve      the case at a requested accuracy; an ArithmeticError marks the level as failed
    reference  called for an independent reference after the solver's own tightest solution; results it lacks, or does
               not deliver in time, are judged by the solver itself, except at levels too tight for that

    Propagates other exceptions of ``solve`` and of the reference; an ArithmeticError of the reference discards it.
    """
    plan = plan or Plan()
    accuracies = sorted(set(plan.ladder), reverse=True)
    judge = _judge(solve, accuracies, plan, reference, clock)
    accuracies = [accuracy for accuracy in accuracies if judge.judges(accuracy)]

    started = clock()
    solved: dict[float, Solved | None] = {}
    times: dict[float, list[float]] = {accuracy: [] for accuracy in accuracies}
    for repetition in range(plan.runs):
        for accuracy in accuracies:
            done, start = times[accuracy], clock()
            if repetition and (solved.get(accuracy) is None or plan.enough(done)):
                continue
            if solved and start + min(done, default=0.0) - started > plan.time:
                continue
            try:
                answer = solve(accuracy)
            except ArithmeticError:
                answer = None
            done.append(clock() - start)
            solved.setdefault(accuracy, answer)

    levels = tuple(
        judge.level(accuracy, solved[accuracy], times[accuracy]) for accuracy in accuracies if times[accuracy]
    )
    return Study(levels, judge.made, judge.accuracy, goal.pick(levels))


@dataclass(frozen=True)
class _Judge:
    """Reference values: independent results, and the solver's own at accuracy ``tightest``."""

    made: str
    independent: Mapping[str, Exact]
    own: Mapping[str, Exact]
    tightest: float

    @property
    def accuracy(self) -> float:
        """Largest relative uncertainty of the reference values."""
        every = (*self.independent.values(), *self.own.values())
        return max((exact.accuracy for exact in every if exact.value is not None), default=_EPS)

    def judges(self, accuracy: float) -> bool:
        return bool(self.independent) or self._is_looser(accuracy)

    def _is_looser(self, accuracy: float) -> bool:
        return accuracy >= REFERENCE_FACTOR * self.tightest * (1.0 - _ROUNDING)

    def level(self, accuracy: float, solved: Solved | None, times: Sequence[float]) -> Level:
        exact = {**self.independent, **(self.own if self._is_looser(accuracy) else {})}
        errors, resolved = {}, 0.0
        if solved is not None:
            measured = relative_errors(solved.results, {name: e.value for name, e in exact.items()})
            # errors below the reference's uncertainty are not resolved
            errors = {
                name: deviation if exact[name].value is None else max(deviation, exact[name].accuracy)
                for name, deviation in measured.items()
            }
            resolved = max((d for name, d in measured.items() if d > exact[name].accuracy), default=0.0)
        error = None if solved is None else max(errors.values(), default=0.0)
        if error is not None and not math.isfinite(error):
            # A result that exists only on one side is a failure, not a large error.
            error, errors = None, {name: value for name, value in errors.items() if math.isfinite(value)}
        return Level(
            accuracy=accuracy,
            settings={} if solved is None else solved.settings,
            error=error,
            errors=errors,
            at_most=error is not None and resolved < error,
            gap=None if solved is None else solved.gap,
            time_min=min(times),
            time_median=statistics.median(times),
            runs=len(times),
        )


def _judge(
    solve: Callable[[float], Solved], accuracies: Sequence[float], plan: Plan, reference: Independent, clock: Clock
) -> _Judge:
    """Compute the reference: the solver's own tightest solution, and independent results as far as available in time.

    Done first, so that one-time initialisation is not attributed to the first level.
    """
    judged = [accuracy for accuracy in accuracies if accuracy >= REFERENCE_FACTOR * LEAST_ACCURACY]
    tightest = max(LEAST_ACCURACY, (judged or accuracies)[-1] / REFERENCE_FACTOR)
    solution = solve(tightest)
    external, independent, origin = reference(), {}, ""
    if external is not None:
        try:
            independent = external.results(Watch(plan.reference_time, clock))
            origin = external.made
        except OutOfTime:
            origin = f"one {external.made} was given up after {plan.reference_time:.3g} s"
        except ArithmeticError as failure:
            origin = f"one {external.made} broke off ({type(failure).__name__})"
    uncertainty = max(tightest, solution.estimated)
    own = {name: Exact(value, uncertainty) for name, value in solution.results.items() if name not in independent}
    itself = f"the same case solved to {tightest:g}"
    if uncertainty > tightest:
        itself += f", its own estimate {uncertainty:.1g}"
    if all(exact.value is None for exact in own.values()) and independent:
        return _Judge(origin, independent, own, tightest)
    if independent:
        itself = f"{', '.join(name for name, exact in own.items() if exact.value is not None)}: {itself}"
    return _Judge(f"{origin}; {itself}" if origin else itself, independent, own, tightest)
