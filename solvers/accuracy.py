"""Error against time of any problem, measured on the problem itself over a ladder of accuracies.

A solver takes the wanted accuracy as an input and turns it into settings; here the same case is solved on every rung
from loose to tight, each rung's error is its distance from a reference two orders tighter than the tightest rung, and
the runs are interleaved (one of each rung in turn), so that a machine that slows down slows every rung alike.

Source: the work-precision diagrams of E. Hairer, G. Wanner, Solving Ordinary Differential Equations II.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from solvers.errors import InvalidInput

LEAST_ACCURACY, GREATEST_ACCURACY = 1e-12, 1e-1
LADDER = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10)
REFERENCE_ACCURACY = 1e-12

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
    """The table, how its reference was made, and the cheapest level that meets the wanted accuracy (None: none)."""

    levels: tuple[Level, ...]
    reference: str
    recommended: Level | None


def require_accuracy(accuracy: float) -> None:
    """Refuse, with InvalidInput, an accuracy outside [1e-12, 1e-1]."""
    if not LEAST_ACCURACY <= accuracy <= GREATEST_ACCURACY:
        raise InvalidInput("accuracy", "lies outside what can be asked for", "[1e-12, 1e-1]")


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
    wanted: float,
    ladder: Sequence[float] = LADDER,
    time_budget: float = 5.0,
    most_runs: int = 7,
    clock: Clock = time.perf_counter,
) -> Study:
    """Solve one case at every accuracy of the ladder.

    solve        the case at a wanted accuracy; an ArithmeticError marks that level as failed
    wanted       the accuracy that the recommendation must meet
    time_budget  [s] after which no further round begins; the first round, which gives the errors, always ends

    Raises InvalidInput for accuracies or a budget that make no sense, and whatever ``solve`` raises on the reference.
    """
    require_accuracy(wanted)
    if not (math.isfinite(time_budget) and time_budget > 0):
        raise InvalidInput("time_budget", "must be positive", "(0, inf)")
    rungs = sorted(set(ladder), reverse=True)
    for accuracy in rungs:
        require_accuracy(accuracy)
    tightest = max(LEAST_ACCURACY, min(REFERENCE_ACCURACY, rungs[-1] / 100.0))
    started = clock()
    # The reference comes first, so that whatever is worked out once per process is not billed to the first rung.
    reference = solve(tightest)

    solved: dict[float, Solved | None] = {}
    times: dict[float, list[float]] = {accuracy: [] for accuracy in rungs}
    for turn in range(most_runs):
        if turn and clock() - started > time_budget:
            break
        for accuracy in rungs:
            if turn and solved[accuracy] is None:
                continue
            begun = clock()
            try:
                answer = solve(accuracy)
            except ArithmeticError:
                answer = None
            times[accuracy].append(clock() - begun)
            solved.setdefault(accuracy, answer)

    levels = tuple(_level(accuracy, solved[accuracy], times[accuracy], reference) for accuracy in rungs)
    good = [level for level in levels if level.error is not None and level.error <= wanted]
    return Study(
        levels=levels,
        reference=f"the same case solved to {tightest:g}",
        recommended=min(good, key=lambda level: level.time_min, default=None),
    )


def _level(accuracy: float, solved: Solved | None, times: Sequence[float], reference: Solved) -> Level:
    errors = {} if solved is None else relative_errors(solved.results, reference.results)
    error = None if solved is None else max(errors.values(), default=0.0)
    if error is not None and not math.isfinite(error):
        # A result that exists on one side only is a failure of the level, not a large error.
        error, errors = None, {name: value for name, value in errors.items() if math.isfinite(value)}
    settings = {} if solved is None else solved.settings
    return Level(accuracy, settings, error, errors, min(times), statistics.median(times), len(times))
