"""Interface of a kind's random design problems, and how competitors are checked."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from app.designs.kind import Answer
from oracles.rivals.starts import Strength

Body = dict[str, Any]


@dataclass
class Field:
    """Competitors of an answer.

    ``check`` maps a check request, with the answer's effects, to the checked result, None without one; feasible
    competitors count by their objective as minimised. ``tried``: number evaluated; ``best``: lowest objective; ``by``:
    the search that found it; ``strength``: effort of the local searches, None for the kind's default.
    """

    problem: Problem
    checked: Callable[[Body], Body | None]
    strength: Strength | None = None
    tried: int = 0
    best: float = math.inf
    by: str = ""

    def check(self, body: Body, by: str = "random") -> Body | None:
        """Check a competitor."""
        self.tried += 1
        result = self.checked(body)
        if result is not None and self.problem.broken(result) <= 0.0:
            value = self.problem.objective(result)
            if value is not None:
                self.enter(value**self.problem.sign, by)
        return result

    def enter(self, value: float, by: str) -> None:
        """Add a feasible competitor that was checked elsewhere."""
        if value < self.best:
            self.best, self.by = value, by


class Problem(Protocol):
    """A random design problem, and how to compare solutions."""

    @property
    def body(self) -> Body:
        """The design request."""

    @property
    def sort(self) -> str:
        """The form or the objective."""

    @property
    def sign(self) -> int:
        """+1 if the objective is minimised, -1 if it is maximised."""

    def objective(self, result: Body) -> float | None:
        """The objective value of a checked result or a design."""

    def given(self, answer: Answer) -> Body | None:
        """The check request for a design's answer; None if it cannot be expressed exactly."""

    def rivals(self, rng: np.random.Generator, answer: Answer, field: Field) -> None:
        """Add all competitors allowed by form and bounds; feasible ones count."""

    def broken(self, result: Body) -> float:
        """Relative violation of the most violated limit; 0 if all are met."""

    def neighbours(self, steps: Sequence[float]) -> Iterator[tuple[str, float, Problem]]:
        """Variants with one limit relaxed (positive) or tightened (negative) by these relative steps, with the limit's
        name."""

    def wider(self) -> Iterator[Problem]:
        """Relaxations of this problem, whose answers must not be worse."""


def excess(value: float | None, limit: float | None) -> float:
    """Relative excess of a value over its limit; 0 if either is missing."""
    if limit is None or value is None:
        return 0.0
    return max(value / limit - 1.0, 0.0) if limit > 0 else (0.0 if value <= 0 else math.inf)


STEPS = (1e-4, 1e-3, 1e-2)
"""Relative changes of the neighbours' limits."""


def loosened(
    body: Body, group: str, names: Mapping[str, int], steps: Sequence[float]
) -> Iterator[tuple[str, float, Body]]:
    """Requests with one limit of a group changed; ``names`` gives +1 if a larger value is looser, -1 otherwise."""
    for name, sign in names.items():
        limit = body[group].get(name)
        for step in steps if limit else ():
            for share in (step, -step):
                value = limit * (1.0 + share) ** sign
                yield name, share, {**body, group: {**body[group], name: value}}
