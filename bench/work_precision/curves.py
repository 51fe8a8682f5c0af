"""Work-precision curves: every method at each of its settings over the same cases."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

Case = TypeVar("Case")
Results = Mapping[str, float]

MIN_ERROR = 1e-17
"""Position of a zero error in the plot."""


@dataclass(frozen=True)
class Method(Generic[Case]):
    """A method: name, settings from loose to tight, and number of cases.

    A setting maps a case to results by name, or raises ArithmeticError; only the returned results are judged. ``part``
    assigns the method to a part of a page with several sets of results. ``goals`` are the median times [s] that some
    settings are to take at most.
    """

    name: str
    settings: Mapping[str, Callable[[Case], Results]]
    cases: int = 200
    part: str = ""
    goals: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Point:
    """A setting: median time [s] and median maximum relative error over the cases, the worst error, the failures, and
    the time that is the goal."""

    setting: str
    time: float
    error: float
    worst: float
    cases: int
    failures: int
    goal: float | None = None


@dataclass(frozen=True)
class Curve:
    name: str
    points: tuple[Point, ...]
    part: str = ""

    def cheapest(self, error: float) -> Point | None:
        """The cheapest setting with this median error."""
        return min((p for p in self.points if p.error <= error), key=lambda p: p.time, default=None)


def measure(
    methods: Sequence[Method[Case]], cases: Sequence[Case], exact: Sequence[Results], repeats: int = 3
) -> list[Curve]:
    """Run all settings of all methods, interleaved by case, so that drifts in machine speed affect them equally.

    The time of a case is processor time, the minimum of ``repeats`` runs (of one if a run takes over 0.1 s).
    """
    times = {(m.part, m.name, s): [] for m in methods for s in m.settings}
    errors = {key: [] for key in times}
    for number, (case, truth) in enumerate(zip(cases, exact, strict=True)):
        for method in methods:
            if number >= method.cases:
                continue
            for setting, solve in method.settings.items():
                seconds, error = _run(solve, case, truth, repeats)
                times[method.part, method.name, setting].append(seconds)
                errors[method.part, method.name, setting].append(error)
    return [
        Curve(
            m.name,
            tuple(_point(s, times[m.part, m.name, s], errors[m.part, m.name, s], m.goals.get(s)) for s in m.settings),
            m.part,
        )
        for m in methods
    ]


def _run(solve: Callable[[Case], Results], case: Case, truth: Results, repeats: int) -> tuple[float, float]:
    least, found = math.inf, None
    for _ in range(repeats):
        started = time.process_time()
        try:
            found = solve(case)
        except ArithmeticError:
            found = None
        least = min(least, time.process_time() - started)
        if least > 0.1 or found is None:
            break
    if found is None or None in found.values():
        return least, math.inf
    return least, max(abs(found[n] - x) / abs(x) if x else abs(found[n]) for n, x in ((n, truth[n]) for n in found))


def _point(setting: str, times: Sequence[float], errors: Sequence[float], goal: float | None) -> Point:
    solved = [e for e in errors if math.isfinite(e)]
    return Point(
        setting,
        statistics.median(times),
        statistics.median(solved) if solved else math.inf,
        max(solved, default=math.inf),
        len(errors),
        len(errors) - len(solved),
        goal,
    )
