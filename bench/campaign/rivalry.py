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
    """The rivals of an answer: ``check`` is from a check request, with the answer's own effects, to the checked result,
    None where it has none; what keeps the limits counts, by its objective as made small.

    ``tried`` counts all that were looked at, ``best`` is the least objective, ``by`` what found it; ``strength`` is how
    hard local searches try, None as hard as the kind's campaign does.
    """

    problem: Problem
    checked: Callable[[Body], Body | None]
    strength: Strength | None = None
    tried: int = 0
    best: float = math.inf
    by: str = ""

    def check(self, body: Body, by: str = "random") -> Body | None:
        """Put a part to the check."""
        self.tried += 1
        result = self.checked(body)
        if result is not None and self.problem.broken(result) <= 0.0:
            value = self.problem.objective(result)
            if value is not None:
                self.enter(value**self.problem.sign, by)
        return result

    def enter(self, value: float, by: str) -> None:
        """A rival that was checked elsewhere and keeps the limits."""
        if value < self.best:
            self.best, self.by = value, by


class Problem(Protocol):
    """A random design problem, and how other ways of solving it are told."""

    @property
    def body(self) -> Body:
        """The design request."""

    @property
    def sort(self) -> str:
        """The form or the objective."""

    @property
    def sign(self) -> int:
        """+1 where the objective is made small, -1 where it is made great."""

    def objective(self, result: Body) -> float | None:
        """What is wanted, of a checked result or a design's."""

    def given(self, answer: Answer) -> Body | None:
        """The check request of a design's answer; None where no check can be told of it to all digits."""

    def rivals(self, rng: np.random.Generator, answer: Answer, field: Field) -> None:
        """Enter what the form and the bounds allow; each counts if it keeps the limits."""

    def broken(self, result: Body) -> float:
        """By what share the worst of the limits is missed; 0 where all are kept."""

    def neighbours(self, steps: Sequence[float]) -> Iterator[tuple[str, float, Problem]]:
        """The same problem with one limit looser (a share above 0) or tighter (below) by these steps, and the limit's
        name."""

    def wider(self) -> Iterator[Problem]:
        """Problems that allow all that this one allows, and more: their answers must not be worse."""


def excess(value: float | None, limit: float | None) -> float:
    """By what share a value exceeds its limit; nothing does where none of the two is asked."""
    if limit is None or value is None:
        return 0.0
    return max(value / limit - 1.0, 0.0) if limit > 0 else (0.0 if value <= 0 else math.inf)


STEPS = (1e-4, 1e-3, 1e-2)
"""How much looser and tighter the limits of neighbours are."""


def loosened(
    body: Body, group: str, names: Mapping[str, int], steps: Sequence[float]
) -> Iterator[tuple[str, float, Body]]:
    """Bodies with one limit of a group changed; ``names`` tells of each +1 where a greater value is looser, -1 where a
    smaller one is."""
    for name, sign in names.items():
        limit = body[group].get(name)
        for step in steps if limit else ():
            for share in (step, -step):
                value = limit * (1.0 + share) ** sign
                yield name, share, {**body, group: {**body[group], name: value}}
