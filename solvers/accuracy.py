"""Error against time of any problem, measured on the problem itself over a ladder of accuracies.

A solver takes the wanted accuracy as an input and turns it into settings; here the same case is solved on every rung
from loose to tight. Each rung's error is its distance from a reference: an independent solution where a wing has one,
or else the solver's own, two orders tighter than the tightest rung. The runs are interleaved (one of each rung in
turn), so that a machine that slows down slows every rung alike.

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

LEAST_ACCURACY, GREATEST_ACCURACY = 1e-12, 1e-1
LADDER = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
TWO_ORDERS = 100.0

Clock = Callable[[], float]


@dataclass(frozen=True)
class Solved:
    """What one solution says of itself: main results by name (None where one does not exist) and its settings."""

    results: Mapping[str, float | None]
    settings: Mapping[str, float | int | str] = field(default_factory=dict)


@dataclass(frozen=True)
class Level:
    """One rung: the greatest relative error over the main results, None where the rung failed; times in seconds."""

    accuracy: float
    settings: Mapping[str, float | int | str]
    error: float | None
    errors: Mapping[str, float]
    time_min: float
    time_median: float
    runs: int


@dataclass(frozen=True)
class Study:
    """The table, how its reference was made, and the level that suits the goal (None: none does)."""

    levels: tuple[Level, ...]
    reference: str
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
class Reference:
    """Main results found by other means, far tighter than any rung, and a sentence on how."""

    made: str
    results: Callable[[], Mapping[str, float | None]]


@dataclass(frozen=True)
class Plan:
    """The rungs, how often each is run, and the time [s] after which no further solution begins.

    The reference and the loosest rung are always solved; rungs that the time does not reach are left out.
    """

    ladder: Sequence[float] = LADDER
    runs: int = 20
    time: float = 10.0

    def __post_init__(self) -> None:
        for accuracy in self.ladder:
            require_accuracy(accuracy)
        _require_time("study_budget", self.time)


def require_accuracy(accuracy: float) -> None:
    """Refuse, with InvalidInput, an accuracy outside [1e-12, 1e-1]."""
    if not LEAST_ACCURACY <= accuracy <= GREATEST_ACCURACY:
        raise InvalidInput("accuracy", "lies outside what can be asked for", "[1e-12, 1e-1]")


def _require_time(field: str, seconds: float) -> None:
    if not (math.isfinite(seconds) and seconds > 0):
        raise InvalidInput(field, "must be positive", "(0, inf)")


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


def study(
    solve: Callable[[float], Solved],
    goal: Goal,
    plan: Plan | None = None,
    reference: Reference | None = None,
    clock: Clock = time.perf_counter,
) -> Study:
    """Solve one case at every accuracy of the ladder.

    solve      the case at a wanted accuracy; an ArithmeticError marks that level as failed
    reference  an independent solution; without one the solver judges itself, and rungs too tight for that are left out

    Raises whatever ``solve`` raises besides, and whatever the reference raises.
    """
    plan = plan or Plan()
    started = clock()
    # The reference comes first, so that whatever is worked out once per process is not billed to the first rung.
    if reference is None:
        rungs = sorted({a for a in plan.ladder if a >= TWO_ORDERS * LEAST_ACCURACY}, reverse=True)
        tightest = max(LEAST_ACCURACY, rungs[-1] / TWO_ORDERS)
        exact, made = solve(tightest).results, f"the same case solved to {tightest:g}"
    else:
        rungs = sorted(set(plan.ladder), reverse=True)
        solve(rungs[0])
        exact, made = reference.results(), reference.made

    solved: dict[float, Solved | None] = {}
    times: dict[float, list[float]] = {accuracy: [] for accuracy in rungs}
    for turn in range(plan.runs):
        for accuracy in rungs:
            begun = clock()
            if solved and (begun - started > plan.time or (turn and solved.get(accuracy) is None)):
                continue
            try:
                answer = solve(accuracy)
            except ArithmeticError:
                answer = None
            times[accuracy].append(clock() - begun)
            solved.setdefault(accuracy, answer)

    levels = tuple(_level(accuracy, solved[accuracy], times[accuracy], exact) for accuracy in rungs if times[accuracy])
    return Study(levels, made, goal.pick(levels))


def _level(accuracy: float, solved: Solved | None, times: Sequence[float], exact: Mapping[str, float | None]) -> Level:
    errors = {} if solved is None else relative_errors(solved.results, exact)
    error = None if solved is None else max(errors.values(), default=0.0)
    if error is not None and not math.isfinite(error):
        # A result that exists on one side only is a failure of the level, not a large error.
        error, errors = None, {name: value for name, value in errors.items() if math.isfinite(value)}
    settings = {} if solved is None else solved.settings
    return Level(accuracy, settings, error, errors, min(times), statistics.median(times), len(times))
