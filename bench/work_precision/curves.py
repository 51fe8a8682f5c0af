"""From methods and cases to curves: every method at each of its settings, over the same cases, in one run."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

Case = TypeVar("Case")
Results = Mapping[str, float]

LEAST_ERROR = 1e-17
"""Where an error of zero is drawn."""


@dataclass(frozen=True)
class Method(Generic[Case]):
    """A way to the results: its name, its settings from loose to tight, and over how many of the cases it is run.

    A setting gives the results by name, and raises ArithmeticError where it finds none. It is judged by those that it
    gives. ``part`` names the part of a page that it belongs to, where a page has parts with results of their own.
    """

    name: str
    settings: Mapping[str, Callable[[Case], Results]]
    cases: int = 200
    part: str = ""


@dataclass(frozen=True)
class Point:
    """One setting: medians over the cases of time [s] and of the greatest relative error, the worst, the failures."""

    setting: str
    time: float
    error: float
    worst: float
    cases: int
    failures: int


@dataclass(frozen=True)
class Curve:
    name: str
    points: tuple[Point, ...]
    part: str = ""

    def cheapest(self, error: float) -> Point | None:
        """The cheapest setting that reaches an error in the median."""
        return min((p for p in self.points if p.error <= error), key=lambda p: p.time, default=None)


def measure(
    methods: Sequence[Method[Case]], cases: Sequence[Case], exact: Sequence[Results], repeats: int = 3
) -> list[Curve]:
    """Run all settings of all methods, case by case, so that a machine that slows down slows all of them alike.

    The time of a case is the processor's, the least of ``repeats`` runs (one where a run takes over a tenth of a
    second).
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
            tuple(_point(s, times[m.part, m.name, s], errors[m.part, m.name, s]) for s in m.settings),
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


def _point(setting: str, times: Sequence[float], errors: Sequence[float]) -> Point:
    solved = [e for e in errors if math.isfinite(e)]
    return Point(
        setting,
        statistics.median(times),
        statistics.median(solved) if solved else math.inf,
        max(solved, default=math.inf),
        len(errors),
        len(errors) - len(solved),
    )
